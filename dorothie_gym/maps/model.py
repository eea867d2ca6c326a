"""Elements of a town: lanes, their links and centre lines, junctions, streets, sites, signals, crosswalks, sidewalks.

Frame: metres, x east, y south, z up; headings in radians, clockwise seen from above (an increase turns right).
Angles of actions are in degrees, positive LEFT: an action angle is minus the change of heading.
"""

from __future__ import annotations

import enum
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.link_types import LANE_CHANGES as LANE_CHANGES
from dorothie_gym.maps.link_types import LinkType as LinkType
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import allocating
from dorothie_gym.support.copying import shared

Array: TypeAlias = NDArray[np.float64]

NO_JUNCTION = -1
"""Junction id of a lane outside junctions."""

NO_STREET = -1
"""Street index of a lane or sidewalk without a street."""

STRAIGHT_RATIO = 3.0
"""A segment this many times longer than its neighbour is a straight beside a curve."""

LEVEL_HEIGHT = 2.5
"""Difference in height at which lanes and bodies are on different levels and do not meet [m]; bridges leave more."""


NARROW = 2.3
"""Width below which a lane that tapers away is too narrow for a car, which is 2 m wide [m]; nine tenths of the greatest
width of a lane that is narrow everywhere."""


@shared
@dataclass(frozen=True, kw_only=True, eq=False)
class Lane:
    """Driving lane, given by its centre line in driving direction.

    Attributes:
        id: index of the lane in `Town.lanes`.
        road_id: OpenDRIVE road id; in YAML towns a section of street between two junctions, or a connector.
        lane_id: OpenDRIVE lane number; its sign distinguishes the two directions of a road.
        junction_id: id of the junction that the lane crosses as a connector, or -1.
        points: centre line (n, 3) [m], n >= 2, successive points differ in x or y.
        widths: width at each point (n,) [m].
        speed_limit: [m/s].
        street: index in `Town.streets`, or -1.
    """

    id: int
    road_id: int
    lane_id: int
    junction_id: int = NO_JUNCTION
    points: Array
    widths: Array
    speed_limit: float
    street: int = NO_STREET

    @cached_property
    def stations(self) -> Array:
        """Distance of each point from the start of the lane, measured in the plane (n,) [m]."""
        steps = pn.hypot(*np.diff(self.points[:, :2], axis=0).T)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @cached_property
    def headings(self) -> Array:
        """Direction of the centre line at each point (n,) [rad], unwrapped.

        Inner points take the length-weighted mean of their two segments, which is exact on an arc. Beside a much longer
        segment they take the direction of that segment, which is a straight (`STRAIGHT_RATIO`). Both ends extrapolate
        the curvature.
        """
        steps = np.diff(self.points[:, :2], axis=0)
        segment = np.unwrap(pn.arctan2(steps[:, 1], steps[:, 0]))  # (n-1,)
        if len(segment) == 1:
            return np.repeat(segment, 2)
        length = np.diff(self.stations)
        before, after = length[:-1], length[1:]
        inner = (segment[:-1] * after + segment[1:] * before) / (before + after)
        inner = np.where(before > STRAIGHT_RATIO * after, segment[:-1], inner)
        inner = np.where(after > STRAIGHT_RATIO * before, segment[1:], inner)
        first = segment[0] if length[0] > STRAIGHT_RATIO * length[1] else 2 * segment[0] - inner[0]
        last = segment[-1] if length[-1] > STRAIGHT_RATIO * length[-2] else 2 * segment[-1] - inner[-1]
        return np.concatenate(([first], inner, [last]))

    @cached_property
    def length(self) -> float:
        """Length of the centre line in the plane [m]."""
        return float(self.stations[-1])

    @cached_property
    def wide_until(self) -> float:
        """Station from which on a lane that tapers away is too narrow for a car [m]; else the length of the lane."""
        least = min(NARROW, 0.9 * float(self.widths.max()))
        last = int(np.flatnonzero(self.widths >= least)[-1])
        if last == len(self.widths) - 1:
            return self.length
        station, width = self.stations[last : last + 2], self.widths[last : last + 2]
        return float(station[0] + (width[0] - least) / (width[0] - width[1]) * (station[1] - station[0]))

    @property
    def in_junction(self) -> bool:
        """Whether the lane is a connector through a junction."""
        return self.junction_id != NO_JUNCTION

    def position(self, longitudinal: float, lateral: float = 0.0) -> Array:
        """Returns a world position (2,) [m] in lane coordinates.

        Args:
            longitudinal: distance along the lane [m]; beyond both ends the lane continues straight.
            lateral: distance to the RIGHT of the centre line [m].
        """
        s = float(np.clip(longitudinal, 0.0, self.length))
        x = np.interp(s, self.stations, self.points[:, 0])
        y = np.interp(s, self.stations, self.points[:, 1])
        heading = self.heading_at(s)
        c, n = pn.cos(heading), pn.sin(heading)
        over = longitudinal - s
        return np.array([x + over * c - lateral * n, y + over * n + lateral * c])

    def heading_at(self, longitudinal: float) -> float:
        """Returns the direction of the lane at a distance [m] along it, unwrapped [rad]."""
        return float(np.interp(longitudinal, self.stations, self.headings))

    def height_at(self, longitudinal: float) -> float:
        """Returns the height of the lane at a distance [m] along it [m]."""
        return float(np.interp(longitudinal, self.stations, self.points[:, 2]))

    def width_at(self, longitudinal: float) -> float:
        """Returns the width of the lane at a distance [m] along it [m]."""
        return float(np.interp(longitudinal, self.stations, self.widths))

    def project(self, position: Array) -> tuple[float, float]:
        """Projects a world position (2,) [m] onto the centre line.

        Returns:
            The distance along the lane, from 0 to `length` [m], and the distance from the centre line, positive
            right [m].
        """
        a, b = self.points[:-1, :2], self.points[1:, :2]
        d = b - a
        t = np.clip(np.einsum("ij,ij->i", position[:2] - a, d) / np.einsum("ij,ij->i", d, d), 0.0, 1.0)
        offset = position[:2] - (a + t[:, None] * d)
        k = int(np.argmin(np.einsum("ij,ij->i", offset, offset)))
        side = d[k, 0] * offset[k, 1] - d[k, 1] * offset[k, 0]
        distance = float(pn.hypot(*offset[k]))
        s = self.stations[k] + t[k] * (self.stations[k + 1] - self.stations[k])
        return float(s), distance if side >= 0 else -distance


