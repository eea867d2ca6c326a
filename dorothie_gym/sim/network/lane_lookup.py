"""Place of a body on a lane, and the closest lane (compiled), exactly as `TownNetwork.get_closest_lane_index`.

The functions give the same bits as those of `maps.model` and `GridIndex`, but consider only the few segments that a
cell lists. Where a cell has no answer (off the road), all lanes are considered.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import (
    Array,
    IntArray,
    LaneTable,
    closest_on_segment,
    distance,
    value_at,
)
from dorothie_gym.sim.state.codes import NOBODY
from dorothie_gym.sim.state.town_records import CellEntryRecord, LaneRecord
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import allocating, compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray, empty_records

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays


# --- Index over the lanes of a network --------------------------------------------------------------------------------
# An index over the lanes of a network that finds the closest one exactly.

GRID_CELL = 8.0
"""Side of a cell [m]."""
CELL_REACH = 6.0
"""A cell lists the lanes whose centre line comes this close to it [m]; for cars on a road, this list suffices."""
SAME_LEVEL = 3.0
"""Lanes within this height [m] of a body may carry it; overpasses leave more room than that."""
SLACK = 1e-6
"""Safety of the bounds against rounding [m]; a share of 1e-9 is added for places far away."""

_Arrays: TypeAlias = tuple[Array, IntArray, Array, Array, IntArray, IntArray, float, float]
"""Points, offsets, ends and boxes of a `LaneTable`; cells (rows, columns, 2), each with where its lanes begin and stop
in the entries (m,); and the corner of the first cell, x and y [m]. A named tuple takes numba twice as long to read."""


class GridIndex:
    """Lanes listed by square grid cells.

    The distance by which highway-env ranks lanes is at least the Euclidean distance to the centre line. If the best
    lane in the list of a cell is closer than the reach of the list, unlisted lanes cannot be better. Otherwise (off
    the road), all lanes are examined whose bounding boxes are closer than the best lane found so far.

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
        _list_grid_lanes(table.points, table.offsets, *self.origin, counts, nothing)
        stops = np.cumsum(counts.ravel()).reshape(counts.shape)
        starts = stops - counts
        entries = np.empty(int(stops[-1, -1]), dtype=np.int64)
        _list_grid_lanes(table.points, table.offsets, *self.origin, starts.copy(), entries)
        cells = np.ascontiguousarray(np.stack((starts, stops), axis=-1))
        self._arrays: _Arrays = (*table, cells, entries, *self.origin)

    def closest(self, x: float, y: float, heading: float | None = None, height: float | None = None) -> int:
        """Returns the row of the closest lane, the first one of equally close lanes; see `TownNetwork`."""
        weight = 1.0
        if heading is None:
            heading, weight = 0.0, 0.0
        level = math.nan if height is None else height
        row = _closest(self._arrays, x, y, heading, weight, level)
        if row < 0:  # nothing at this height in the whole town
            return self.closest(x, y, heading if weight else None)
        return int(row)


@allocating
def _list_grid_lanes(
    points: Array, offsets: IntArray, x0: float, y0: float, cursors: IntArray, entries: IntArray
) -> None:
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


# --- Cells that list the lanes near them ------------------------------------------------------------------------------

LOOKUP_CELL = 4.0
"""Side of a cell [m]: finer than the network's own grid, so that the stretches are short."""

TURNED = 1.0
"""A lane that is off a body's heading by more than this [rad] costs more than this [m] in highway-env's ranking."""


class LaneCells(NamedTuple):
    """The lists of all cells.

    Attributes:
        origin: (2,) corner of the first cell [m].
        bounds: (rows, columns, 2) int32: first entry of each cell, and the one after its last.
        entries: lanes in the lists, those of a cell in the order of the lanes' ranks.
    """

    origin: Array
    bounds: NDArray[np.int32]
    entries: RecordArray[CellEntryRecord]


def build_cells(points: Array, lanes: RecordArray[LaneRecord]) -> LaneCells:
    """Builds the lists of lanes of all cells of a town.

    Args:
        points: (p, 6) as in `polyline.LaneTable`.
        lanes: lanes of the town.
    """
    order = np.argsort(lanes["rank"], kind="stable").astype(np.int64)
    low = np.array([lanes["left_edge"].min(), lanes["low_edge"].min()]) - CELL_REACH - LOOKUP_CELL
    high = np.array([lanes["right_edge"].max(), lanes["high_edge"].max()]) + CELL_REACH + LOOKUP_CELL
    columns, rows = (int(n) for n in np.ceil((high - low) / LOOKUP_CELL))
    counts = np.zeros((rows, columns), dtype=np.int32)
    none = empty_records(CellEntryRecord, 0)
    _list_lanes(points, lanes, order, low, counts, none)
    stops = np.cumsum(counts.ravel(), dtype=np.int32).reshape(counts.shape)
    starts = stops - counts
    entries = empty_records(CellEntryRecord, int(stops[-1, -1]))
    _list_lanes(points, lanes, order, low, starts.copy(), entries)
    return LaneCells(low, np.ascontiguousarray(np.stack((starts, stops), axis=-1)), entries)


