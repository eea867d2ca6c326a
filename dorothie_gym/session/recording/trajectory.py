"""State of the car, frame by frame."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import SessionError
from dorothie_gym.sim.config import FRAME_COLUMNS, FRAME_RATE

Trajectory: TypeAlias = NDArray[np.void]
"""Structured array (n,) of `TRAJECTORY_DTYPE`, in order of frames."""


TRAJECTORY_COLUMNS: Final = FRAME_COLUMNS
"""Frame (30 Hz), position [m], heading [rad, clockwise], speed [m/s], controls in [0, 1], [-1, 1], [0, 1], lane id."""


WHOLE_COLUMNS: Final = ("frame", "lane")
"""Columns of whole numbers."""


OPEN_COLUMNS: Final = ("speed", "throttle", "steer", "brake")
"""Columns that may hold NaN for unknown values."""


TENTHS: Final = 10
"""Frames a second of the benchmark and of SDN [Hz] (paper, section 4)."""


FRAMES_PER_TENTH: Final = FRAME_RATE // TENTHS
"""Frames of a native recording in one frame of the benchmark."""


TRAJECTORY_DTYPE: Final = np.dtype(
    [(name, np.int64 if name in WHOLE_COLUMNS else np.float64) for name in TRAJECTORY_COLUMNS]
)


_FIRST, _SECOND = map(TRAJECTORY_COLUMNS.index, WHOLE_COLUMNS)
_WHOLE: Final = slice(_FIRST, None, _SECOND - _FIRST)
"""The columns of whole numbers, as a slice: the second is the last column of all."""


def trajectory_of(rows: NDArray[np.float64]) -> Trajectory:
    """Returns the rows as a trajectory.

    Args:
        rows: (n, 9) float64, columns as in `TRAJECTORY_COLUMNS`.

    Raises:
        SessionError: as `checked_rows`.
    """
    rows = checked_rows(rows)
    trajectory = np.empty(len(rows), dtype=TRAJECTORY_DTYPE)
    for name, column in zip(TRAJECTORY_COLUMNS, rows.T, strict=True):
        trajectory[name] = column
    return trajectory


def checked_rows(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the rows (n, 9) if they are those of a trajectory.

    Raises:
        SessionError: another shape, a frame, place or lane that is not finite, a control that is infinite, or a frame
            or lane that is not whole.
    """
    rows = np.ascontiguousarray(rows, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != len(TRAJECTORY_COLUMNS):
        raise SessionError(f"trajectory: rows have shape {rows.shape}; it must be (n, {len(TRAJECTORY_COLUMNS)})")
    whole = rows[:, _WHOLE]
    if np.isfinite(rows).all() and (whole == np.rint(whole)).all():
        return rows
    for name, column in zip(TRAJECTORY_COLUMNS, rows.T, strict=True):
        if (np.isinf(column) if name in OPEN_COLUMNS else ~np.isfinite(column)).any():
            raise SessionError(f"trajectory: field {name!r} has a value that is not finite")
        if name in WHOLE_COLUMNS and (column != np.rint(column)).any():
            raise SessionError(f"trajectory: field {name!r} has a value that is not a whole number")
    return rows


def rows_of(trajectory: Trajectory) -> NDArray[np.float64]:
    """Returns a trajectory as rows (n, 9) float64, the inverse of `trajectory_of`."""
    return np.stack([trajectory[name].astype(np.float64) for name in TRAJECTORY_COLUMNS], axis=1)


def check_rising(frames: NDArray[np.int64] | NDArray[np.float64], last: int, where: str) -> None:
    """Checks that the frames rise, each above the one before, the first above `last`.

    Raises:
        SessionError: they do not; the message begins with `where` and names the first wrong frame.
    """
    if len(frames) == 0 or (frames[0] > last and (frames[1:] > frames[:-1]).all()):
        return
    falls = np.concatenate(([frames[0] <= last], frames[1:] <= frames[:-1]))
    k = int(np.argmax(falls))
    before = last if k == 0 else int(frames[k - 1])
    raise SessionError(f"{where}: frame {int(frames[k])} after {before}; each must be above the one before")