@shared
@dataclass(frozen=True)
class LaneLink:
    """Link from lane `source` to lane `target`. The type of a turn is that of the link into its connector."""

    source: int
    target: int
    type: LinkType


@shared
@dataclass(frozen=True, kw_only=True)
class Exit:
    """Exit from the end of a lane, across a junction if there is one.

    Attributes:
        connector: lane that is entered first: a connector of a junction, or the next lane of the road.
        lane: lane beyond the junction.
        type: turn type.
        angle: change of direction to the exit in whole degrees, at least -180 and below 180, positive left. All exits
            of a lane have different angles: equal ones are moved apart by one degree, from the kerb on.
        junction_id: id of the junction that is crossed, or -1.
    """

    connector: int
    lane: int
    type: LinkType
    angle: int
    junction_id: int


@shared
@dataclass(frozen=True, kw_only=True)
class Junction:
    """Junction of roads.

    Attributes:
        id: number of the junction in its map, unique in the town; plans (`PlanUpdate`) refer to it.
        position: centre (x, y) [m].
        connectors: ids of the lanes that cross it.
    """

    id: int
    position: tuple[float, float]
    connectors: tuple[int, ...]


@shared
@dataclass(frozen=True, kw_only=True)
class Street:
    """Named street: lanes that continue straight across junctions. `name` is the name in the map."""

    id: int
    name: str
    lanes: tuple[int, ...]

    @staticmethod
    def placeholder(number: int) -> str:
        """Returns the name of a street that the map does not name."""
        return f"Street {number}"

    @property
    def is_inferred(self) -> bool:
        """Whether the map does not name the street."""
        return re.fullmatch(r"Street \d+", self.name) is not None


@shared
@dataclass(frozen=True, kw_only=True)
class Site:
    """Place beside a lane where a landmark may stand.

    Attributes:
        id: index in `Town.sites`.
        lane: id of the lane that it is reached from.
        station: distance of its waypoint along that lane, where a car stops for it [m].
        position: position of the landmark (x, y) [m].
        waypoint: closest point on the lane (x, y) [m].
        street: index of its street.
    """

    id: int
    lane: int
    station: float
    position: tuple[float, float]
    waypoint: tuple[float, float]
    street: int


class SignalKind(enum.StrEnum):
    """Kind of a traffic light or sign."""

    TRAFFIC_LIGHT = "traffic_light"
    STOP = "stop"
    YIELD = "yield"
    SPEED = "speed"
    OTHER = "other"


@shared
@dataclass(frozen=True, kw_only=True)
class Signal:
    """Traffic light or sign.

    Attributes:
        id: unique number of the signal.
        kind: kind of the signal.
        position: (x, y, z) [m].
        heading: direction that its front faces [rad].
        lanes: ids of the lanes at whose end it applies.
        value: value on a sign, such as a speed limit [m/s], or None.
    """

    id: int
    kind: SignalKind
    position: tuple[float, float, float]
    heading: float
    lanes: tuple[int, ...] = ()
    value: float | None = None


@shared
@dataclass(frozen=True, kw_only=True, eq=False)
class Crosswalk:
    """Marked pedestrian crossing, given by its outline (n, 2) [m]."""

    id: int
    outline: Array


@shared
@dataclass(frozen=True, kw_only=True, eq=False)
class Sidewalk:
    """Pavement beside a street.

    Attributes:
        id: index in `Town.sidewalks`.
        points: centre line (n, 3) [m].
        width: [m].
        street: index of its street, or -1.
    """

    id: int
    points: Array
    width: float
    street: int = NO_STREET


# --- Centre lines as flat arrays (compiled) ---------------------------------------------------------------------------
# Lane centre lines as flat arrays, with compiled functions that measure along them.
#
# Lanes, the grid index and the neighbour search share these functions, so that their results agree to the last bit.

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

    Refers to the closest point, the first of equals. Beyond both ends the lane continues straight. The sum of |lateral|
    and overshoot is never less than the distance to the centre line, which the grid index relies on.
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
