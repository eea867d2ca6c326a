"""Folders of version 1: `trajectory.csv` and `summary.json` instead of `frames.parquet` and an outcome."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym.errors import SessionError
from dorothie_gym.recording.file_names import MAX_FRAMES, SUMMARY_FILE, TRAJECTORY_FILE
from dorothie_gym.recording.json_io import Fields, from_line, read_lines
from dorothie_gym.recording.trajectory import TRAJECTORY_COLUMNS, TRAJECTORY_DTYPE, WHOLE_COLUMNS, Trajectory

_HEADER: Final = ",".join(TRAJECTORY_COLUMNS)


def read_trajectory(folder: Path) -> tuple[Trajectory, bool]:
    """Reads `trajectory.csv`.

    Returns:
        The rows, and whether the file is whole: one that was cut off is read up to its last complete line.

    Raises:
        SessionError: other columns, a field that is no finite number, or frames that do not rise.
    """
    path = folder / TRAJECTORY_FILE
    lines, torn = read_lines(path, MAX_FRAMES)
    if not lines:  # cut off in the first line, or before it
        return np.empty(0, dtype=TRAJECTORY_DTYPE), False
    if lines[0] != _HEADER:
        raise SessionError(f"{path}, line 1: the columns are {lines[0][:200]!r}; they must be {_HEADER!r}")
    rows: list[tuple[Any, ...]] = []
    for number, line in enumerate(lines[1:], start=2):
        row = _decode_row(line, f"{path}, line {number}")
        if rows and row[0] <= rows[-1][0]:
            raise SessionError(f"{path}, line {number}: field 'frame' is {row[0]}; it must be above {rows[-1][0]}")
        rows.append(row)
    return np.array(rows, dtype=TRAJECTORY_DTYPE), not torn


def read_summary(folder: Path) -> tuple[Mapping[str, Any], int, int] | None:
    """Returns outcome and numbers of events and frames of `summary.json`; None where it is missing or cut off."""
    path = folder / SUMMARY_FILE
    lines, torn = read_lines(path, MAX_FRAMES)
    if torn or not lines:
        return None
    fields = Fields(from_line("\n".join(lines), str(path)), str(path))
    return fields.mapping("summary"), fields.integer("events", 0), fields.integer("frames", 0)


def _decode_row(line: str, where: str) -> tuple[Any, ...]:
    texts = line.split(",")
    if len(texts) != len(TRAJECTORY_COLUMNS):
        raise SessionError(f"{where}: {len(texts)} fields; there must be {len(TRAJECTORY_COLUMNS)}")
    values: list[int | float] = []
    for name, text in zip(TRAJECTORY_COLUMNS, texts, strict=True):
        whole = name in WHOLE_COLUMNS
        try:
            value = int(text) if whole else float(text)
        except ValueError:
            value = math.nan
        if not abs(value) < 2**62:
            kind = "whole" if whole else "finite"
            raise SessionError(f"{where}: field {name!r} is {text[:80]!r}; it must be a {kind} number")
        values.append(value)
    return tuple(values)
