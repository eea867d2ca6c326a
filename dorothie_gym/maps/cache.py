"""Cache of compiled towns: an `.npz` archive for each source file, kept in the user's cache folder."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.metadata
import io
import json
import logging
import os
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from dorothie_gym.errors import TownArchiveError
from dorothie_gym.maps.model import (
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
from dorothie_gym.maps.traffic_lights import LightPhase, LightProgramme

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
        TownArchiveError: the bytes are damaged, or another format, or filed under another key.
    """
    body = memoryview(data)[:-_DIGEST_LENGTH]
    if hashlib.sha256(body).hexdigest().encode() != data[-_DIGEST_LENGTH:]:
        raise TownArchiveError("its checksum is wrong")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            document = json.loads(archive["document"].tobytes())
            floats: Array = archive["floats"]
        if (document["format"], document["key"]) != (FORMAT, key):
            raise TownArchiveError("it is of another format or another town")
        return _town(document, floats)
    except TownArchiveError:
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
        raise TownArchiveError(f"it holds no town: {error}") from error


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
        raise TownArchiveError("it holds more numbers than its town has")
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


# --- Towns that were read before, kept between runs in the user's cache folder ---------------------------------------

CACHE_VARIABLE = "DOROTHIE_GYM_CACHE"
"""Environment variable that names the cache folder; if it is set to nothing, no town is kept."""

MOST_TOWNS = 64
"""When there are more, those that were written first are removed: a town takes up to some megabytes."""

_log = logging.getLogger(__name__)


def through_cache(path: Path, read: Callable[[Path], Town]) -> Town:
    """The town in a file: as it was kept when it was read before, else read and kept for the next time.

    Args:
        path: the file.
        read: reads it where there is no entry; its errors are passed on, and nothing is kept then.
    """
    folder = cache_folder()
    compiler = compiler_digest() if folder is not None else None
    content = _content(path)
    if folder is None or compiler is None or content is None:
        return read(path)
    key = _key(compiler, path, content)
    town = _recall(folder, key)
    if town is None:
        town = read(path)
        if _content(path) == content:  # else it changed meanwhile, and nobody knows which version this is
            _keep(folder, key, town)
    return town


def cache_folder() -> Path | None:
    """Folder that towns are kept in, whether it exists or not; None if none are to be kept.

    `$DOROTHIE_GYM_CACHE/towns` if that is set; else within the user's cache folder: `$XDG_CACHE_HOME` or `~/.cache`,
    on macOS `~/Library/Caches`, on Windows `%LOCALAPPDATA%`.
    """
    wish = os.environ.get(CACHE_VARIABLE)
    if wish is not None:
        return Path(wish) / "towns" if wish else None
    try:
        if sys.platform == "win32":
            named = os.environ.get("LOCALAPPDATA")
            base = Path(named) if named else Path.home() / "AppData" / "Local"
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            named = os.environ.get("XDG_CACHE_HOME", "")
            base = Path(named) if Path(named).is_absolute() else Path.home() / ".cache"
    except RuntimeError:  # a user without a home
        return None
    return base / "dorothie_gym" / "towns"


@functools.cache
def compiler_digest() -> str | None:
    """Digest of all that decides which town a file becomes besides the file; None where our sources are not at hand.

    These are the sources of this package and the releases of the libraries that compute for it: another release of
    them may round differently.
    """
    digest = hashlib.sha256(f"format {FORMAT}, numpy {np.__version__}".encode())
    digest.update(f"scipy {importlib.metadata.version('scipy')}".encode())
    sources = sorted(_sources(files("dorothie_gym.maps"), ""))
    for name, text in sources:
        digest.update(f"{name} {len(text)}\n".encode() + text)
    return digest.hexdigest() if sources else None


def _sources(folder: Traversable, prefix: str) -> Iterator[tuple[str, bytes]]:
    for entry in folder.iterdir():
        name = f"{prefix}/{entry.name}"
        if entry.is_dir():
            yield from _sources(entry, name)
        elif name.endswith(".py"):
            yield name, entry.read_bytes()


def _content(path: Path) -> bytes | None:
    """What a file holds; None if it cannot be read, which whoever compiles it will say in better words."""
    try:
        return path.read_bytes()
    except OSError:
        return None


def _key(compiler: str, path: Path, content: bytes) -> str:
    """What an entry is filed under. A town is named like its file, and the suffix says which language it is in."""
    digest = hashlib.sha256(f"{compiler} {path.suffix.lower()} {path.stem!r}\n".encode())
    digest.update(content)
    return digest.hexdigest()


def _recall(folder: Path, key: str) -> Town | None:
    entry = folder / f"{key}.npz"
    try:
        return unpack(entry.read_bytes(), key)
    except FileNotFoundError:
        return None
    except (OSError, TownArchiveError) as error:
        _log.debug("the cached town %s is of no use and is read anew: %s", entry, error)
        return None


def _keep(folder: Path, key: str, town: Town) -> None:
    """Writes an entry in one step, so that other processes see all of it or nothing of it."""
    data = pack(town, key)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".tmp", delete=False) as draft:
            try:
                draft.write(data)
                draft.close()
                os.replace(draft.name, folder / f"{key}.npz")
            except OSError:
                draft.close()
                os.unlink(draft.name)
                raise
        _prune(folder)
    except OSError as error:
        _log.debug("the town %s cannot be kept in %s: %s", town.name, folder, error)


def _prune(folder: Path) -> None:
    """Removes the oldest entries where there are too many, and drafts of processes that were killed with them."""
    entries = [entry for entry in folder.iterdir() if entry.suffix in (".npz", ".tmp")]
    if len(entries) > MOST_TOWNS:
        entries.sort(key=lambda entry: (entry.stat().st_mtime_ns, entry.name))
        for entry in entries[:-MOST_TOWNS]:
            entry.unlink(missing_ok=True)
