"""The path of the session's car: where the car is on it, and which lanes it is going to take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.parameters import PLANNED
from dorothie_gym.world.kernel.records import Records

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

WINDOW = 6.0
"""The car is looked for this far before and behind the place where it was [m]."""


@inlined
def point_at(world: WorldArrays, s: float) -> int:
    """Number of the point at or before a distance along the path [m]."""
    path, car = world.path, world.car[0]
    k, last = int(car.at), int(car.points) - 1
    while k < last and path[k + 1].s <= s:
        k += 1
    while k > 0 and path[k].s > s:
        k -= 1
    return k


@inlined
def heading_at(world: WorldArrays, s: float) -> float:
    """Direction of the path at a distance along it [rad]."""
    path = world.path
    k = min(point_at(world, s), int(world.car[0].points) - 2)
    t = (s - path[k].s) / (path[k + 1].s - path[k].s)
    t = min(max(t, 0.0), 1.0)
    return float(path[k].heading + t * (path[k + 1].heading - path[k].heading))


@compiled
def advance(world: WorldArrays, vehicle: Records) -> None:
    """Finds the closest place of the path around the last one: distance along it, and from it (positive right)."""
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
    take_lanes(world, vehicle)


@inlined
def take_lanes(world: WorldArrays, vehicle: Records) -> None:
    """The lanes of the path from the car's place on become the vehicle's plan."""
    car = world.car[0]
    r = 0
    while r + 1 < car.runs and car.run_first[r + 1] <= car.at:
        r += 1
    if r != car.run or vehicle.plan[0] != car.run_lane[r]:
        car.run = r
        vehicle.planned = min(int(car.runs) - r, PLANNED)
        for k in range(vehicle.planned):
            vehicle.plan[k] = car.run_lane[r + k]


@inlined
def place_on_lane(world: WorldArrays) -> float:
    """How far along its lane the car is, by the path [m]."""
    point, car = world.path[world.car[0].at], world.car[0]
    return float(point.station if point.manoeuvre else point.station + (car.s - point.s))