@allocating
def _list_lanes(
    points: Array,
    lanes: RecordArray[LaneRecord],
    order: NDArray[np.int64],
    origin: Array,
    cursors: NDArray[np.int32],
    entries: RecordArray[CellEntryRecord],
) -> None:
    """Counts the lanes of each cell in `cursors`; if there are `entries`, writes them where the cursors stand."""
    rows, columns = cursors.shape
    newest = np.full((rows, columns), -1, dtype=np.int32)
    for number in order:
        lane = lanes[number]
        for k in range(lane.first, lane.last):
            left, right = min(points[k, 0], points[k + 1, 0]), max(points[k, 0], points[k + 1, 0])
            low, high = min(points[k, 1], points[k + 1, 1]), max(points[k, 1], points[k + 1, 1])
            first_row = max(int((low - origin[1] - CELL_REACH) / LOOKUP_CELL) - 1, 0)
            last_row = min(int((high - origin[1] + CELL_REACH) / LOOKUP_CELL) + 1, rows - 1)
            first_column = max(int((left - origin[0] - CELL_REACH) / LOOKUP_CELL) - 1, 0)
            last_column = min(int((right - origin[0] + CELL_REACH) / LOOKUP_CELL) + 1, columns - 1)
            for row in range(first_row, last_row + 1):
                for column in range(first_column, last_column + 1):
                    if newest[row, column] == number:
                        continue
                    newest[row, column] = number
                    x, y = origin[0] + (column + 0.5) * LOOKUP_CELL, origin[1] + (row + 0.5) * LOOKUP_CELL
                    first, last = _stretch(points, lane.first, lane.last, x, y)
                    if first < 0:
                        continue
                    if len(entries) > 0:
                        _write(entries[cursors[row, column]], points, number, first, last)
                    cursors[row, column] += 1


@allocating
def _stretch(points: Array, first: int, last: int, x: float, y: float) -> tuple[int, int]:
    """Returns the first and last segment that can be closest from within a cell; -1 where the lane is far away."""
    radius = LOOKUP_CELL * math.sqrt(0.5)
    nearest = math.inf
    for k in range(first, last):
        _, gap = closest_on_segment(points, k, x, y)
        nearest = min(nearest, gap)
    nearest = math.sqrt(nearest)
    if nearest > CELL_REACH + radius + SLACK:
        return -1, -1
    # the distance changes by no more than `radius` between the centre and anywhere in the cell, for every segment
    limit = nearest + 2.0 * radius + SLACK
    low, high = last, first
    for k in range(first, last):
        _, gap = closest_on_segment(points, k, x, y)
        if gap <= limit * limit:
            low, high = min(low, k), max(high, k)
    return low, high


@allocating
def _write(entry: CellEntryRecord, points: Array, lane: int, first: int, last: int) -> None:
    low = high = points[first, 3]
    for k in range(first, last + 2):
        low, high = min(low, points[k, 3]), max(high, points[k, 3])
    middle, spread = 0.5 * (low + high), 0.5 * (high - low)
    entry.lane, entry.first, entry.last = lane, first, last
    entry.cos, entry.sin = pm.cos(middle), pm.sin(middle)
    entry.limit = pm.cos(spread + TURNED) - SLACK if spread + TURNED < math.pi else -2.0
    entry.along_low = entry.across_low = math.inf
    entry.along_high = entry.across_high = -math.inf
    for k in range(first, last + 2):
        along = points[k, 0] * entry.cos + points[k, 1] * entry.sin
        across = points[k, 1] * entry.cos - points[k, 0] * entry.sin
        entry.along_low, entry.along_high = min(entry.along_low, along), max(entry.along_high, along)
        entry.across_low, entry.across_high = min(entry.across_low, across), max(entry.across_high, across)


# --- Lookup -----------------------------------------------------------------------------------------------------------

TURN = 2.0 * math.pi


@inlined
def wrap_radians(angle: float) -> float:
    """Returns the same angle in [-pi, pi) [rad], as `highway_env.utils.wrap_to_pi` does."""
    turned = angle + math.pi
    # a remainder takes longer than all the rest, and within two turns a sum is the same to the last bit
    if turned < 0.0:
        turned = turned + TURN if turned > -TURN else turned % TURN
    elif turned >= TURN:
        turned = turned - TURN if turned < 2.0 * TURN else turned % TURN
    return turned - math.pi


