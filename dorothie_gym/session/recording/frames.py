"""Frames file (`frames.parquet`) and frames journal: state of the car and of its surroundings, frame by frame."""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import SessionError, short_repr
from dorothie_gym.session.recording.files import MAX_FRAME, MAX_FRAMES, MAX_FRAMES_FILE, read_bytes
from dorothie_gym.session.recording.surroundings import (
    ACTOR_DTYPE,
    LIGHT_DTYPE,
    LIGHT_STATES,
    WEATHER_DTYPE,
    ActorKind,
    Rows,
    SceneTable,
    Surroundings,
    actor_rows,
)
from dorothie_gym.session.recording.trajectory import (
    OPEN_COLUMNS,
    TRAJECTORY_COLUMNS,
    TRAJECTORY_DTYPE,
    Trajectory,
    check_rising,
    trajectory_of,
)
from dorothie_gym.support.files import replacing
from dorothie_gym.support.input_files import ParquetLimits, raising, read_parquet
from dorothie_gym.support.libraries import pa, pq

if TYPE_CHECKING:
    from dorothie_gym.session.recording.validation import ReadReport

_TABLES: Final = {"actors": ACTOR_DTYPE, "lights": LIGHT_DTYPE, "weather": WEATHER_DTYPE}
_WORDS: Final = {
    "kind": tuple(kind.name.lower() for kind in ActorKind),
    "state": tuple(str(colour) for colour in LIGHT_STATES),
}
"""Columns that are words in the file and numbers in the arrays."""

_LIMITS: Final = ParquetLimits(file=MAX_FRAMES_FILE, rows=MAX_FRAMES, values=32 * MAX_FRAMES, content=MAX_FRAMES_FILE)

MAX_MAGNITUDE: Final = 1e9
"""Largest magnitude of a number of the car or its surroundings, in the units of the columns."""

_FALLBACK: Final = {"kind": int(ActorKind.OTHER)}
"""Numbers of unknown words."""

_SMOOTH: Final = (
    "x",
    "y",
    "heading",
    "speed",
    "steer",
    *(f"actors.list.element.{n}" for n in ("x", "y", "heading", "speed")),
)
"""Columns that change little from row to row: splitting their bytes compresses better."""


def write_frames(path: Path, trajectory: Trajectory, scene: Surroundings) -> None:
    """Writes the file atomically.

    Raises:
        SessionError: the scene has a frame that the trajectory lacks, or a column of another length.
        OSError: it cannot be written.
    """
    columns: dict[str, pa.Array] = {}
    for name in TRAJECTORY_COLUMNS:
        columns[name] = pa.array(np.ascontiguousarray(trajectory[name]), from_pandas=name in OPEN_COLUMNS)
    for name, table in (("actors", scene.actors), ("lights", scene.lights), ("weather", scene.weather)):
        if len(table):
            columns[name] = _nested(name, table, trajectory["frame"])
    for name, values in scene.columns.items():
        if name in columns or len(values) != len(trajectory):
            raise SessionError(f"{path}: column {name!r} has {len(values)} values for {len(trajectory)} frames")
        columns[name] = pa.array(values.tolist() if values.dtype == object else values)
    arrow = pa.table(columns)
    leaves = _leaves(arrow.schema)
    with replacing(path) as part:
        pq.write_table(
            arrow,
            part,
            compression="zstd",
            compression_level=1,
            write_statistics=False,
            use_dictionary=[leaf for leaf in leaves if leaf not in _SMOOTH],
            use_byte_stream_split=[leaf for leaf in leaves if leaf in _SMOOTH],
            store_schema=False,
        )


def read_frames(path: Path, report: ReadReport) -> tuple[Trajectory, Surroundings]:
    """Returns trajectory and scene of the file.

    Args:
        path: the file.
        report: receives the unknown fields and columns.

    Raises:
        SessionError: it is missing or damaged, lacks a column, is larger than a session's, or its frames do not rise.
        OSError: it cannot be read.
    """
    if not path.exists():
        raise SessionError(f"{path}: is missing")
    with _parquet_errors(path):
        with raising(SessionError):
            arrow = read_parquet(path, _LIMITS)
        trajectory = _trajectory(arrow, path)
        tables = {
            name: _table(arrow.column(name), name, dtype, trajectory["frame"], path, report)
            if name in arrow.column_names
            else SceneTable.empty(dtype)
            for name, dtype in _TABLES.items()
        }
        columns = {}
        for name in arrow.column_names:
            if name not in TRAJECTORY_COLUMNS and name not in _TABLES:
                report.keep(f"{path.name}: column {name!r}")
                columns[name] = _further(arrow.column(name))
    return trajectory, Surroundings(columns=columns, **tables)


