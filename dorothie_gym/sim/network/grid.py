"""An index over the lanes of a network that finds the closest one exactly."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.polyline import (
    IntArray,
    LaneTable,
    closest_on_segment,
    distance,
    value_at,
)
from dorothie_gym.support.compilation import allocating

GRID_CELL = 8.0
"""Side of a cell [m]."""
CELL_REACH = 6.0
"""A cell lists the lanes whose centre line comes this close to it [m]: cars on a road are settled by their cell."""
SAME_LEVEL = 3.0
"""Lanes within this height [m] of a body may carry it; overpasses leave more room than that."""
SLACK = 1e-6
"""Safety of the bounds against rounding [m]; a share of 1e-9 is added for places far away."""

_Arrays: TypeAlias = tuple[Array, IntArray, Array, Array, IntArray, IntArray, float, float]
"""Points, offsets, ends and boxes of a `LaneTable`; cells (rows, columns, 2), each with where its lanes begin and stop
in the entries (m,); and the corner of the first cell, x and y [m]. A named tuple takes numba twice as long to read."""


class GridIndex:
    """Lanes by square cells.

    The distance by which highway-env ranks lanes is never less than the plain distance to the centre line. So when the
    best lane of a cell's list ranks below the reach of the list, no lane that is not listed can beat it. Where this
    does not settle the question (off the road), all lanes are asked whose bounding boxes are closer than the best one.

    Attributes:
        origin: corner of the first cell, x and y [m].
    """

    def __init__(self, table: LaneTable) -> None:
        """Lists the lanes of a table, whose rows are the results of queries."""
        low = table.boxes[:, :2].min(axis=0) - CELL_REACH
        high = table.boxes[:, 2:].max(axis=0) + CELL_REACH
        columns, rows = (int(n) for n in np.ceil((high - low) / GRID_CELL))
        self.origin = float(low[0]), float(low[1])
        counts = np.zeros((rows, columns), dtype=np.int64)
        nothing = np.empty(0, dtype=np.int64)
        _list_lanes(table.points, table.offsets, *self.origin, counts, nothing)
        stops = np.cumsum(counts.ravel()).reshape(counts.shape)
        starts = stops - counts
        entries = np.empty(int(stops[-1, -1]), dtype=np.int64)
        _list_lanes(table.points, table.offsets, *self.origin, starts.copy(), entries)
        cells = np.ascontiguousarray(np.stack((starts, stops), axis=-1))
        self._arrays: _Arrays = (*table, cells, entries, *self.origin)

    def closest(self, x: float, y: float, heading: float | None = None, height: float | None = None) -> int:
        """Returns the row of the lane with the least distance, the first one of several; see `TownNetwork`."""
        weight = 1.0
        if heading is None:
            heading, weight = 0.0, 0.0
        level = math.nan if height is None else height
        row = _closest(self._arrays, x, y, heading, weight, level)
        if row < 0:  # nothing at this height in the whole town
            return self.closest(x, y, heading if weight else None)
        return int(row)


@allocating
def _list_lanes(points: Array, offsets: IntArray, x0: float, y0: float, cursors: IntArray, entries: IntArray) -> None:
    """Counts the lanes of each cell in `cursors`; if there are `entries`, writes them where the cursors stand."""
    rows, columns = cursors.shape
    newest = np.full((rows, columns), -1, dtype=np.int64)
    reach = CELL_REACH + GRID_CELL * math.sqrt(0.5) + SLACK  # from the centre of a cell
    for lane in range(len(offsets) - 1):
        for k in range(offsets[lane], offsets[lane + 1] - 1):
            left, right = min(points[k, 0], points[k + 1, 0]), max(points[k, 0], points[k + 1, 0])
            low, high = min(points[k, 1], points[k + 1, 1]), max(points[k, 1], points[k + 1, 1])
            first_row = max(int((low - y0 - CELL_REACH) / GRID_CELL) - 1, 0)
            last_row = min(int((high - y0 + CELL_REACH) / GRID_CELL) + 1, rows - 1)
            first_column = max(int((left - x0 - CELL_REACH) / GRID_CELL) - 1, 0)
            last_column = min(int((right - x0 + CELL_REACH) / GRID_CELL) + 1, columns - 1)
            for row in range(first_row, last_row + 1):
                for column in range(first_column, last_column + 1):
                    if newest[row, column] == lane:
                        continue
                    x, y = x0 + (column + 0.5) * GRID_CELL, y0 + (row + 0.5) * GRID_CELL
                    _, gap = closest_on_segment(points, k, x, y)
                    if gap <= reach * reach:
                        newest[row, column] = lane
                        if len(entries) > 0:
                            entries[cursors[row, column]] = lane
                        cursors[row, column] += 1


@allocating
def _out_of_question(boxes: Array, lane: int, x: float, y: float, best: float) -> bool:
    """Returns whether the bounding box of a lane alone is farther away than the best lane."""
    dx = max(boxes[lane, 0] - x, x - boxes[lane, 2], 0.0)
    dy = max(boxes[lane, 1] - y, y - boxes[lane, 3], 0.0)
    return math.sqrt(dx * dx + dy * dy) * (1.0 - 1e-9) - SLACK > best


@allocating
def _closest(arrays: _Arrays, x: float, y: float, heading: float, weight: float, height: float) -> int:
    """Returns the row of the closest lane (-1: none at this height); a height of NaN matches all lanes."""
    points, offsets, ends, boxes, cells, entries, x0, y0 = arrays
    best, found = np.inf, -1
    anywhere = math.isnan(height)
    column, row = (x - x0) / GRID_CELL, (y - y0) / GRID_CELL
    if 0.0 <= column < cells.shape[1] and 0.0 <= row < cells.shape[0]:
        i, j = int(row), int(column)
        for e in range(cells[i, j, 0], cells[i, j, 1]):
            lane = entries[e]
            if _out_of_question(boxes, lane, x, y, best):
                continue
            cost, station = distance(points, offsets, ends, lane, x, y, heading, weight)
            if cost < best and (anywhere or abs(value_at(points, offsets, lane, 4, station) - height) <= SAME_LEVEL):
                best, found = cost, lane
        border = GRID_CELL * min(column - j, j + 1 - column, row - i, i + 1 - row)
        if best < CELL_REACH + border - SLACK:
            return found
    for lane in range(len(boxes)):
        if _out_of_question(boxes, lane, x, y, best):
            continue
        cost, station = distance(points, offsets, ends, lane, x, y, heading, weight)
        if (cost < best or (cost == best and lane < found)) and (
            anywhere or abs(value_at(points, offsets, lane, 4, station) - height) <= SAME_LEVEL
        ):
            best, found = cost, lane
    return found
