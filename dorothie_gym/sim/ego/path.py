"""Path of the ego: lanes joined end to end, with lane switches and U-turns cut in, and the place of the ego on it."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.copying import shared
from dorothie_gym.maps.model import Array, Lane
from dorothie_gym.sim.network.lane_lookup import wrap_radians
from dorothie_gym.sim.state.records import PathPointRecord, RecordArray, VehicleRecord
from dorothie_gym.sim.traffic.parameters import PLANNED
from dorothie_gym.sim.traffic.route import locate

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays


PATH_SPACING = 1.0
"""Distance between points of a path [m]."""

TURNING_RADIUS = 4.5
"""Radius of a U-turn [m]: a little over the 3.8 m of highway-env's bicycle at full lock (60 degrees, 5 m long)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PathPiece:
    """A stretch of path that belongs to one lane.

    Attributes:
        lane: lane that the ego counts as being on.
        points: centre line (n, 2) [m].
        heights: (n,) [m].
        stations: distance along `lane` of each point (n,) [m]; during a U-turn that of its end.
        limit: speed limit [m/s].
        manoeuvre: whether the stretch leaves the lane's centre line (lane switch or U-turn).
    """

    lane: int
    points: Array
    heights: Array
    stations: Array
    limit: float
    manoeuvre: bool = False


def follow(lane: Lane, start: float = 0.0, end: float | None = None) -> PathPiece:
    """Returns the stretch along the centre line of a lane."""
    end = lane.length if end is None else end
    count = max(2, math.ceil((end - start) / PATH_SPACING) + 1)
    s = np.linspace(start, end, count)
    return PathPiece(
        lane=lane.id, points=_sample(lane, s), heights=_heights(lane, s), stations=s, limit=lane.speed_limit
    )


def switch(source: Lane, target: Lane, start: float, distance: float) -> PathPiece:
    """Returns the stretch from one lane to the one beside it.

    The lateral shift follows 10 t^3 - 15 t^4 + 6 t^5, which has no jump in curvature at either end.

    Args:
        source: lane of the ego.
        target: lane beside it, in the same direction.
        start: distance along `source` at which it begins [m].
        distance: length of the switch along `source` [m].
    """
    t = np.linspace(0.0, 1.0, max(3, math.ceil(distance / PATH_SPACING) + 1))
    begin, _ = target.project(source.position(start))
    end, _ = target.project(source.position(start + distance))
    weight = (t * t * t * (10 - 15 * t + 6 * (t * t)))[:, None]
    stations = begin + t * (end - begin)
    points = (1 - weight) * _sample(source, start + t * distance) + weight * _sample(target, stations)
    return PathPiece(
        lane=target.id,
        points=points,
        heights=_heights(target, stations),
        stations=stations,
        limit=min(source.speed_limit, target.speed_limit),
        manoeuvre=True,
    )


def u_turn(source: Lane, target: Lane, start: float, radius: float = TURNING_RADIUS) -> PathPiece:
    """Returns the stretch from a lane to the oncoming one on its left.

    Where the lanes are closer than two radii the ego first swings out: arcs right, left by more than a half circle,
    right again, whose lateral shifts add up to the distance d of the lanes: cos(swing) = (d + 2 r) / (4 r).

    Args:
        source: lane of the ego.
        target: oncoming lane.
        start: distance along `source` at which it begins [m].
        radius: radius of all arcs [m].
    """
    origin, heading = source.position(start), source.heading_at(start)
    station, lateral = target.project(origin)
    gap = abs(lateral)
    if gap < 2 * radius:
        swing = math.acos((gap + 2 * radius) / (4 * radius))
        arcs = [(radius, swing), (-radius, math.pi + 2 * swing), (radius, swing)]
        middle = 0.0
    else:
        arcs, middle = [(-radius, math.pi / 2), (-radius, math.pi / 2)], gap - 2 * radius
    x, y, psi = float(origin[0]), float(origin[1]), heading
    points = [(x, y)]
    for k, (r, angle) in enumerate(arcs):
        if k == 1 and middle > 0:
            x, y = x + middle * math.cos(psi), y + middle * math.sin(psi)
            points.append((x, y))
        steps = max(2, math.ceil(abs(r) * angle / (PATH_SPACING / 2)))
        for _ in range(steps):
            turn = math.copysign(angle / steps, r)
            # chord of an arc of `turn` radians; positive radius turns right (headings are clockwise)
            chord = 2 * abs(r) * math.sin(abs(turn) / 2)
            x, y = x + chord * math.cos(psi + turn / 2), y + chord * math.sin(psi + turn / 2)
            psi += turn
            points.append((x, y))
    line = np.array(points)
    return PathPiece(
        lane=target.id,
        points=line,
        heights=np.full(len(line), target.height_at(station)),
        stations=np.full(len(line), station),
        limit=min(source.speed_limit, target.speed_limit),
        manoeuvre=True,
    )


