"""Lane centre lines as flat arrays, with compiled functions that measure along them.

Lanes, the grid index and the neighbour search share these functions, so that their results agree to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array, Lane
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import allocating

IntArray = NDArray[np.int64]

X, Y, STATION, HEADING, HEIGHT, WIDTH = range(6)


class LaneTable(NamedTuple):
    """Centre lines of several lanes; lane i has the points `offsets[i] : offsets[i + 1]`.

    Attributes:
        points: (p, 6) x, y, station [m], heading [rad], height [m], width [m] of all points.
        offsets: (n + 1,) index of the first point of each lane, and p.
        ends: (n, 4) cosine and sine of the first heading, cosine and sine of the last.
        boxes: (n, 4) bounding boxes: smallest x, smallest y, largest x, largest y [m].
    """

    points: Array
    offsets: IntArray
    ends: Array
    boxes: Array

    @classmethod
    def of(cls, lanes: Sequence[Lane]) -> LaneTable:
        """Builds the table of the given lanes, in their order."""
        columns = [
            np.column_stack((lane.points[:, :2], lane.stations, lane.headings, lane.points[:, 2], lane.widths))
            for lane in lanes
        ]
        ends = [
            [pm.cos(first), pm.sin(first), pm.cos(last), pm.sin(last)]
            for first, last in ((float(rows[0, HEADING]), float(rows[-1, HEADING])) for rows in columns)
        ]
        boxes = [np.concatenate((rows[:, :2].min(axis=0), rows[:, :2].max(axis=0))) for rows in columns]
        return cls(
            points=np.ascontiguousarray(np.concatenate(columns), dtype=np.float64),
            offsets=np.concatenate(([0], np.cumsum([len(rows) for rows in columns]))).astype(np.int64),
            ends=np.array(ends, dtype=np.float64),
            boxes=np.array(boxes, dtype=np.float64),
        )


@allocating
def closest_on_segment(points: Array, k: int, x: float, y: float) -> tuple[float, float]:
    """Returns the closest point on segment k: its fraction of the segment, and the squared distance to it [m^2]."""
    ax, ay = points[k, 0], points[k, 1]
    dx, dy = points[k + 1, 0] - ax, points[k + 1, 1] - ay
    t = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
    t = min(max(t, 0.0), 1.0)
    ex, ey = x - (ax + t * dx), y - (ay + t * dy)
    return t, ex * ex + ey * ey


@allocating
def local_coordinates(
    points: Array, offsets: IntArray, ends: Array, row: int, x: float, y: float
) -> tuple[float, float]:
    """Returns the lane coordinates of a world position: station [m] and distance to the right [m].

    Refers to the closest point, of several to the first. Beyond both ends the lane continues straight. |lateral| plus
    overshoot is never less than the distance to the centre line, which the grid index relies on.
    """
    first, last = offsets[row], offsets[row + 1] - 1
    best, at, share = np.inf, first, 0.0
    for k in range(first, last):
        t, gap = closest_on_segment(points, k, x, y)
        if gap < best:
            best, at, share = gap, k, t
    if at == first and share == 0.0:
        rx, ry = x - points[first, 0], y - points[first, 1]
        along = rx * ends[row, 0] + ry * ends[row, 1]
        if along < 0.0:
            return along, ry * ends[row, 0] - rx * ends[row, 1]
    if at == last - 1 and share == 1.0:
        rx, ry = x - points[last, 0], y - points[last, 1]
        along = rx * ends[row, 2] + ry * ends[row, 3]
        if along > 0.0:
            return points[last, 2] + along, ry * ends[row, 2] - rx * ends[row, 3]
    dx, dy = points[at + 1, 0] - points[at, 0], points[at + 1, 1] - points[at, 1]
    side = dx * (y - points[at, 1]) - dy * (x - points[at, 0])
    lateral = math.sqrt(best)
    station = points[at, 2] + share * (points[at + 1, 2] - points[at, 2])
    return station, lateral if side >= 0.0 else -lateral


@allocating
def value_at(points: Array, offsets: IntArray, row: int, column: int, station: float) -> float:
    """Interpolates a column of the table at a station, linearly between points and constant beyond the ends."""
    low, high = offsets[row], offsets[row + 1] - 1
    if station <= 0.0:
        return float(points[low, column])
    if station >= points[high, 2]:
        return float(points[high, column])
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle, 2] <= station:
            low = middle
        else:
            high = middle
    t = (station - points[low, 2]) / (points[high, 2] - points[low, 2])
    return float(points[low, column] + t * (points[high, column] - points[low, column]))


@allocating
def position(
    points: Array, offsets: IntArray, ends: Array, row: int, station: float, lateral: float
) -> tuple[float, float]:
    """Returns the world position [m] at a station and a distance to the right, straight beyond the ends of the lane."""
    first, last = offsets[row], offsets[row + 1] - 1
    if station < 0.0:
        c, n = ends[row, 0], ends[row, 1]
        return points[first, 0] + station * c - lateral * n, points[first, 1] + station * n + lateral * c
    over = station - points[last, 2]
    if over > 0.0:
        c, n = ends[row, 2], ends[row, 3]
        return points[last, 0] + over * c - lateral * n, points[last, 1] + over * n + lateral * c
    heading = value_at(points, offsets, row, 3, station)
    x, y = value_at(points, offsets, row, 0, station), value_at(points, offsets, row, 1, station)
    return x - lateral * pm.sin(heading), y + lateral * pm.cos(heading)


@allocating
def distance(
    points: Array, offsets: IntArray, ends: Array, row: int, x: float, y: float, heading: float, weight: float
) -> tuple[float, float]:
    """Returns highway-env's distance to a lane, and the station of the closest point.

    The distance is |lateral| + overshoot [m] + `weight` x difference of heading [rad].
    """
    station, lateral = local_coordinates(points, offsets, ends, row, x, y)
    length = points[offsets[row + 1] - 1, 2]
    cost = abs(lateral) + max(station - length, 0.0) + max(0.0 - station, 0.0)
    if weight != 0.0:
        angle = heading - value_at(points, offsets, row, 3, station)
        cost += weight * abs((angle + math.pi) % (2 * math.pi) - math.pi)
    return cost, station


@allocating
def positions(points: Array, offsets: IntArray, ends: Array, row: int, stations: Array, lateral: float) -> Array:
    """Returns `position` for many stations (n,): (n, 2) [m]."""
    found = np.empty((len(stations), 2))
    for i in range(len(stations)):
        found[i, 0], found[i, 1] = position(points, offsets, ends, row, stations[i], lateral)
    return found


@allocating
def local_coordinates_many(points: Array, offsets: IntArray, ends: Array, row: int, places: Array) -> Array:
    """Returns `local_coordinates` for many world positions (n, 2): (n, 2) [m]."""
    found = np.empty((len(places), 2))
    for i in range(len(places)):
        found[i, 0], found[i, 1] = local_coordinates(points, offsets, ends, row, places[i, 0], places[i, 1])
    return found