@inlined
def value_near(points: Array, lane: LaneRecord, segment: int, column: int, station: float) -> float:
    """Interpolates a column of a lane's points at a station, as `polyline.value_at`, with a search from a segment."""
    k, last = segment, lane.last
    if station <= 0.0:
        return float(points[lane.first, column])
    if station >= points[last, 2]:
        return float(points[last, column])
    k = min(k, last - 1)
    while points[k + 1, 2] <= station:
        k += 1
    while points[k, 2] > station:
        k -= 1
    t = (station - points[k, 2]) / (points[k + 1, 2] - points[k, 2])
    return float(points[k, column] + t * (points[k + 1, column] - points[k, column]))


@inlined
def closest_segment(points: Array, first: int, last: int, x: float, y: float) -> tuple[int, float, float]:
    """Returns the closest segment (the first of equals), its share up to the closest place, and distance^2 [m^2]."""
    best, at, share = math.inf, first, 0.0
    ax, ay = points[first, 0], points[first, 1]
    for k in range(first, last + 1):
        bx, by = points[k + 1, 0], points[k + 1, 1]
        dx, dy = bx - ax, by - ay
        t = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
        t = min(max(t, 0.0), 1.0)
        ex, ey = x - (ax + t * dx), y - (ay + t * dy)
        gap = ex * ex + ey * ey
        if gap < best:
            best, at, share = gap, k, t
        ax, ay = bx, by
    return at, share, best


@inlined
def coordinates(
    points: Array, lane: LaneRecord, at: int, share: float, gap: float, x: float, y: float
) -> tuple[float, float]:
    """Returns station and lateral distance [m] by the closest segment, as `polyline.local_coordinates`."""
    if at == lane.first and share == 0.0:
        rx, ry = x - points[at, 0], y - points[at, 1]
        along = rx * lane.cos_first + ry * lane.sin_first
        if along < 0.0:
            return along, ry * lane.cos_first - rx * lane.sin_first
    if at == lane.last - 1 and share == 1.0:
        rx, ry = x - points[at + 1, 0], y - points[at + 1, 1]
        along = rx * lane.cos_last + ry * lane.sin_last
        if along > 0.0:
            return points[at + 1, 2] + along, ry * lane.cos_last - rx * lane.sin_last
    dx, dy = points[at + 1, 0] - points[at, 0], points[at + 1, 1] - points[at, 1]
    side = dx * (y - points[at, 1]) - dy * (x - points[at, 0])
    lateral = math.sqrt(gap)
    station = points[at, 2] + share * (points[at + 1, 2] - points[at, 2])
    return station, lateral if side >= 0.0 else -lateral


@inlined
def project(town: TownArrays, number: int, x: float, y: float) -> tuple[float, float, int]:
    """Returns station, lateral distance [m] and closest segment of a place on a lane."""
    first, last = stretch_near(town, number, x, y)
    at, share, gap = closest_segment(town.points, first, last, x, y)
    station, lateral = coordinates(town.points, town.lanes[number], at, share, gap, x, y)
    return station, lateral, at


@inlined
def locate(town: TownArrays, vehicle: VehicleRecord) -> None:
    """Finds the place of a vehicle on the lane that it follows."""
    vehicle.station, vehicle.lateral, vehicle.segment = project(town, vehicle.plan[0], vehicle.x, vehicle.y)


@inlined
def stretch_near(town: TownArrays, number: int, x: float, y: float) -> tuple[int, int]:
    """Returns the first and last segment of a lane that may be the closest one to a place."""
    first, last = town.lanes[number].first, town.lanes[number].last - 1
    if last - first > 3:
        column, row = (x - town.origin[0]) / LOOKUP_CELL, (y - town.origin[1]) / LOOKUP_CELL
        if 0.0 <= column < town.cells.shape[1] and 0.0 <= row < town.cells.shape[0]:
            i, j = int(row), int(column)
            for e in range(town.cells[i, j, 0], town.cells[i, j, 1]):
                entry = town.entries[e]
                if entry.lane == number:
                    first, last = entry.first, entry.last
                    break
    return first, last


@inlined
def cost(points: Array, lane: LaneRecord, at: int, station: float, lateral: float, heading: float) -> float:
    """Returns highway-env's distance to a lane: |lateral| + overshoot [m] + difference of heading [rad]."""
    found = abs(lateral) + max(station - points[lane.last, 2], 0.0) + max(0.0 - station, 0.0)
    return float(found + abs(wrap_radians(heading - value_near(points, lane, at, 3, station))))


