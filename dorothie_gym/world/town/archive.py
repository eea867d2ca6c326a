"""A town as bytes and back: an `.npz` file that holds every number to the last bit, and nothing that could be run."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import zipfile
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from dorothie_gym.world.town.lights import LightPhase, LightProgramme
from dorothie_gym.world.town.model import (
    Array,
    Crosswalk,
    Junction,
    Lane,
    LaneLink,
    LinkType,
    Sidewalk,
    Signal,
    SignalKind,
    Site,
    Street,
    Town,
)

FORMAT = 1
"""To be raised when the same town would be written differently."""

# What a town consists of, named as the arguments of `Town`.
PARTS: dict[str, type] = {
    "lanes": Lane,
    "links": LaneLink,
    "junctions": Junction,
    "streets": Street,
    "sites": Site,
    "signals": Signal,
    "crosswalks": Crosswalk,
    "sidewalks": Sidewalk,
    "programmes": LightProgramme,
}

_DIGEST_LENGTH = 64  # hexadecimal digits of SHA-256

_Column = list[Any] | dict[str, list[list[int]]]


class ArchiveError(ValueError):
    """Bytes are not the archive of a town that was asked for: damaged, of another format, or of another town."""


def pack(town: Town, key: str) -> bytes:
    """A town as the bytes of an `.npz` file.

    All arrays lie one after another in its member `floats`; everything else is JSON in its member `document`, where
    floats are written so that they are read back exactly. The zip comment at the end is the SHA-256 of all before it.

    Args:
        town: the town.
        key: what the archive is filed under; `unpack` wants the same one.
    """
    arrays: list[Array] = []
    document: dict[str, Any] = {"format": FORMAT, "key": key, "name": town.name}
    for part, kind in PARTS.items():
        records = getattr(town, part)
        document[part] = {
            f.name: _column([getattr(r, f.name) for r in records], arrays) for f in dataclasses.fields(kind)
        }
    text = json.dumps(document, default=_plain, separators=(",", ":")).encode()
    buffer = io.BytesIO()
    np.savez(buffer, document=np.frombuffer(text, np.uint8), floats=np.concatenate([np.empty(0), *arrays]))
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.comment = bytes(_DIGEST_LENGTH)  # to be replaced below; the comment is the last thing in a zip file
    body = buffer.getvalue()[:-_DIGEST_LENGTH]
    return body + hashlib.sha256(body).hexdigest().encode()


def unpack(data: bytes, key: str) -> Town:
    """The town that `pack` wrote under a key; nothing is parsed before the checksum is found to be right.

    Raises:
        ArchiveError: the bytes are damaged, or another format, or filed under another key.
    """
    body = memoryview(data)[:-_DIGEST_LENGTH]
    if hashlib.sha256(body).hexdigest().encode() != data[-_DIGEST_LENGTH:]:
        raise ArchiveError("its checksum is wrong")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            document = json.loads(archive["document"].tobytes())
            floats: Array = archive["floats"]
        if (document["format"], document["key"]) != (FORMAT, key):
            raise ArchiveError("it is of another format or another town")
        return _town(document, floats)
    except ArchiveError:
        raise
    except (
        ValueError,
        TypeError,
        KeyError,
        AttributeError,
        OSError,
        EOFError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise ArchiveError(f"it holds no town: {error}") from error


def _column(values: list[Any], arrays: list[Array]) -> _Column:
    """One field of all records: the values, or of arrays the shapes, while their numbers go to `arrays`."""
    if not values or not isinstance(values[0], np.ndarray):
        return values
    arrays.extend(np.ascontiguousarray(value, dtype=np.float64).ravel() for value in values)
    return {"shapes": [list(value.shape) for value in values]}


def _plain(value: object) -> object:
    """What JSON does not know by itself: numpy's numbers and records within records."""
    if isinstance(value, np.generic):
        return value.item()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    raise TypeError(f"a town cannot be archived with a {type(value).__name__} in it: {value!r}")


def _town(document: dict[str, Any], floats: Array) -> Town:
    numbers = _Reader(floats)
    parts = {}
    for part, kind in PARTS.items():
        columns = {name: list(numbers.values(name, column)) for name, column in document[part].items()}
        rows = zip(*columns.values(), strict=True)
        parts[part] = [kind(**dict(zip(columns, row, strict=True))) for row in rows]
    if not numbers.at_end:
        raise ArchiveError("it holds more numbers than its town has")
    return Town(name=document["name"], **parts)


# Fields that are more than numbers, texts and tuples of them.
_KINDS: dict[str, Callable[[Any], Any]] = {
    "type": LinkType,
    "kind": SignalKind,
    "phases": lambda rows: tuple(LightPhase(**{name: _frozen(value) for name, value in row.items()}) for row in rows),
}


class _Reader:
    """Hands out the arrays of an archive in the order in which they were written."""

    def __init__(self, floats: Array) -> None:
        self._floats, self._at = floats, 0

    @property
    def at_end(self) -> bool:
        return self._at == len(self._floats)

    def values(self, name: str, column: _Column) -> Iterator[Any]:
        """One field of all records, as the records hold it."""
        if isinstance(column, dict):
            for shape in column["shapes"]:
                count = int(np.prod(shape))
                yield self._floats[self._at : self._at + count].reshape(shape)
                self._at += count
        else:
            yield from map(_KINDS.get(name, _frozen), column)


def _frozen(value: Any) -> Any:
    """Lists as tuples, all the way down."""
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value
