"""Where the car was, frame by frame."""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.world.config import FRAME_COLUMNS

Trajectory: TypeAlias = NDArray[np.void]
"""Structured array (n,) of `TRAJECTORY_DTYPE`, in order of frames."""

TRAJECTORY_COLUMNS: Final = FRAME_COLUMNS
"""Frame (30 Hz), place [m], heading [rad, clockwise], speed [m/s], controls in [0, 1], [-1, 1], [0, 1], lane id."""

TRAJECTORY_DTYPE: Final = np.dtype(
    [(name, np.int64 if name in ("frame", "lane") else np.float64) for name in TRAJECTORY_COLUMNS]
)

TRAJECTORY_HEADER: Final = ",".join(TRAJECTORY_COLUMNS)

_TYPES: Final[dict[str, type[int] | type[float]]] = {
    name: int if name in ("frame", "lane") else float for name in TRAJECTORY_COLUMNS
}


def trajectory_of(rows: NDArray[np.float64]) -> Trajectory:
    """Returns the rows as a trajectory.

    Args:
        rows: (n, 9) float64, columns as in `TRAJECTORY_COLUMNS`.

    Raises:
        SessionError: another shape, a value that is not finite, or a frame or lane that is not whole.
    """
    rows = np.asarray(rows, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != len(TRAJECTORY_COLUMNS):
        raise SessionError(f"trajectory: rows have shape {rows.shape}; it must be (n, {len(TRAJECTORY_COLUMNS)})")
    trajectory = np.empty(len(rows), dtype=TRAJECTORY_DTYPE)
    for name, column in zip(TRAJECTORY_COLUMNS, rows.T, strict=True):
        if not np.all(np.isfinite(column)):
            raise SessionError(f"trajectory: field {name!r} has a value that is not finite")
        if _TYPES[name] is int and np.any(column != np.rint(column)):
            raise SessionError(f"trajectory: field {name!r} has a value that is not a whole number")
        trajectory[name] = column
    return trajectory


def encode_rows(trajectory: Trajectory) -> list[str]:
    """Returns one line of comma-separated values a row; floats in the shortest form that reads back the same."""
    return [",".join(repr(value) for value in row) for row in trajectory.tolist()]


def decode_rows(lines: list[str], where: str, first_line: int) -> Trajectory:
    """Reads what `encode_rows` returned.

    Args:
        lines: the lines.
        where: name of the file, for messages.
        first_line: number in the file of the first of the lines.

    Raises:
        SessionError: a line has another number of fields, a field is not a finite number, or a frame does not come
            after the one before.
    """
    rows: list[tuple[Any, ...]] = []
    for number, line in enumerate(lines, start=first_line):
        row = _decode_row(line, f"{where}, line {number}")
        if rows and row[0] <= rows[-1][0]:
            raise SessionError(f"{where}, line {number}: field 'frame' is {row[0]}; it must be above {rows[-1][0]}")
        rows.append(row)
    return np.array(rows, dtype=TRAJECTORY_DTYPE)


def _decode_row(line: str, where: str) -> tuple[Any, ...]:
    texts = line.split(",")
    if len(texts) != len(TRAJECTORY_COLUMNS):
        raise SessionError(f"{where}: {len(texts)} fields; there must be {len(TRAJECTORY_COLUMNS)}")
    values: list[int | float] = []
    for name, text in zip(TRAJECTORY_COLUMNS, texts, strict=True):
        try:
            value = _TYPES[name](text)
        except ValueError:
            value = float("nan")
        if not np.isfinite(value):
            kind = "whole" if _TYPES[name] is int else "finite"
            raise SessionError(f"{where}: field {name!r} is {text!r}; it must be a {kind} number")
        values.append(value)
    return tuple(values)
