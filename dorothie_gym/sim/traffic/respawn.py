"""Respawning of crashed or stuck vehicles and pedestrians, out of the ego's sight."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.sim.ego.limits import EGO_STANDING
from dorothie_gym.sim.network.lane_lookup import value_near
from dorothie_gym.sim.pedestrians.walking import place_walker
from dorothie_gym.sim.pedestrians.walkway_position import place_beside
from dorothie_gym.sim.randomness import choose, draw
from dorothie_gym.sim.state.codes import NOBODY, Colour, Footway, Kind, Walk
from dorothie_gym.sim.traffic.junctions import light
from dorothie_gym.sim.traffic.parameters import (
    CAR_LENGTH,
    CLEAR_BESIDE,
    CLEAR_OF_BODIES,
    CLEAR_OF_OTHERS,
    CLEAR_OF_PEOPLE,
    GOES_HOME,
    OUT_OF_SIGHT,
    TOW_BLOCKED,
    TOW_CRASHED,
    TOW_FACING,
    TOW_STUCK,
    TRAFFIC_STANDING,
)
from dorothie_gym.sim.traffic.vehicle_models import keep_side, take
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

USUAL_LENGTH = 100.0
"""Length up to which lanes and footways are drawn in proportion to their lengths [m]."""

SHORTEST = 12.0
"""Length of the shortest lane on which vehicles appear [m]."""

RESPAWN_DRAWS = 200
"""Places drawn for a respawn; where none of them is free, a vehicle is removed, a pedestrian tries again."""

LOOK_EVERY = 6
"""Substeps between two checks whether a standing vehicle waits for its light."""

FACING_DISTANCE = 6.0
"""Distance from a vehicle's outline to the centre of the ego within which it counts as waiting before the ego [m]."""


@inlined
def tow(town: TownArrays, world: WorldArrays, dt: float, turning: bool = False) -> None:
    """Counts the time for which bodies have been crashed or stuck, and respawns those whose time limit is reached.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        dt: time that has passed [s].
        turning: whether the ego is in a U-turn; see `faces_turning_car`.
    """
    frame = world.clock[0].frame
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if vehicle.kind == Kind.CAR or vehicle.kind == Kind.CYCLIST:
            if vehicle.crashed:
                vehicle.crash_age += dt
            if vehicle.speed >= TRAFFIC_STANDING:
                vehicle.stuck = 0.0
            elif (frame + i) % LOOK_EVERY == 0 and _may_go(town, world, vehicle):
                vehicle.stuck += LOOK_EVERY * dt
            if vehicle.crash_age > TOW_CRASHED or vehicle.stuck > TOW_FACING:
                _tow_away(town, world, i, turning)
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.crashed:
            walker.crash_age += dt
        if walker.crash_age > TOW_CRASHED or (walker.staying > GOES_HOME and walker.state != Walk.EMPTY):
            _come_back(town, world, p)


@compiled
def _may_go(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord) -> bool:
    """Returns whether no light holds a vehicle up, at the line or in a queue, which may span junctions."""
    now = world.clock[0].time
    # a short one follows its connector before its front has passed the line
    if vehicle.approach >= 0 and town.lanes[vehicle.approach_lane].programme >= 0:
        return light(town, world, vehicle.approach_lane, now) == Colour.GREEN
    for k in range(int(vehicle.planned)):
        if town.lanes[vehicle.plan[k]].programme >= 0:
            return light(town, world, vehicle.plan[k], now) == Colour.GREEN
    return True


@compiled
def _tow_away(town: TownArrays, world: WorldArrays, i: int, turning: bool) -> None:
    """Respawns a vehicle if it is time for that."""
    vehicle = world.vehicles[i]
    late = vehicle.crash_age > TOW_CRASHED or vehicle.stuck > TOW_STUCK
    late = late or (vehicle.blocked and vehicle.stuck > TOW_BLOCKED)
    if late or (vehicle.stuck > TOW_FACING and faces_turning_car(world, vehicle, turning)):
        _bring_back(town, world, i)


@compiled
def faces_turning_car(world: WorldArrays, vehicle: VehicleRecord, turning: bool) -> bool:
    """Returns whether a vehicle and the ego, which stands in a U-turn, block each other.

    Args:
        world: arrays of the world; the ego is the first of its vehicles.
        vehicle: vehicle of the traffic.
        turning: whether the ego is in a U-turn.
    """
    car = world.vehicles[0]
    if not turning or car.kind != Kind.DRIVEN or car.speed >= EGO_STANDING:
        return False
    dx, dy = vehicle.x - car.x, vehicle.y - car.y
    reach = FACING_DISTANCE + vehicle.radius
    return bool(dx * dx + dy * dy < reach * reach)


@compiled
def _bring_back(town: TownArrays, world: WorldArrays, i: int) -> None:
    """Puts a vehicle on another lane where there is room for it; cyclists to the kerb of slow roads."""
    vehicle = world.vehicles[i]
    vehicle.key, vehicle.touched = new_key(world), False
    world.clock[0].towed += 1
    for _ in range(RESPAWN_DRAWS):
        number = choose(vehicle, len(town.lanes))
        lane = town.lanes[number]
        if lane.junction >= 0 or lane.length < SHORTEST or draw(vehicle) * USUAL_LENGTH > lane.length:
            continue
        if vehicle.kind == Kind.CYCLIST and not (lane.outer < 0 and lane.cycling):
            continue
        station = CAR_LENGTH + draw(vehicle) * (lane.length - 2.0 * CAR_LENGTH)
        if is_free(town, world, number, station, i, OUT_OF_SIGHT):
            put_on_lane(town, vehicle, number, station)
            return
    vehicle.kind = Kind.EMPTY