@contextmanager
def _parquet_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:  # the last: names in a damaged footer
        if isinstance(error, OSError) and error.errno is not None:
            raise
        reason = str(error).partition("\n")[0][:200]
        raise SessionError(f"{path}: not a readable Parquet file ({reason})") from None


def _trajectory(arrow: pa.Table, path: Path) -> Trajectory:
    trajectory = np.empty(arrow.num_rows, dtype=TRAJECTORY_DTYPE)
    for name in TRAJECTORY_COLUMNS:
        if name not in arrow.column_names:
            raise SessionError(f"{path}: column {name!r} is missing")
        column = arrow.column(name)
        if column.null_count and name not in OPEN_COLUMNS:
            raise SessionError(f"{path}: column {name!r} has rows without a value")
        trajectory[name] = _typed(column, trajectory.dtype[name], f"{path}: column {name!r}", name in OPEN_COLUMNS)
    frames = trajectory["frame"]
    if len(frames) and (frames[0] < 0 or frames[-1] >= MAX_FRAME):
        raise SessionError(f"{path}: column 'frame' must be in 0..{MAX_FRAME - 1}")
    check_rising(frames, -1, f"{path}: column 'frame'")
    return trajectory


def _typed(
    column: pa.ChunkedArray | pa.Array, wanted: np.dtype[np.generic], where: str, unknown: bool
) -> NDArray[np.generic]:
    """Returns numbers of a column in a numpy type.

    Args:
        column: the column.
        wanted: type of whole numbers or of floats.
        where: file and column, for messages.
        unknown: whether floats may be null or NaN for an unknown value.

    Raises:
        SessionError: the column holds other types than numbers, or numbers out of range.
    """
    whole = wanted.kind in "iu"
    if not (pa.types.is_integer(column.type) or (pa.types.is_floating(column.type) and not whole)):
        expected = "whole numbers" if whole else "numbers"
        raise SessionError(f"{where} holds {str(column.type)[:60]}; it must hold {expected}")
    values: NDArray[np.generic] = column.cast(pa.from_numpy_dtype(wanted)).to_numpy(zero_copy_only=False)
    if not whole and not np.all((np.abs(values) <= MAX_MAGNITUDE) | (unknown & np.isnan(values))):
        raise SessionError(f"{where} has a value that is not finite, or beyond {MAX_MAGNITUDE:g}")
    return values


# --- Nested columns --------------------------------------------------------------------------------------------------


def _nested(name: str, table: SceneTable, frames: NDArray[np.int64]) -> pa.Array:
    places = np.searchsorted(frames, table.frames)
    if np.any(places >= len(frames)) or np.any(frames[np.minimum(places, len(frames) - 1)] != table.frames):
        raise SessionError(f"{name} are recorded at frames that the trajectory lacks")
    absent = np.ones(len(frames), dtype=bool)
    absent[places] = False
    if name == "weather":
        spread = np.zeros(len(frames), dtype=WEATHER_DTYPE)
        spread[places] = table.rows
        return _struct(spread, pa.array(absent))
    sizes = np.zeros(len(frames), dtype=np.int64)
    sizes[places] = np.diff(table.offsets)
    offsets = np.concatenate(([0], np.cumsum(sizes))).astype(np.int32)
    return pa.ListArray.from_arrays(pa.array(offsets), _struct(table.rows, None), mask=pa.array(absent))


def _struct(rows: Rows, mask: pa.Array | None) -> pa.StructArray:
    names = rows.dtype.names or ()
    return pa.StructArray.from_arrays([_field(rows, name) for name in names], list(names), mask=mask)


def _field(rows: Rows, name: str) -> pa.Array:
    values = pa.array(np.ascontiguousarray(rows[name]))
    return pa.DictionaryArray.from_arrays(values, pa.array(_WORDS[name])) if name in _WORDS else values