@shared
class Path:
    """Pieces joined to one line that the ego follows.

    Only what every decision needs is kept for each point.

    Attributes:
        s: distance along the path of each point (n,) [m].
        points: (n, 2) [m].
        heading: at the first point [rad].
        heights: (n,) [m].
        lanes: lane of each point (n,).
        stations: distance along that lane (n,) [m].
        manoeuvre: whether each point is off the lanes' centre lines (n,).
    """

    def __init__(self, pieces: Sequence[PathPiece]) -> None:
        points = np.concatenate([piece.points for piece in pieces])
        keep = np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > 1e-3))
        piece_of = np.repeat(np.arange(len(pieces), dtype=np.int16), [len(piece.points) for piece in pieces])[keep]
        self.points = points[keep]
        self.heights = np.concatenate([piece.heights for piece in pieces])[keep]
        self.stations = np.concatenate([piece.stations for piece in pieces])[keep]
        self.lanes = np.array([piece.lane for piece in pieces])[piece_of]
        self.manoeuvre = np.array([piece.manoeuvre for piece in pieces])[piece_of]
        self._piece_of, self._limits = piece_of, np.array([piece.limit for piece in pieces])
        steps = np.diff(self.points, axis=0)
        self.s = np.concatenate(([0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))))
        self.heading = float(self.headings[0])
        self._asked, self._answer = math.nan, 0

    @property
    def limits(self) -> Array:
        """Speed limit of each point (n,) [m/s]."""
        limits: Array = self._limits[self._piece_of]
        return limits

    @property
    def headings(self) -> Array:
        """Direction at each point (n,) [rad], unwrapped."""
        headings = np.empty(len(self.s))
        find_headings(self.points, self.s, headings)
        return headings

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(self.s[-1])

    @property
    def curvatures(self) -> Array:
        """Curvature at each point (n,) [1/m], positive to the right."""
        bends = np.empty(len(self.s))
        find_bends(self.headings, self.s, bends)
        return bends

    def index_at(self, s: float) -> int:
        """Returns the number of the point at or before a distance along the path."""
        if s != self._asked:  # most calls in a row ask for the ego's place
            self._asked, self._answer = s, min(max(bisect_right(self.s, s) - 1, 0), len(self.s) - 1)
        return self._answer

    def project(self, x: float, y: float, near: float, window: float = 6.0) -> tuple[float, float]:
        """Returns the closest place of the path to a position, searched around a known place.

        Args:
            x: [m].
            y: [m].
            near: distance along the path close to the answer [m].
            window: range of the search around `near` [m].

        Returns:
            Distance along the path [m], and signed distance from it, positive right [m].
        """
        first = self.index_at(near - window)
        last = min(self.index_at(near + window) + 1, len(self.s) - 1)
        s, points = self.s[first : last + 1].tolist(), self.points[first : last + 1].tolist()
        best, answer = math.inf, (near, 0.0)
        for k in range(last - first):
            (ax, ay), (bx, by) = points[k], points[k + 1]
            dx, dy = bx - ax, by - ay
            t = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
            # before the first and after the last point the path continues straight
            if (t < 0.0 and first + k > 0) or (t > 1.0 and first + k < len(self.s) - 2):
                t = 0.0 if t < 0.0 else 1.0
            ox, oy = x - ax - t * dx, y - ay - t * dy
            distance = ox * ox + oy * oy
            if distance < best:
                best = distance
                side = 1.0 if dx * oy - dy * ox >= 0 else -1.0
                answer = (s[k] + t * (s[k + 1] - s[k]), side * math.sqrt(distance))
        return answer

    def heading_at(self, s: float) -> float:
        """Returns the direction of the path [rad]."""
        return self._interpolate(self.headings, s)

    def position_at(self, s: float) -> tuple[float, float]:
        """Returns a point of the path [m]."""
        return self._interpolate(self.points[:, 0], s), self._interpolate(self.points[:, 1], s)

    def _interpolate(self, values: Array, s: float) -> float:
        k = min(self.index_at(s), len(self.s) - 2)
        t = (s - self.s[k]) / (self.s[k + 1] - self.s[k])
        t = min(max(t, 0.0), 1.0)
        return float(values[k] + t * (values[k + 1] - values[k]))


