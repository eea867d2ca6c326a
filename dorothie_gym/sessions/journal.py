"""The journal of frames: blocks of numbers, appended as they happen, each readable or not there at all.

A block is a kind (4 letters), the length of its content in bytes and the content's checksum (CRC-32), both as four
bytes, little-endian, and the content: the frame (8 bytes) and rows of the kind's type. Whatever moment the process
dies at, everything but a torn last block is read back.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sessions.encoding import read_bytes
from dorothie_gym.sessions.layout import MAX_FRAMES_FILE
from dorothie_gym.sessions.scene import ACTOR_DTYPE, LIGHT_DTYPE, WEATHER_DTYPE, Rows, Scene, SceneTable
from dorothie_gym.sessions.trajectory import TRAJECTORY_DTYPE, Trajectory

CAR: Final = b"CARS"
ACTORS: Final = b"ACTR"
LIGHTS: Final = b"LGHT"
WEATHER: Final = b"WTHR"

DTYPES: Final[Mapping[bytes, np.dtype[Any]]] = MappingProxyType(
    {CAR: TRAJECTORY_DTYPE, ACTORS: ACTOR_DTYPE, LIGHTS: LIGHT_DTYPE, WEATHER: WEATHER_DTYPE}
)

_HEAD: Final = struct.Struct("<4sII")
_FRAME: Final = struct.Struct("<q")


def encode_block(kind: bytes, frame: int, rows: Rows) -> bytes:
    """Returns a block: the rows that were recorded at a frame (for the car: of which it is the first)."""
    content = _FRAME.pack(frame) + rows.astype(DTYPES[kind].newbyteorder("<"), copy=False).tobytes()
    return _HEAD.pack(kind, len(content), zlib.crc32(content)) + content


def read_journal(path: Path) -> tuple[Trajectory, Scene]:
    """Reads a journal up to its last complete block.

    Raises:
        SessionError: it is too large to be that of a session.
        OSError: it cannot be read.
    """
    blocks: dict[bytes, list[tuple[int, Rows]]] = {kind: [] for kind in DTYPES}
    for kind, frame, rows in _blocks(read_bytes(path, MAX_FRAMES_FILE)):
        blocks[kind].append((frame, rows))
    cars = [rows for _, rows in blocks[CAR]]
    trajectory = np.concatenate(cars) if cars else np.empty(0, dtype=TRAJECTORY_DTYPE)
    tables = {kind: _table(blocks[kind], DTYPES[kind]) for kind in (ACTORS, LIGHTS, WEATHER)}
    return trajectory, Scene(actors=tables[ACTORS], lights=tables[LIGHTS], weather=tables[WEATHER])


def _blocks(content: bytes) -> Iterator[tuple[bytes, int, Rows]]:
    place = 0
    while place + _HEAD.size <= len(content):
        kind, length, checksum = _HEAD.unpack_from(content, place)
        place += _HEAD.size
        body = content[place : place + length]
        place += length
        size = length - _FRAME.size
        if kind not in DTYPES or size < 0 or size % DTYPES[kind].itemsize or zlib.crc32(body) != checksum:
            return  # torn here, or damaged: nothing after it can be trusted
        rows = np.frombuffer(body, dtype=DTYPES[kind].newbyteorder("<"), offset=_FRAME.size)
        yield kind, _FRAME.unpack_from(body)[0], rows.astype(DTYPES[kind], copy=False)


def _table(blocks: list[tuple[int, Rows]], dtype: np.dtype[Any]) -> SceneTable:
    if not blocks:
        return SceneTable.empty(dtype)
    frames: NDArray[np.int64] = np.array([frame for frame, _ in blocks], dtype=np.int64)
    sizes = [len(rows) for _, rows in blocks]
    offsets = np.concatenate(([0], np.cumsum(sizes))).astype(np.int64)
    return SceneTable(frames, offsets, np.concatenate([rows for _, rows in blocks]))