def _table(
    column: pa.ChunkedArray,
    name: str,
    dtype: np.dtype[np.void],
    frames: NDArray[np.int64],
    path: Path,
    report: ReadReport,
) -> SceneTable:
    array = column.combine_chunks()
    if isinstance(array, pa.ChunkedArray):  # combine_chunks keeps an empty column chunked in some releases
        array = pa.concat_arrays(array.chunks) if array.num_chunks else pa.array([], type=column.type)
    present = array.is_valid().to_numpy(zero_copy_only=False)
    if name == "weather":
        if not pa.types.is_struct(array.type):
            raise SessionError(f"{path}: column {name!r} must hold structs, not {array.type}")
        sizes = present.astype(np.int64)
        values = array.filter(array.is_valid())
    else:
        if not (pa.types.is_list(array.type) and pa.types.is_struct(array.type.value_type)):
            raise SessionError(f"{path}: column {name!r} must hold lists of structs, not {array.type}")
        sizes = array.value_lengths().fill_null(0).to_numpy().astype(np.int64)
        values = array.flatten()
    recorded = frames[present]
    offsets = np.concatenate(([0], np.cumsum(sizes[present]))).astype(np.int64)
    return SceneTable(recorded, offsets, _rows(values, name, dtype, path, report))


def _rows(values: pa.StructArray, name: str, dtype: np.dtype[np.void], path: Path, report: ReadReport) -> Rows:
    rows = np.empty(len(values), dtype=dtype)
    given = [field.name for field in values.type]
    for field in given:
        if field not in (dtype.names or ()):
            report.keep(f"{path.name}: field {name}.{field} (left out)")
    for field in dtype.names or ():
        if field not in given:
            raise SessionError(f"{path}: column {name!r} lacks the field {field!r}")
        column = values.field(field)
        if column.null_count:
            raise SessionError(f"{path}: field {name}.{field} has rows without a value")
        if field in _WORDS:
            rows[field] = _numbers(column, field, path)
        else:
            rows[field] = _typed(column, dtype[field], f"{path}: field {name}.{field}", unknown=False)
    return rows


def _numbers(column: pa.Array, field: str, path: Path) -> NDArray[np.int64]:
    """Returns the numbers of the words of a column."""
    if not pa.types.is_dictionary(column.type):
        column = column.dictionary_encode()
    words: Sequence[str] = column.dictionary.to_pylist()
    known = {word: number for number, word in enumerate(_WORDS[field])}
    numbers = np.array([known.get(word, _FALLBACK.get(field, -1)) for word in words], dtype=np.int64)
    if np.any(numbers < 0):
        raise SessionError(f"{path}: {field!r} holds {short_repr(words)}; it must be of {', '.join(known)}")
    if not len(numbers):
        return numbers
    result: NDArray[np.int64] = numbers[column.indices.to_numpy()]
    return result


def _further(column: pa.ChunkedArray) -> NDArray[np.generic]:
    """Returns an unknown column as an array."""
    if column.null_count == 0 and pa.types.is_primitive(column.type):
        values: NDArray[np.generic] = column.to_numpy()
        return values
    objects = np.empty(len(column), dtype=object)
    objects[:] = column.to_pylist()
    return objects


def _leaves(schema: pa.Schema) -> list[str]:
    """Returns the paths of the leaf columns in the file."""

    def below(path: str, kind: pa.DataType) -> list[str]:
        if pa.types.is_struct(kind):
            return [leaf for field in kind for leaf in below(f"{path}.{field.name}", field.type)]
        if pa.types.is_list(kind):
            return below(f"{path}.list.element", kind.value_type)
        return [path]

    return [leaf for field in schema for leaf in below(field.name, field.type)]


# --- Journal: checksummed blocks, appended during the session --------------------------------------------------------

CAR: Final = b"CARS"
ACTORS: Final = b"ACTR"
LIGHTS: Final = b"LGHT"
WEATHER: Final = b"WTHR"