def _sample(lane: Lane, stations: Array) -> Array:
    """Returns points on the centre line (n, 2) [m]."""
    x = np.interp(stations, lane.stations, lane.points[:, 0])
    y = np.interp(stations, lane.stations, lane.points[:, 1])
    return np.column_stack((x, y))


def _heights(lane: Lane, stations: Array) -> Array:
    return np.interp(stations, lane.stations, lane.points[:, 2])


@compiled
def find_headings(points: Array, s: Array, headings: Array) -> None:
    """Computes the direction of a path at each of its points, unwrapped [rad].

    The directions of the segments are those at their middles, between which they are interpolated; both ends
    extrapolate the curvature.

    Args:
        points: (n, 2) [m], n >= 2.
        s: distance along the path of each point (n,) [m].
        headings: (n,) the result.
    """
    last = len(s) - 1
    wrapped = unwrapped = math.atan2(points[1, 1] - points[0, 1], points[1, 0] - points[0, 0])
    middle, turns = (s[0] + s[1]) / 2, 0.0
    headings[0] = headings[1] = unwrapped
    for k in range(1, last):
        before, unwrapped_before, middle_before = wrapped, unwrapped, middle
        wrapped = math.atan2(points[k + 1, 1] - points[k, 1], points[k + 1, 0] - points[k, 0])
        turn = wrapped - before
        if abs(turn) > math.pi:
            turns += wrap_radians(turn) - turn
        unwrapped, middle = wrapped + turns, (s[k] + s[k + 1]) / 2
        bend = (unwrapped - unwrapped_before) / (middle - middle_before)
        headings[k] = bend * (s[k] - middle_before) + unwrapped_before
        if k == 1:
            headings[0] = unwrapped_before - (unwrapped - unwrapped_before) * middle_before / (middle - middle_before)
        headings[k + 1] = unwrapped + bend * (s[k + 1] - middle)


@compiled
def find_bends(headings: Array, s: Array, bends: Array) -> None:
    """Computes the curvature of a path at each of its points, positive to the right [1/m].

    These are differences of second order, at both ends of first order, as those of `np.gradient`.

    Args:
        headings: direction at each point (n,) [rad], n >= 2.
        s: distance along the path of each point (n,) [m].
        bends: (n,) the result.
    """
    last = len(s) - 1
    bends[0] = (headings[1] - headings[0]) / (s[1] - s[0])
    bends[last] = (headings[last] - headings[last - 1]) / (s[last] - s[last - 1])
    for k in range(1, last):
        before, after = s[k] - s[k - 1], s[k + 1] - s[k]
        a, c = -after / (before * (before + after)), before / (after * (before + after))
        b = (after - before) / (before * after)
        bends[k] = a * headings[k - 1] + b * headings[k] + c * headings[k + 1]


# --- Place of the ego on its path (compiled) --------------------------------------------------------------------------

WIDEST_SWEEP = 2.5
"""Largest distance of the ego's corners from its path [m]: in a U-turn it is 2.4 m."""