@inlined
def is_level(town: TownArrays, lane: LaneRecord, at: int, station: float, height: float) -> bool:
    """Returns whether a lane is at about a height where it is closest."""
    if town.flat or math.isnan(height):
        return True
    return abs(value_near(town.points, lane, at, 4, station) - height) <= SAME_LEVEL


@inlined
def closest_lane(
    town: TownArrays, x: float, y: float, heading: float, cos: float, sin: float, height: float, previous: int
) -> tuple[int, float, float, int]:
    """Returns the closest lane of a place and heading.

    Args:
        town: arrays of the town.
        x: position [m].
        y: position [m].
        heading: [rad].
        cos: cosine of the heading.
        sin: sine of the heading.
        height: [m], NaN for any height.
        previous: lane to try first, usually the previous result; any lane is valid.

    Returns:
        The lane, and station [m], lateral distance [m] and closest segment on it.
    """
    found, best, rank = NOBODY, math.inf, 0
    station, lateral, segment = 0.0, 0.0, 0
    column, row = (x - town.origin[0]) / LOOKUP_CELL, (y - town.origin[1]) / LOOKUP_CELL
    if 0.0 <= column < town.cells.shape[1] and 0.0 <= row < town.cells.shape[0]:
        i, j = int(row), int(column)
        begin, end = town.cells[i, j, 0], town.cells[i, j, 1]
        seed = begin
        for e in range(begin, end):
            if town.entries[e].lane == previous:
                seed = e
                break
        for turn in range(begin - 1, end if end > begin else begin - 1):
            e = seed if turn < begin else turn
            if turn == seed:
                continue
            entry = town.entries[e]
            if _is_out_of_question(entry, x, y, cos, sin, best):
                continue
            at, share, gap = closest_segment(town.points, entry.first, entry.last, x, y)
            if gap > (best + SLACK) * (best + SLACK):
                continue
            lane = town.lanes[entry.lane]
            s, r = coordinates(town.points, lane, at, share, gap, x, y)
            c = cost(town.points, lane, at, s, r, heading)
            if (c < best or (c == best and lane.rank < rank)) and is_level(town, lane, at, s, height):
                found, best, rank, station, lateral, segment = entry.lane, c, lane.rank, s, r, at
        if best < CELL_REACH - SLACK:
            return found, station, lateral, segment
    return _closest_of_all(town, x, y, heading, height)


@inlined
def _is_out_of_question(entry: CellEntryRecord, x: float, y: float, cos: float, sin: float, best: float) -> bool:
    """Returns whether the heading or distance of a lane alone exceeds the deviation of the best lane."""
    if best <= TURNED and entry.cos * cos + entry.sin * sin < entry.limit:
        return True
    across = y * entry.cos - x * entry.sin
    if across < entry.across_low - best - SLACK or across > entry.across_high + best + SLACK:
        return True
    along = x * entry.cos + y * entry.sin
    return bool(along < entry.along_low - best - SLACK or along > entry.along_high + best + SLACK)


@compiled
def _closest_of_all(
    town: TownArrays, x: float, y: float, heading: float, height: float
) -> tuple[int, float, float, int]:
    """As `closest_lane`, of all lanes; at any height if no lane of the town is at this one."""
    place = _closest_at(town, x, y, heading, height)
    if place[0] == NOBODY:
        place = _closest_at(town, x, y, heading, math.nan)
    if place[0] == NOBODY:
        raise ValueError("a body is nowhere: its position or heading is not a number")
    return place


@compiled
def _closest_at(town: TownArrays, x: float, y: float, heading: float, height: float) -> tuple[int, float, float, int]:
    """As `closest_lane`, by looking at every lane whose bounding box is near enough; NOBODY if none is that high."""
    found, best, rank = NOBODY, math.inf, 0
    station, lateral, segment = 0.0, 0.0, 0
    for number in range(len(town.lanes)):
        lane = town.lanes[number]
        dx = max(lane.left_edge - x, x - lane.right_edge, 0.0)
        dy = max(lane.low_edge - y, y - lane.high_edge, 0.0)
        if math.sqrt(dx * dx + dy * dy) * (1.0 - 1e-9) - SLACK > best:
            continue
        at, share, gap = closest_segment(town.points, lane.first, lane.last - 1, x, y)
        s, r = coordinates(town.points, lane, at, share, gap, x, y)
        c = cost(town.points, lane, at, s, r, heading)
        if (c < best or (c == best and lane.rank < rank)) and is_level(town, lane, at, s, height):
            found, best, rank, station, lateral, segment = number, c, lane.rank, s, r, at
    return found, station, lateral, segment
