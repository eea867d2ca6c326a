"""Jaywalking: pedestrians beside streets without a pavement cross anywhere, away from junctions and close vehicles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.sim.network.lane_lookup import project
from dorothie_gym.sim.pedestrians.footways import closest_walk
from dorothie_gym.sim.pedestrians.pacing import (
    CROSSING_RATE,
    OBSTACLE_PATIENCE,
    SAFE_DISTANCE,
    SAFE_TIME,
    WALK_AHEAD,
    walk_towards,
)
from dorothie_gym.sim.randomness import draw
from dorothie_gym.sim.state.body_records import PedestrianRecord, VehicleRecord
from dorothie_gym.sim.state.codes import Footway, Kind, Walk
from dorothie_gym.sim.traffic.parameters import ASKING, CRITICAL_GAP
from dorothie_gym.sim.traffic.vehicle_models import brake_to
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

OVER, BACK, THERE = 0, 1, 2
"""Values of `mouth` while straying: on the way over, on the way back, at a far kerb without a way."""

FAR_KERB_WAIT = 5.0
"""Time at a far kerb without a way before a pedestrian returns [s]."""

JOINED = 2.5
"""Distance to a way at the far kerb within which a pedestrian walks on there [m]."""

CORRIDOR = 2.0
"""Half the width of the way over [m]."""

COMING, BEYOND = 5.0, 0.5
"""Way of a straying pedestrian, and distance from the lane at its end, within which vehicles stop for it [m]."""

GAP = 2.0
"""Room left before a straying pedestrian [m]."""


@inlined
def steps_out(town: TownArrays, world: WorldArrays, walker: PedestrianRecord, time: float) -> bool:
    """Makes a pedestrian beside a street cross it now and then; returns whether it begins to."""
    points = town.walk_points
    far = min(points[walker.segment, 5], points[walker.segment + 1, 5])
    if draw(walker) >= CROSSING_RATE * time or far <= 0.0 or not _is_clear(world, walker):
        return False
    walker.state, walker.mouth, walker.waited, walker.far = Walk.STRAYING, OVER, 0.0, far
    walker.speed = 0.0
    return True


@compiled
def _is_clear(world: WorldArrays, walker: PedestrianRecord) -> bool:
    """Returns whether no vehicle is close."""
    for i in range(len(world.vehicles)):
        vehicle = world.vehicles[i]
        if vehicle.kind == Kind.EMPTY or abs(vehicle.height - walker.height) > LEVEL_HEIGHT:
            continue
        dx, dy = vehicle.x - walker.x, vehicle.y - walker.y
        reach = SAFE_DISTANCE + SAFE_TIME * max(vehicle.speed, 0.0)
        if dx * dx + dy * dy < reach * reach:
            return False
    return True


@compiled
def stray(town: TownArrays, world: WorldArrays, p: int, time: float) -> None:
    """Walks straight over a road, or back; back also if something does not leave the way."""
    walker, points = world.pedestrians[p], town.walk_points
    k = walker.segment
    length = points[k + 1, 2] - points[k, 2]
    along = walker.station - points[k, 2]
    cos, sin = (points[k + 1, 0] - points[k, 0]) / length, (points[k + 1, 1] - points[k, 1]) / length
    home_x, home_y = points[k, 0] + along * cos, points[k, 1] + along * sin
    cos, sin = sin, -cos  # to the left: across the road
    dx, dy = walker.x - home_x, walker.y - home_y
    gone, aside = dx * cos + dy * sin, dy * cos - dx * sin
    if walker.mouth == THERE:
        walker.speed = 0.0
        walker.waited += time
        if walker.waited > FAR_KERB_WAIT and _is_clear(world, walker):
            walker.mouth, walker.waited = BACK, 0.0
        return
    if walker.mouth == OVER and gone >= walker.far:
        _arrive(town, walker)
        return
    if walker.mouth == BACK and gone <= 0.0:
        walker.state, walker.waited, walker.speed = Walk.WALKING, 0.0, 0.0
        return
    onward = 1.0 if walker.mouth == OVER else -1.0
    ahead = gone + onward * WALK_AHEAD
    x, y = home_x + ahead * cos, home_y + ahead * sin
    if walk_towards(world, p, x, y, onward * cos, onward * sin, onward * aside, CORRIDOR, time):
        walker.waited = 0.0
        return
    walker.waited += time
    if walker.waited > OBSTACLE_PATIENCE:
        walker.mouth, walker.waited = BACK if walker.mouth == OVER else OVER, 0.0


@inlined
def _arrive(town: TownArrays, walker: PedestrianRecord) -> None:
    """Walks on at the other side of the road, or stands there for a while where there is no way."""
    found, station, segment = closest_walk(town, Footway.STREET, walker.x, walker.y, JOINED)
    walker.waited, walker.speed = 0.0, 0.0
    if found < 0:
        walker.mouth = THERE
        return
    walker.walk, walker.station, walker.segment, walker.state = found, station, segment, Walk.WALKING
    walker.direction = 1.0 if draw(walker) < 0.5 else -1.0


@compiled
def give_way_to_strayers(town: TownArrays, world: WorldArrays, i: int) -> float:
    """Returns the acceleration that stops a vehicle before straying pedestrians [m/s^2]; inf for none."""
    vehicle = world.vehicles[i]
    found = math.inf
    reach = CRITICAL_GAP * vehicle.speed + ASKING + 0.5 * vehicle.length
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.state != Walk.STRAYING or walker.crashed or abs(walker.height - vehicle.height) > LEVEL_HEIGHT:
            continue
        dx, dy = walker.x - vehicle.x, walker.y - vehicle.y
        if dx * dx + dy * dy < reach * reach and dx * vehicle.cos + dy * vehicle.sin > 0.0:
            left = _way_to(town, vehicle, walker, reach)
            if left > 0.0:
                found = min(found, brake_to(vehicle.speed, left - GAP))
    return found


@inlined
def _way_to(town: TownArrays, vehicle: VehicleRecord, walker: PedestrianRecord, reach: float) -> float:
    """Returns the way from a vehicle's front to a pedestrian in its way, or about to be [m]; inf for none."""
    begin = -vehicle.station
    for k in range(int(vehicle.planned)):
        if begin > reach:
            break
        lane = town.lanes[vehicle.plan[k]]
        station, lateral, _ = project(town, vehicle.plan[k], walker.x, walker.y)
        if 0.0 <= station <= lane.length and begin + station > 0.0:
            coming = COMING if walker.speed > 0.0 else 0.0
            _, later, _ = project(town, vehicle.plan[k], walker.x + coming * walker.cos, walker.y + coming * walker.sin)
            edge = lane.half_width + BEYOND
            if min(lateral, later) < edge and max(lateral, later) > -edge:
                return float(begin + station - 0.5 * vehicle.length)
        begin += lane.length
    return math.inf
