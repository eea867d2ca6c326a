"""The path of the ego: a copy for observers, and the ego's place on the stretch around it (compiled)."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sim.ego.path_builder import SEARCH_RANGE
from dorothie_gym.sim.network.lane_lookup import locate
from dorothie_gym.sim.traffic.parameters import PLANNED
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.records import CoursePointRecord, SweepRecord, VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays


@shared
class Path:
    """A path of the ego as it was laid: a copy of `WorldArrays.course`; n points."""

    def __init__(self, course: NDArray[np.void]) -> None:
        self._rows = np.frombuffer(course.tobytes(), dtype=course.dtype)

    def _column(self, name: str) -> Array:
        return np.ascontiguousarray(self._rows[name])

    @cached_property
    def s(self) -> Array:
        """Distance along the path of each point (n,) [m]."""
        return self._column("s")

    @cached_property
    def points(self) -> Array:
        """Places of the points (n, 2) [m]."""
        return np.column_stack((self._rows["x"], self._rows["y"]))

    @cached_property
    def headings(self) -> Array:
        """Direction at each point (n,) [rad], unwrapped."""
        return self._column("heading")

    @cached_property
    def heading(self) -> float:
        """Direction at the first point [rad]."""
        return float(self.headings[0])

    @cached_property
    def stations(self) -> Array:
        """Distance of each point along its lane (n,) [m]."""
        return self._column("station")

    @cached_property
    def speeds(self) -> Array:
        """Speed that curves, limits and the end of the path allow at each point (n,) [m/s]."""
        return self._column("speed")

    @cached_property
    def lanes(self) -> NDArray[np.int64]:
        """Lane of each point (n,)."""
        return self._rows["lane"].astype(np.int64)

    @cached_property
    def manoeuvre(self) -> NDArray[np.bool_]:
        """Whether each point is off the lanes' centre lines (n,)."""
        return np.ascontiguousarray(self._rows["manoeuvre"])

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(self.s[-1])

    def index_at(self, s: float) -> int:
        """Returns the number of the point at or before a distance along the path."""
        return min(max(bisect_right(self.s, s) - 1, 0), len(self.s) - 1)

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


# --- Position of the ego on its path (compiled) -----------------------------------------------------------------------

WIDEST_SWEEP = 2.5
"""Largest distance of the ego's corners from its path [m]: in a U-turn it is 2.4 m."""


@inlined
def point_at(world: WorldArrays, s: float) -> int:
    """Returns the number of the point at or before a distance along the path [m]."""
    course, car = world.course, world.car[0]
    k, last = int(car.at), int(car.points) - 1
    while k < last and course[k + 1].s <= s:
        k += 1
    while k > car.first and course[k].s > s:
        k -= 1
    return k


@inlined
def heading_at(world: WorldArrays, s: float) -> float:
    """Returns the direction of the path at a distance along it [rad]."""
    course = world.course
    k = min(point_at(world, s), int(world.car[0].points) - 2)
    t = (s - course[k].s) / (course[k + 1].s - course[k].s)
    t = min(max(t, 0.0), 1.0)
    return float(course[k].heading + t * (course[k + 1].heading - course[k].heading))


@compiled
def advance(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord) -> None:
    """Updates the ego's place on the path: distance along it, and from it (positive right)."""
    course, car = world.course, world.car[0]
    begin, last = int(car.first), int(car.points) - 1
    first = point_at(world, car.s - SEARCH_RANGE)
    end = min(point_at(world, car.s + SEARCH_RANGE) + 1, last)
    best, s, offset = math.inf, car.s, 0.0
    for k in range(first, end):
        one, two = course[k], course[k + 1]
        dx, dy = two.x - one.x, two.y - one.y
        t = ((vehicle.x - one.x) * dx + (vehicle.y - one.y) * dy) / (dx * dx + dy * dy)
        # before the first and after the last point the path continues straight
        if (t < 0.0 and k > begin) or (t > 1.0 and k < last - 1):
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
def find_sweeps(
    course: RecordArray[CoursePointRecord],
    sweeps: RecordArray[SweepRecord],
    first: int,
    end: int,
    length: float,
    width: float,
) -> None:
    """Computes directions, and the reach of a car's corners to the left and to the right of the path of its centre.

    highway-env's bicycle moves along its heading plus a slip angle, and turns by the sine of that over half its length:
    where the path begins to bend its heading follows with a delay, and in a long bend its front points outwards.
    A corner that is `along` before or behind the centre is off a path of curvature k by k / 2 along^2 more.

    Args:
        course: points of the whole path.
        sweeps: sweeps of the points, written from `first`; the car enters the path there along its
            direction.
        first: first point.
        end: point after the last one.
        length: length of the car [m].
        width: width of the car [m].
    """
    off = 0.0  # heading of the car to the right of the path [rad]
    for k in range(first, end):
        bend = 0.0
        if k > first:
            way, turn = course[k].s - course[k - 1].s, course[k].heading - course[k - 1].heading
            off -= turn
            off -= pm.sin(off) * min(way / (0.5 * length), 1.0)
            bend = turn / way
        sine, cosine = abs(pm.sin(off)), pm.cos(off)
        across, along = 0.5 * (length * sine + width * cosine), 0.5 * (length * cosine - width * sine)
        more = 0.5 * bend * along * along
        sweep = sweeps[k - first]
        sweep.cos, sweep.sin = pm.cos(course[k].heading), pm.sin(course[k].heading)
        sweep.left = min(max(across + more, 0.5 * width), WIDEST_SWEEP)
        sweep.right = min(max(across - more, 0.5 * width), WIDEST_SWEEP)


@inlined
def take_lanes(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord) -> None:
    """Copies the lanes of the path ahead to the vehicle's plan, and updates its station on the first of them."""
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
