"""Crashed vehicles, and those that give up before a prop, come back elsewhere; so do pedestrians that were touched."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.world.kernel.compiling import compiled, inlined
from dorothie_gym.world.kernel.lanes import value_near
from dorothie_gym.world.kernel.parameters import CAR_LENGTH, CLEAR_OF_OTHERS, TOW_BLOCKED, TOW_CRASHED
from dorothie_gym.world.kernel.plan import take
from dorothie_gym.world.kernel.randomness import choose, draw
from dorothie_gym.world.kernel.records import NOBODY, Kind, Records, Walk
from dorothie_gym.world.kernel.walking import place_walker

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays
    from dorothie_gym.world.kernel.world_arrays import WorldArrays

USUAL_LENGTH = 100.0
"""Lanes up to this long are drawn in proportion to their lengths [m]."""

SHORTEST = 12.0
"""Nobody appears on a shorter lane [m]."""


@inlined
def tow(town: TownArrays, world: WorldArrays, dt: float) -> None:
    """Counts for how long vehicles have been crashed, and brings back those whose time is over.

    A place is drawn once in a substep, so that it may take a few of them until a free one is found.
    """
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if vehicle.kind == Kind.EMPTY or vehicle.kind == Kind.EGO or vehicle.kind == Kind.DRIVEN:
            continue
        if vehicle.crashed:
            vehicle.crash_age += dt
        if vehicle.crash_age > TOW_CRASHED or (vehicle.blocked and vehicle.standing > TOW_BLOCKED):
            _bring_back(town, world, i)
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.crashed and walker.state != Walk.EMPTY:
            walker.walk = choose(walker, len(town.walks))
            walker.station = draw(walker) * town.walks[walker.walk].length
            walker.key = new_key(world)
            place_walker(town, walker)


@compiled
def _bring_back(town: TownArrays, world: WorldArrays, i: int) -> None:
    vehicle = world.vehicles[i]
    number = choose(vehicle, len(town.lanes))
    lane = town.lanes[number]
    if lane.junction >= 0 or lane.length < SHORTEST or draw(vehicle) * USUAL_LENGTH > lane.length:
        return
    station = CAR_LENGTH + draw(vehicle) * (lane.length - 2.0 * CAR_LENGTH)
    x = value_near(town.points, lane, lane.first, 0, station)
    y = value_near(town.points, lane, lane.first, 1, station)
    if is_free(world, x, y, i):
        put_on_lane(town, vehicle, number, station)
        vehicle.key, vehicle.touched = new_key(world), False
        world.clock[0].towed += 1


@compiled
def new_key(world: WorldArrays) -> int:
    """A key that no body of the world has had."""
    world.clock[0].keys += 1
    return int(world.clock[0].keys)


@compiled
def is_free(world: WorldArrays, x: float, y: float, body: int) -> bool:
    """Whether no vehicle but one and no prop is near a place."""
    nearest = CLEAR_OF_OTHERS * CLEAR_OF_OTHERS
    for j in range(len(world.vehicles)):
        other = world.vehicles[j]
        if j != body and other.kind != Kind.EMPTY:
            dx, dy = other.x - x, other.y - y
            if dx * dx + dy * dy < nearest:
                return False
    for p in range(len(world.props)):
        if world.props[p].present:
            dx, dy = world.props[p].x - x, world.props[p].y - y
            if dx * dx + dy * dy < nearest:
                return False
    return True


@compiled
def put_on_lane(town: TownArrays, vehicle: Records, number: int, station: float) -> None:
    """Puts a vehicle that stands at a station of a lane [m], with nothing of its past but its random numbers."""
    lane, points = town.lanes[number], town.points
    heading = value_near(points, lane, lane.first, 3, station)
    vehicle.cos, vehicle.sin = math.cos(heading), math.sin(heading)
    vehicle.x = value_near(points, lane, lane.first, 0, station) - vehicle.to_right * vehicle.sin
    vehicle.y = value_near(points, lane, lane.first, 1, station) + vehicle.to_right * vehicle.cos
    vehicle.height = value_near(points, lane, lane.first, 4, station)
    vehicle.heading, vehicle.speed, vehicle.acceleration, vehicle.slip = heading, 0.0, 0.0, 0.0
    vehicle.crashed, vehicle.crash_age, vehicle.standing = False, 0.0, 0.0
    vehicle.approach, vehicle.approach_lane, vehicle.claim, vehicle.inside = NOBODY, NOBODY, NOBODY, NOBODY
    vehicle.stood, vehicle.blocked, vehicle.wait = False, False, 0
    vehicle.since, vehicle.asked, vehicle.seen, vehicle.rerouted = math.inf, -math.inf, -math.inf, -math.inf
    vehicle.timer = draw(vehicle)
    vehicle.lane = number
    take(town, vehicle, number)
    vehicle.own_station, vehicle.own_lateral = vehicle.station, vehicle.lateral
