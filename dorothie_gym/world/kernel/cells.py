"""Square cells that list the lanes near them, and of each lane the stretch that can be closest from within the cell."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.compiling import allocating
from dorothie_gym.world.kernel.records import ENTRY, Records
from dorothie_gym.world.network.polyline import closest_on_segment
from dorothie_gym.world.town.model import Array

CELL = 4.0
"""Side of a cell [m]: finer than the network's own grid, so that the stretches are short."""

REACH = 6.0
"""A cell lists the lanes whose centre line comes this close to it [m]."""

SLACK = 1e-6
"""Safety of the bounds against rounding [m]."""

TURNED = 1.0
"""A lane that is off a body's heading by more than this [rad] costs more than this [m] in highway-env's ranking."""


class Cells(NamedTuple):
    """The lists of all cells.

    Attributes:
        origin: (2,) corner of the first cell [m].
        bounds: (rows, columns, 2) int32: first entry of each cell, and the one after its last.
        entries: `records.ENTRY`, those of a cell in the order of the lanes' ranks.
    """

    origin: Array
    bounds: NDArray[np.int32]
    entries: Records


def build_cells(points: Array, lanes: Records) -> Cells:
    """Lists the lanes of a town.

    Args:
        points: (p, 6) as in `polyline.LaneTable`.
        lanes: `records.LANE`.
    """
    order = np.argsort(lanes.rank).astype(np.int64)
    low = np.array([lanes.left_edge.min(), lanes.low_edge.min()]) - REACH - CELL
    high = np.array([lanes.right_edge.max(), lanes.high_edge.max()]) + REACH + CELL
    columns, rows = (int(n) for n in np.ceil((high - low) / CELL))
    counts = np.zeros((rows, columns), dtype=np.int32)
    none = np.zeros(0, dtype=ENTRY).view(np.recarray)
    _list_lanes(points, lanes, order, low, counts, none)
    stops = np.cumsum(counts.ravel(), dtype=np.int32).reshape(counts.shape)
    starts = stops - counts
    entries = np.zeros(int(stops[-1, -1]), dtype=ENTRY).view(np.recarray)
    _list_lanes(points, lanes, order, low, starts.copy(), entries)
    return Cells(low, np.ascontiguousarray(np.stack((starts, stops), axis=-1)), entries)


@allocating
def _list_lanes(
    points: Array,
    lanes: Records,
    order: NDArray[np.int64],
    origin: Array,
    cursors: NDArray[np.int32],
    entries: Records,
) -> None:
    """Counts the lanes of each cell in `cursors`; if there are `entries`, writes them where the cursors stand."""
    rows, columns = cursors.shape
    newest = np.full((rows, columns), -1, dtype=np.int32)
    for number in order:
        lane = lanes[number]
        for k in range(lane.first, lane.last):
            left, right = min(points[k, 0], points[k + 1, 0]), max(points[k, 0], points[k + 1, 0])
            low, high = min(points[k, 1], points[k + 1, 1]), max(points[k, 1], points[k + 1, 1])
            first_row = max(int((low - origin[1] - REACH) / CELL) - 1, 0)
            last_row = min(int((high - origin[1] + REACH) / CELL) + 1, rows - 1)
            first_column = max(int((left - origin[0] - REACH) / CELL) - 1, 0)
            last_column = min(int((right - origin[0] + REACH) / CELL) + 1, columns - 1)
            for row in range(first_row, last_row + 1):
                for column in range(first_column, last_column + 1):
                    if newest[row, column] == number:
                        continue
                    newest[row, column] = number
                    x, y = origin[0] + (column + 0.5) * CELL, origin[1] + (row + 0.5) * CELL
                    first, last = _stretch(points, lane.first, lane.last, x, y)
                    if first < 0:
                        continue
                    if len(entries) > 0:
                        _write(entries[cursors[row, column]], points, number, first, last)
                    cursors[row, column] += 1


@allocating
def _stretch(points: Array, first: int, last: int, x: float, y: float) -> tuple[int, int]:
    """First and last segment that can be closest from within the cell around a place; -1 where the lane is far away."""
    radius = CELL * math.sqrt(0.5)
    nearest = math.inf
    for k in range(first, last):
        _, gap = closest_on_segment(points, k, x, y)
        nearest = min(nearest, gap)
    nearest = math.sqrt(nearest)
    if nearest > REACH + radius + SLACK:
        return -1, -1
    # the distance changes by no more than `radius` between the middle and anywhere in the cell, for every segment
    limit = nearest + 2.0 * radius + SLACK
    low, high = last, first
    for k in range(first, last):
        _, gap = closest_on_segment(points, k, x, y)
        if gap <= limit * limit:
            low, high = min(low, k), max(high, k)
    return low, high


@allocating
def _write(entry: Records, points: Array, lane: int, first: int, last: int) -> None:
    low = high = points[first, 3]
    for k in range(first, last + 2):
        low, high = min(low, points[k, 3]), max(high, points[k, 3])
    middle, spread = 0.5 * (low + high), 0.5 * (high - low)
    entry.lane, entry.first, entry.last = lane, first, last
    entry.cos, entry.sin = math.cos(middle), math.sin(middle)
    entry.limit = math.cos(spread + TURNED) - SLACK if spread + TURNED < math.pi else -2.0
    entry.along_low = entry.across_low = math.inf
    entry.along_high = entry.across_high = -math.inf
    for k in range(first, last + 2):
        along = points[k, 0] * entry.cos + points[k, 1] * entry.sin
        across = points[k, 1] * entry.cos - points[k, 0] * entry.sin
        entry.along_low, entry.along_high = min(entry.along_low, along), max(entry.along_high, along)
        entry.across_low, entry.across_high = min(entry.across_low, across), max(entry.across_high, across)