DTYPES: Final[Mapping[bytes, np.dtype[np.generic]]] = MappingProxyType(
    {
        CAR: np.dtype("<f8"),
        ACTORS: ACTOR_DTYPE.newbyteorder("<"),
        LIGHTS: LIGHT_DTYPE.newbyteorder("<"),
        WEATHER: WEATHER_DTYPE.newbyteorder("<"),
    }
)
"""Element type of each block; rows of the car are nine numbers, as in `TRAJECTORY_COLUMNS`."""

_SIZES: Final = {
    kind: dtype.itemsize * (len(TRAJECTORY_COLUMNS) if kind == CAR else 1) for kind, dtype in DTYPES.items()
}

_HEAD: Final = struct.Struct("<4sII")
_FRAME: Final = struct.Struct("<q")


def encode_block(kind: bytes, frame: int, rows: NDArray[np.generic]) -> bytes:
    """Returns the block of contiguous rows that were recorded at a frame, or, for the car, from that frame on."""
    content = _FRAME.pack(frame) + (rows if sys.byteorder == "little" else rows.astype(DTYPES[kind])).tobytes()
    return _HEAD.pack(kind, len(content), zlib.crc32(content)) + content


def read_journal(path: Path) -> tuple[Trajectory, Surroundings]:
    """Returns trajectory and scene of a journal up to its last complete block.

    Raises:
        SessionError: it is too large to be that of a session, or has values that no session has.
        OSError: it cannot be read.
    """
    blocks: dict[bytes, list[tuple[int, bytes]]] = {kind: [] for kind in DTYPES}
    for kind, frame, body in _blocks(read_bytes(path, MAX_FRAMES_FILE)):
        blocks[kind].append((frame, body))
    cars = np.frombuffer(b"".join(body for _, body in blocks[CAR]), dtype=DTYPES[CAR])
    if np.any(np.abs(cars) > MAX_FRAME):
        raise SessionError(f"{path}: the car has a value beyond {MAX_FRAME}")
    tables = {kind: _table_journal(blocks[kind], DTYPES[kind]) for kind in (ACTORS, LIGHTS, WEATHER)}
    scene = Surroundings(actors=tables[ACTORS], lights=tables[LIGHTS], weather=tables[WEATHER])
    _check_journal(scene, path)
    return trajectory_of(cars.reshape(-1, len(TRAJECTORY_COLUMNS))), scene


def _check_journal(scene: Surroundings, path: Path) -> None:
    for name, table in (("actors", scene.actors), ("lights", scene.lights), ("weather", scene.weather)):
        check_rising(table.frames, -1, f"{path}: {name}")
        if len(table) and table.frames[-1] >= MAX_FRAME:
            raise SessionError(f"{path}: {name}: frames are in 0..{MAX_FRAME - 1}")
    actor_rows(scene.actors.rows)
    states = scene.lights.rows["state"]
    if len(states) and not 0 <= states.min() <= states.max() < len(LIGHT_STATES):
        raise SessionError(f"{path}: lights: the state must be one of {', '.join(LIGHT_STATES)}")
    if not all(np.all(np.isfinite(scene.weather.rows[name])) for name in WEATHER_DTYPE.names or ()):
        raise SessionError(f"{path}: weather: a value is not finite")


def _blocks(content: bytes) -> Iterator[tuple[bytes, int, bytes]]:
    view, place = memoryview(content), 0
    while place + _HEAD.size <= len(view):
        kind, length, checksum = _HEAD.unpack_from(view, place)
        body = view[place + _HEAD.size : place + _HEAD.size + length]
        place += _HEAD.size + length
        if kind not in DTYPES or length < _FRAME.size or (length - _FRAME.size) % _SIZES[kind]:
            return
        if zlib.crc32(body) != checksum:
            return  # torn or damaged: later blocks cannot be trusted
        yield kind, _FRAME.unpack_from(body)[0], bytes(body[_FRAME.size :])


def _table_journal(blocks: list[tuple[int, bytes]], dtype: np.dtype[np.generic]) -> SceneTable:
    frames = np.array([frame for frame, _ in blocks], dtype=np.int64)
    sizes = [len(body) // dtype.itemsize for _, body in blocks]
    offsets = np.concatenate(([0], np.cumsum(sizes))).astype(np.int64)
    rows = np.frombuffer(b"".join(body for _, body in blocks), dtype=dtype)
    return SceneTable(frames, offsets, rows.astype(dtype.newbyteorder("="), copy=False))
