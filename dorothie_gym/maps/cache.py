"""Cache of compiled towns: one `.npz` archive for each source file, in the folder `towns` of the user's cache."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.metadata
import io
import json
import logging
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeAlias, TypedDict, get_type_hints

import numpy as np

from dorothie_gym.errors import InputFileError, TownArchiveError, one_line
from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.model import (
    NO_STREET,
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
)
from dorothie_gym.maps.town import MAX_EXTENT, LightPhase, LightProgramme, Town
from dorothie_gym.support import portable_arrays, portable_math
from dorothie_gym.support.files import PART
from dorothie_gym.support.input_files import ARRAY_ERRORS, MAX_OPENDRIVE, MIB, read_file
from dorothie_gym.support.schemas import convert
from dorothie_gym.support.user_cache import cache_folder, discard, read_signed, remove, write_signed

ARCHIVE_FORMAT = 3
"""Version of the archive format; raise it when the same town would be written differently."""

MAX_ARCHIVE = 512 * MIB
"""Largest content of an archive [bytes]; a town takes up to some megabytes."""

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
"""Element types of a town, named as the arguments of `Town`."""

_DIGEST_LENGTH = 64
"""Hexadecimal digits of SHA-256."""

_Column: TypeAlias = "list[object] | dict[str, list[list[int]]]"
"""One field of all elements: the values or, for arrays, `{"shapes": ...}` with the numbers in the array `floats`."""


def pack(town: Town, key: str) -> bytes:
    """Returns a town as the bytes of an `.npz` file.

    All arrays are concatenated in the member `floats`. The rest is JSON in the member `document`; its
    floats are written with all digits. The zip comment at the end is the SHA-256 of all preceding bytes.

    Args:
        town: town to archive.
        key: key of the archive, checked by `unpack`.
    """
    arrays: list[Array] = []
    document: dict[str, object] = {
        "format": ARCHIVE_FORMAT,
        "key": key,
        "name": town.name,
        "traffic": town.traffic,
        "cruise": town.cruise,
        "titled": town.titled,
    }
    for part, kind in PARTS.items():
        elements = getattr(town, part)
        document[part] = {
            f.name: _column([getattr(element, f.name) for element in elements], arrays)
            for f in dataclasses.fields(kind)
        }
    text = json.dumps(document, default=_plain, separators=(",", ":")).encode()
    buffer = io.BytesIO()
    np.savez(buffer, document=np.frombuffer(text, np.uint8), floats=np.concatenate([np.empty(0), *arrays]))
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.comment = bytes(_DIGEST_LENGTH)  # placeholder; the comment is the last part of a zip file
    body = buffer.getvalue()[:-_DIGEST_LENGTH]
    return body + hashlib.sha256(body).hexdigest().encode()


def unpack(data: bytes, key: str) -> Town:
    """Returns the town of an archive; the checksum is verified before anything is parsed.

    Raises:
        TownArchiveError: the bytes are damaged, or have another format or key.
    """
    body = memoryview(data)[:-_DIGEST_LENGTH]
    if hashlib.sha256(body).hexdigest().encode() != data[-_DIGEST_LENGTH:]:
        raise TownArchiveError("its checksum is wrong")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            if sum(member.file_size for member in archive.zip.infolist()) > MAX_ARCHIVE:
                raise TownArchiveError("it is larger than any town")
            document = json.loads(archive["document"].tobytes())
            floats: Array = archive["floats"]
        if (document["format"], document["key"]) != (ARCHIVE_FORMAT, key):
            raise TownArchiveError("it is of another format or another town")
        return _town(document, floats)
    except TownArchiveError:
        raise
    except (
        *ARRAY_ERRORS,
        KeyError,
        AttributeError,
        OSError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise TownArchiveError(f"it holds no town: {one_line(error)}") from error


def _column(values: list[object], arrays: list[Array]) -> _Column:
    """Returns one field of all elements as JSON; the numbers of arrays are appended to `arrays`."""
    if not values or not isinstance(values[0], np.ndarray):
        return values
    columns = [np.ascontiguousarray(value, dtype=np.float64) for value in values]
    arrays.extend(column.ravel() for column in columns)
    return {"shapes": [list(column.shape) for column in columns]}


def _plain(value: object) -> object:
    """Converts values that JSON does not support: numpy scalars and nested dataclasses."""
    if isinstance(value, np.generic):
        return value.item()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    raise TypeError(f"a town cannot be archived with a {type(value).__name__} in it: {value!r}")


def _town(document: Mapping[str, Any], floats: Array) -> Town:
    name, traffic, cruise, titled = (document[key] for key in ("name", "traffic", "cruise", "titled"))
    if not isinstance(name, str) or floats.dtype != np.float64 or floats.ndim != 1:
        raise TownArchiveError("its name is no text, or its numbers are no floats")
    if cruise is not None and not isinstance(cruise, float):
        raise TownArchiveError("its cruise speed is no number")
    if not isinstance(titled, bool):
        raise TownArchiveError("whether its streets have titles is no truth value")
    numbers = _ArrayReader(floats)
    parts: dict[str, list[Any]] = {}
    for part, kind in PARTS.items():
        types = get_type_hints(kind)
        columns = {field: list(numbers.values(field, column, types[field])) for field, column in document[part].items()}
        rows = zip(*columns.values(), strict=True)
        parts[part] = [kind(**dict(zip(columns, row, strict=True))) for row in rows]
    if not numbers.at_end:
        raise TownArchiveError("it holds more numbers than its town has")
    town = Town(name=name, traffic=DrivingSide(traffic), cruise=cruise, titled=titled, **parts)
    if fault := next(_faults(town), None):
        raise TownArchiveError(f"it holds no sound town: {fault}")
    return town


class _PhaseRow(TypedDict):
    """Light phase as JSON."""

    duration: float
    green: list[int]
    yellow: list[int]


def _phases(rows: list[_PhaseRow]) -> tuple[LightPhase, ...]:
    return tuple(
        LightPhase(duration=row["duration"], green=tuple(row["green"]), yellow=tuple(row["yellow"])) for row in rows
    )


_CONVERTERS: dict[str, Callable[..., object]] = {"type": LinkType, "kind": SignalKind, "phases": _phases}
"""Constructors of the fields that are not plain numbers, strings or tuples of these."""


class _ArrayReader:
    """Splits the numbers of an archive into arrays, in the order of writing."""

    def __init__(self, floats: Array) -> None:
        self._floats, self._at = floats, 0

    @property
    def at_end(self) -> bool:
        """Whether all numbers were read."""
        return self._at == len(self._floats)

    def values(self, name: str, column: _Column, kind: Any) -> Iterator[object]:
        """Yields one field of all elements, in the type of the field."""
        if isinstance(column, dict):
            for shape in column["shapes"]:
                if not all(type(size) is int and 0 <= size <= len(self._floats) for size in shape):
                    raise TownArchiveError("an array has a size that is no number")
                count = int(np.prod(shape))
                yield self._floats[self._at : self._at + count].reshape(shape)
                self._at += count
        else:
            convert(column, list[kind])  # checks the types; a whole number stays one
            yield from map(_CONVERTERS.get(name, _frozen), column)


def _frozen(value: object) -> object:
    """Converts lists to tuples, nested ones included."""
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value


def _faults(town: Town) -> Iterator[str]:
    """Yields faults of a town: references to missing elements, and arrays of wrong shapes or lengths."""
    for part in ("lanes", "streets", "sites", "crosswalks", "sidewalks"):
        if [element.id for element in getattr(town, part)] != list(range(len(getattr(town, part)))):
            yield f"{part} are not numbered from 0"
    lanes, streets, signals = len(town.lanes), len(town.streets), {signal.id for signal in town.signals}
    refers = [
        *((end, lanes) for link in town.links for end in (link.source, link.target)),
        *((lane, lanes) for junction in town.junctions for lane in junction.connectors),
        *((lane, lanes) for street in town.streets for lane in street.lanes),
        *((lane, lanes) for signal in town.signals for lane in signal.lanes),
        *((site.lane, lanes) for site in town.sites),
    ]
    named = [lane.street for lane in town.lanes] + [walk.street for walk in town.sidewalks]
    refers += [(street, streets) for street in (*named, *(site.street for site in town.sites)) if street != NO_STREET]
    if not all(0 <= row < count for row, count in refers):
        yield "an element refers to one that does not exist"
    for lane in town.lanes:
        if lane.points.shape != (len(lane.widths), 3) or len(lane.widths) < 2 or not lane.speed_limit > 0.0:
            yield f"lane {lane.id} has no line, widths or speed limit"
    if not all(walk.points.ndim == 2 and walk.points.shape[1] == 3 for walk in town.sidewalks):
        yield "a sidewalk has no line"
    arrays = [array for lane in town.lanes for array in (lane.points, lane.widths)]
    arrays += [crosswalk.outline for crosswalk in town.crosswalks] + [walk.points for walk in town.sidewalks]
    places = [site.position + site.waypoint for site in town.sites] + [each.position for each in town.signals]
    if not all(bool(np.all(np.abs(array) < 1e9)) for array in (*arrays, *map(np.array, places))):
        yield "a position is not finite"
    if not town.extent <= MAX_EXTENT:
        yield "it is too large"
    lines = [lane.points for lane in town.lanes] + [walk.points for walk in town.sidewalks]
    if not all(
        bool(np.all(np.sum(np.diff(line[:, :2], axis=0) ** 2, axis=1) > 0.0)) for line in lines if line.ndim == 2
    ):
        yield "two points of a line are in one place"
    for programme in town.programmes:
        shown = {signal for phase in programme.phases for signal in (*phase.green, *phase.yellow)}
        if not ({*programme.signals} | shown) <= signals or not all(phase.duration > 0.0 for phase in programme.phases):
            yield f"the lights of junction {programme.junction_id} have a phase that cannot be shown"


# --- Entries in the cache folder -------------------------------------------------------------------------------------

MOST_TOWNS = 64
"""Maximum number of entries; the oldest are removed beyond it. A town takes up to some megabytes."""

_log = logging.getLogger(__name__)


def through_cache(path: Path, read: Callable[[Path], Town]) -> Town:
    """Returns the town of a file from the cache, or reads the file and adds the town to the cache.

    A damaged entry is replaced (`user_cache.read_signed`). A cache that cannot be written is logged at level DEBUG and
    otherwise ignored.

    Args:
        path: source file.
        read: compiles the file if the cache has no entry; its exceptions are passed on and nothing is cached.
    """
    folder = towns_folder()
    compiler = compiler_digest() if folder is not None else None
    content = _content(path)
    if folder is None or compiler is None or content is None:
        return read(path)
    key = _key(compiler, path, content)
    town = _recall(folder, key)
    if town is None:
        town = read(path)
        if _content(path) == content:  # else the file changed in between and the version of the town is unknown
            _keep(folder, key, town)
    return town


def towns_folder() -> Path | None:
    """Returns the folder of the cached towns, which need not exist; None if caching is turned off."""
    cache = cache_folder()
    return None if cache is None else cache / "towns"


@functools.cache
def compiler_digest() -> str | None:
    """Returns a digest of all that determines the compiled town except its source file.

    It covers the sources of this package and of the arithmetic that it uses (`angles`, `portable_math`,
    `portable_arrays` and their compilation), and the versions of numpy and scipy, which may round differently. None if
    the sources cannot be read.
    """
    digest = hashlib.sha256(f"format {ARCHIVE_FORMAT}, numpy {np.__version__}".encode())
    digest.update(f"scipy {importlib.metadata.version('scipy')}".encode())
    sources = package_sources("dorothie_gym.maps")
    if sources:
        sources += arithmetic_sources()
    for name, text in sources:
        digest.update(f"{name} {len(text)}\n".encode() + text)
    return digest.hexdigest() if sources else None


def arithmetic_sources() -> list[tuple[str, bytes]]:
    """Returns names and contents of the modules that compute elementary functions for this and other packages."""
    own = {f"{module.__name__}.py": module.__file__ for module in (portable_arrays, portable_math)}
    found = [(name, Path(file).read_bytes()) for name, file in own.items() if file is not None]
    return found + package_sources("dorothie_gym.support.compilation")


def package_sources(package: str) -> list[tuple[str, bytes]]:
    """Returns names and contents of the modules of a package and its parts; nothing if they cannot be read."""
    return sorted(_sources(files(package), ""))


def _sources(folder: Traversable, prefix: str) -> Iterator[tuple[str, bytes]]:
    for entry in folder.iterdir():
        name = f"{prefix}/{entry.name}"
        if entry.is_dir():
            yield from _sources(entry, name)
        elif name.endswith(".py"):
            yield name, entry.read_bytes()


def _content(path: Path) -> bytes | None:
    """Returns the bytes of a file, or None if it cannot be read; the compiler reports the reason."""
    try:
        return read_file(path, MAX_OPENDRIVE)
    except (OSError, InputFileError):
        return None


def _key(compiler: str, path: Path, content: bytes) -> str:
    """Returns the key of an entry; it includes the name of the file, which names the town, and its suffix."""
    digest = hashlib.sha256(f"{compiler} {path.suffix.lower()} {path.stem!r}\n".encode())
    digest.update(content)
    return digest.hexdigest()


def _recall(folder: Path, key: str) -> Town | None:
    entry = folder / f"{key}.npz"
    data = read_signed(entry)
    if data is None:
        return None
    try:
        return unpack(data, key)
    except TownArchiveError as error:
        discard(entry, str(error))
        return None


def _keep(folder: Path, key: str, town: Town) -> None:
    """Writes an entry atomically: other processes see the whole entry or none."""
    data = pack(town, key)
    try:
        write_signed(folder / f"{key}.npz", data)
        remove_oldest(folder, MOST_TOWNS)
    except OSError as error:
        _log.debug("the town %s cannot be kept in %s: %s", town.name, folder, error)


def remove_oldest(folder: Path, most: int) -> None:
    """Removes the oldest archives beyond a number, with the temporary files of processes that were killed.

    Raises:
        OSError: the folder cannot be read or written.
    """
    entries = [entry for entry in folder.iterdir() if entry.suffix in (".npz", PART)]
    if len(entries) > most:
        entries.sort(key=lambda entry: (entry.lstat().st_mtime_ns, entry.name))
        for entry in entries[:-most]:
            remove(entry)