SEARCH_RANGE = 6.0
"""Range before and behind the last place in which the ego is searched [m]."""


@inlined
def point_at(world: WorldArrays, s: float) -> int:
    """Returns the number of the point at or before a distance along the path [m]."""
    path, car = world.path, world.car[0]
    k, last = int(car.at), int(car.points) - 1
    while k < last and path[k + 1].s <= s:
        k += 1
    while k > 0 and path[k].s > s:
        k -= 1
    return k


@inlined
def heading_at(world: WorldArrays, s: float) -> float:
    """Returns the direction of the path at a distance along it [rad]."""
    path = world.path
    k = min(point_at(world, s), int(world.car[0].points) - 2)
    t = (s - path[k].s) / (path[k + 1].s - path[k].s)
    t = min(max(t, 0.0), 1.0)
    return float(path[k].heading + t * (path[k + 1].heading - path[k].heading))


@compiled
def advance(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord) -> None:
    """Updates the ego's place on the path: distance along it, and from it (positive right)."""
    path, car = world.path, world.car[0]
    last = int(car.points) - 1
    first = point_at(world, car.s - SEARCH_RANGE)
    end = min(point_at(world, car.s + SEARCH_RANGE) + 1, last)
    best, s, offset = math.inf, car.s, 0.0
    for k in range(first, end):
        one, two = path[k], path[k + 1]
        dx, dy = two.x - one.x, two.y - one.y
        t = ((vehicle.x - one.x) * dx + (vehicle.y - one.y) * dy) / (dx * dx + dy * dy)
        # before the first and after the last point the path continues straight
        if (t < 0.0 and k > 0) or (t > 1.0 and k < last - 1):
            t = 0.0 if t < 0.0 else 1.0
        ox, oy = vehicle.x - one.x - t * dx, vehicle.y - one.y - t * dy
        gap = ox * ox + oy * oy
        if gap < best:
            best = gap
            s = one.s + t * (two.s - one.s)
            offset = math.sqrt(gap) if dx * oy - dy * ox >= 0.0 else -math.sqrt(gap)
    car.s, car.offset = s, offset
    car.at = point_at(world, s)
    take_lanes(town, world, vehicle)


@compiled
def find_sides(path: RecordArray[PathPointRecord], count: int, length: float, width: float) -> None:
    """Computes the reach of a car's corners to the left and to the right of the path of its middle.

    highway-env's bicycle moves along its heading plus a slip angle, and turns by the sine of that over half its length:
    where the path begins to bend its heading follows with a delay, and in a long bend its front points outwards.
    A corner that is `along` before or behind the middle is off a path of curvature k by k / 2 along^2 more.

    Args:
        path: points, read and written; the car enters the path along its direction.
        count: number of points.
        length: of the car [m].
        width: of the car [m].
    """
    off = 0.0  # heading of the car to the right of the path [rad]
    for k in range(count):
        bend = 0.0
        if k > 0:
            way, turn = path[k].s - path[k - 1].s, path[k].heading - path[k - 1].heading
            off -= turn
            off -= math.sin(off) * min(way / (0.5 * length), 1.0)
            bend = turn / way
        sine, cosine = abs(math.sin(off)), math.cos(off)
        across, along = 0.5 * (length * sine + width * cosine), 0.5 * (length * cosine - width * sine)
        more = 0.5 * bend * along * along
        path[k].left = min(max(across + more, 0.5 * width), WIDEST_SWEEP)
        path[k].right = min(max(across - more, 0.5 * width), WIDEST_SWEEP)


@inlined
def take_lanes(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord) -> None:
    """Makes the lanes of the path ahead the vehicle's plan, and updates its place on the first of them."""
    car = world.car[0]
    r = 0
    while r + 1 < car.runs and car.run_first[r + 1] <= car.at:
        r += 1
    if r != car.run or vehicle.plan[0] != car.run_lane[r]:
        car.run = r
        vehicle.planned = min(int(car.runs) - r, PLANNED)
        for k in range(vehicle.planned):
            vehicle.plan[k] = car.run_lane[r + k]
        locate(town, vehicle)
