"""Loops of centre lines: where a lane lies inside a bend that is tighter than its distance from the reference line."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.opendrive.car_paths import path_between
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, IntArray

SHARPEST = math.radians(100.0)
"""Change of direction from one sample to the next at which a line turns back [rad]."""

REACH = 20.0
"""Largest distance along the line from a turning point to the places at which the loop is cut off [m]."""

BEND = 6.0
"""Length of the line before and after these places that is drawn again as a bend [m]."""

NEAREST = 2.0
"""Largest distance between these places [m]."""

_LEAST_STEP = 0.1
"""Distance between compared samples [m]."""


def without_loops(line: Array) -> Array | None:
    """Returns the samples of a centre line (n, 4) without the loops on which it runs backwards.

    Inside such a bend the line passes the end of its loop, turns back, and turns once more. It is cut off where its
    parts before and after the loop meet, which are joined by a bend.

    Returns:
        The line, the same object if it has no loop; None if it never turns forward again.
    """
    before = len(line)
    while True:
        places, turns = _turning_points(line)
        if not len(turns):
            return line
        if len(turns) >= before:
            return None
        first, before = int(turns[0]), len(turns)
        close = turns[(turns > first) & (places[turns] - places[first] < REACH)]
        cut = _crossing(line, places, first, int(close[0]) if len(close) else first)
        if cut is None:
            return None
        line = _joined(line, places, *cut)


def turns_back(line: Array) -> bool:
    """Returns whether a line (n, >= 2) turns back somewhere."""
    return len(_turning_points(line)[1]) > 0


def _turning_points(line: Array) -> tuple[Array, IntArray]:
    """Returns the distance along a line at its points (n,) [m], and the points at which it turns back.

    Sections of roads overlap by some millimetres, which are no loops.
    """
    places = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(line[:, :2], axis=0).T))))
    apart = np.append(np.flatnonzero(np.diff(np.floor(places / _LEAST_STEP), prepend=-1.0)), len(line) - 1)
    steps = np.diff(line[apart, :2], axis=0)
    moving = pn.hypot(*steps.T) > 0.5 * _LEAST_STEP
    apart, steps = apart[:-1][moving], steps[moving]
    ways = steps / pn.hypot(*steps.T)[:, None]
    cosine = (ways[1:] * ways[:-1]).sum(axis=1)
    return places, apart[1:][cosine < pm.cos(SHARPEST)]


def _crossing(line: Array, places: Array, first: int, last: int) -> tuple[int, int] | None:
    """Returns the closest points before one turning point and after another one, or None if they are far apart."""
    begin = int(np.searchsorted(places, places[first] - REACH))
    end = int(np.searchsorted(places, places[last] + REACH, side="right"))
    before, after = line[begin : first + 1, :2], line[last:end, :2]
    gaps = pn.hypot(*np.moveaxis(before[:, None] - after[None, :], 2, 0))
    row, column = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
    return (begin + int(row), last + int(column)) if gaps[row, column] <= NEAREST else None


def _joined(line: Array, places: Array, first: int, last: int) -> Array:
    """Returns a line without the points between two that are close to each other, with a bend that a car can follow."""
    begin = max(int(np.searchsorted(places, places[first] - BEND)), 1)
    end = min(int(np.searchsorted(places, places[last] + BEND)), len(line) - 2)
    if begin < first and end > last:
        path = path_between(line[: begin + 1], line[end:], (float(line[begin, 3]), float(line[end, 3])))
        if path is not None:
            return np.concatenate((line[:begin], path, line[end + 1 :]))
    return np.concatenate((line[: first + 1], line[last:]))