@compiled
def _come_back(town: TownArrays, world: WorldArrays, p: int) -> None:
    """Puts a pedestrian on another footway of the same kind."""
    walker = world.pedestrians[p]
    kind = Footway.STREET if town.walks[walker.walk].kind == Footway.STREET else Footway.PAVEMENT
    before, at, segment, direction = walker.walk, walker.station, walker.segment, walker.direction
    for _ in range(RESPAWN_DRAWS):
        walker.walk = choose(walker, len(town.walks))
        way = town.walks[walker.walk]
        if way.kind != kind or draw(walker) * USUAL_LENGTH > way.length:
            continue
        walker.station, walker.segment = draw(walker) * way.length, way.first
        walker.direction = 1.0 if draw(walker) < 0.5 else -1.0
        x, y, _, _ = place_beside(town, walker, walker.station, 0.0)
        if is_clear_of_people(world, x, y, p, OUT_OF_SIGHT):
            place_walker(town, walker)
            walker.key = new_key(world)
            return
    walker.walk, walker.station, walker.segment, walker.direction = before, at, segment, direction


@compiled
def new_key(world: WorldArrays) -> int:
    """Returns a key that no body of the world has ever had."""
    world.clock[0].keys += 1
    return int(world.clock[0].keys)


@compiled
def is_clear_of_car(world: WorldArrays, x: float, y: float, distance: float) -> bool:
    """Returns whether a place is at least a distance [m] from the ego; true in a world without one."""
    if len(world.vehicles) == 0:
        return True
    car = world.vehicles[0]
    if car.kind != Kind.EGO and car.kind != Kind.DRIVEN:
        return True
    dx, dy = car.x - x, car.y - y
    return bool(dx * dx + dy * dy >= distance * distance)


@compiled
def is_clear_of_people(world: WorldArrays, x: float, y: float, body: int, distance: float) -> bool:
    """Returns whether no pedestrian but one is close to a place, and the ego is at a distance [m]."""
    for p in range(len(world.pedestrians)):
        other = world.pedestrians[p]
        dx, dy = other.x - x, other.y - y
        if p != body and other.state != Walk.EMPTY and dx * dx + dy * dy < CLEAR_OF_PEOPLE * CLEAR_OF_PEOPLE:
            return False
    return is_clear_of_car(world, x, y, distance)


@compiled
def is_free(town: TownArrays, world: WorldArrays, number: int, station: float, body: int, distance: float) -> bool:
    """Returns whether there is room on a lane: no vehicle and no prop close before, behind or beside.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        number: lane.
        station: along it [m].
        body: vehicle that does not count.
        distance: to the ego [m].
    """
    lane, points = town.lanes[number], town.points
    x = value_near(points, lane, lane.first, 0, station)
    y = value_near(points, lane, lane.first, 1, station)
    heading = value_near(points, lane, lane.first, 3, station)
    cos, sin = pm.cos(heading), pm.sin(heading)
    for j in range(len(world.vehicles)):
        other = world.vehicles[j]
        if j != body and other.kind != Kind.EMPTY and _is_close(other.x - x, other.y - y, cos, sin):
            return False
    for p in range(len(world.props)):
        if world.props[p].present and _is_close(world.props[p].x - x, world.props[p].y - y, cos, sin):
            return False
    return is_clear_of_car(world, x, y, distance)


@inlined
def _is_close(dx: float, dy: float, cos: float, sin: float) -> bool:
    along, across = abs(dx * cos + dy * sin), abs(dy * cos - dx * sin)
    beside = CLEAR_BESIDE if along > CLEAR_OF_BODIES else 0.5 * CLEAR_OF_BODIES
    return along < CLEAR_OF_OTHERS and across < beside


@compiled
def put_on_lane(town: TownArrays, vehicle: VehicleRecord, number: int, station: float) -> None:
    """Places a standing vehicle at a station of a lane [m] and resets all but its random numbers."""
    lane, points = town.lanes[number], town.points
    heading = value_near(points, lane, lane.first, 3, station)
    vehicle.lane = number
    keep_side(town, vehicle, lane)
    vehicle.sin, vehicle.cos = pm.sincos(heading)
    vehicle.x = value_near(points, lane, lane.first, 0, station) - vehicle.to_right * vehicle.sin
    vehicle.y = value_near(points, lane, lane.first, 1, station) + vehicle.to_right * vehicle.cos
    vehicle.height = value_near(points, lane, lane.first, 4, station)
    vehicle.heading, vehicle.speed, vehicle.acceleration, vehicle.slip = heading, 0.0, 0.0, 0.0
    vehicle.crashed, vehicle.crash_age, vehicle.standing, vehicle.stuck = False, 0.0, 0.0, 0.0
    vehicle.approach, vehicle.approach_lane, vehicle.claim, vehicle.inside = NOBODY, NOBODY, NOBODY, NOBODY
    vehicle.stood, vehicle.blocked, vehicle.wait = False, False, 0
    vehicle.since, vehicle.asked, vehicle.seen, vehicle.rerouted = math.inf, -math.inf, -math.inf, -math.inf
    vehicle.timer = draw(vehicle)
    take(town, vehicle, number)
    vehicle.own_station, vehicle.own_lateral = vehicle.station, vehicle.lateral
