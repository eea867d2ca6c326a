"""The journal of frames: blocks of numbers, appended as they happen, each readable or not there at all.

A block is a kind (4 letters), the length of its content in bytes and the content's checksum (CRC-32), both as four
bytes, little-endian, and the content: the frame (8 bytes) and rows of the kind's type. Whatever moment the process
dies at, everything but a torn last block is read back.
"""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sessions.encoding import read_bytes
from dorothie_gym.sessions.layout import MAX_FRAMES_FILE
from dorothie_gym.sessions.scene import ACTOR_DTYPE, LIGHT_DTYPE, WEATHER_DTYPE, Scene, SceneTable
from dorothie_gym.sessions.trajectory import TRAJECTORY_COLUMNS, Trajectory, trajectory_of

CAR: Final = b"CARS"
ACTORS: Final = b"ACTR"
LIGHTS: Final = b"LGHT"
WEATHER: Final = b"WTHR"

DTYPES: Final[Mapping[bytes, np.dtype[Any]]] = MappingProxyType(
    {
        CAR: np.dtype("<f8"),
        ACTORS: ACTOR_DTYPE.newbyteorder("<"),
        LIGHTS: LIGHT_DTYPE.newbyteorder("<"),
        WEATHER: WEATHER_DTYPE.newbyteorder("<"),
    }
)
"""What the content is made of; the car's is rows of nine numbers, as in `TRAJECTORY_COLUMNS`."""

_SIZES: Final = {
    kind: dtype.itemsize * (len(TRAJECTORY_COLUMNS) if kind == CAR else 1) for kind, dtype in DTYPES.items()
}

_HEAD: Final = struct.Struct("<4sII")
_FRAME: Final = struct.Struct("<q")


def encode_block(kind: bytes, frame: int, rows: NDArray[Any]) -> bytes:
    """Returns a block: the rows (contiguous) that were recorded at a frame; for the car: of which it is the first."""
    content = _FRAME.pack(frame) + (rows if sys.byteorder == "little" else rows.astype(DTYPES[kind])).tobytes()
    return _HEAD.pack(kind, len(content), zlib.crc32(content)) + content


def read_journal(path: Path) -> tuple[Trajectory, Scene]:
    """Reads a journal up to its last complete block.

    Raises:
        SessionError: it is too large to be that of a session.
        OSError: it cannot be read.
    """
    blocks: dict[bytes, list[tuple[int, bytes]]] = {kind: [] for kind in DTYPES}
    for kind, frame, body in _blocks(read_bytes(path, MAX_FRAMES_FILE)):
        blocks[kind].append((frame, body))
    cars = np.frombuffer(b"".join(body for _, body in blocks[CAR]), dtype=DTYPES[CAR])
    tables = {kind: _table(blocks[kind], DTYPES[kind]) for kind in (ACTORS, LIGHTS, WEATHER)}
    scene = Scene(actors=tables[ACTORS], lights=tables[LIGHTS], weather=tables[WEATHER])
    return trajectory_of(cars.reshape(-1, len(TRAJECTORY_COLUMNS))), scene


def _blocks(content: bytes) -> Iterator[tuple[bytes, int, bytes]]:
    view, place = memoryview(content), 0
    while place + _HEAD.size <= len(view):
        kind, length, checksum = _HEAD.unpack_from(view, place)
        body = view[place + _HEAD.size : place + _HEAD.size + length]
        place += _HEAD.size + length
        if kind not in DTYPES or length < _FRAME.size or (length - _FRAME.size) % _SIZES[kind]:
            return
        if zlib.crc32(body) != checksum:
            return  # torn here, or damaged: nothing after it can be trusted
        yield kind, _FRAME.unpack_from(body)[0], bytes(body[_FRAME.size :])


def _table(blocks: list[tuple[int, bytes]], dtype: np.dtype[Any]) -> SceneTable:
    frames = np.array([frame for frame, _ in blocks], dtype=np.int64)
    sizes = [len(body) // dtype.itemsize for _, body in blocks]
    offsets = np.concatenate(([0], np.cumsum(sizes))).astype(np.int64)
    rows = np.frombuffer(b"".join(body for _, body in blocks), dtype=dtype)
    return SceneTable(frames, offsets, rows.astype(dtype.newbyteorder("="), copy=False))
