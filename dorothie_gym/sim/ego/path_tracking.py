"""Place of the ego on its path, and the lanes that it is going to take (compiled)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.sim.state.records import PathPointRecord, RecordArray, VehicleRecord
from dorothie_gym.sim.traffic.parameters import PLANNED
from dorothie_gym.sim.traffic.route import locate

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

WIDEST = 2.5
"""Largest distance of the ego's corners from its path [m]: in a U-turn it is 2.4 m."""

WINDOW = 6.0
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
    first = point_at(world, car.s - WINDOW)
    end = min(point_at(world, car.s + WINDOW) + 1, last)
    best, s, offset = math.inf, car.s, 0.0
    for k in range(first, end):
        one, two = path[k], path[k + 1]
        dx, dy = two.x - one.x, two.y - one.y
        t = ((vehicle.x - one.x) * dx + (vehicle.y - one.y) * dy) / (dx * dx + dy * dy)
        # before the first and after the last point the path goes on straight
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
    where the path begins to bend its heading follows by and by, and in a long bend its front points outwards. A corner
    that is `along` before or behind the middle is off a path of curvature k by k / 2 along^2 more.

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
        path[k].left = min(max(across + more, 0.5 * width), WIDEST)
        path[k].right = min(max(across - more, 0.5 * width), WIDEST)


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
