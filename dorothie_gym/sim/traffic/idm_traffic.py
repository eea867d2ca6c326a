"""Background traffic: acceleration and steering of a vehicle along its planned lanes (IDM, MOBIL, junction rules)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import LEVEL_HEIGHT
from dorothie_gym.sim.ego.limits import U_TURN_SAMPLES
from dorothie_gym.sim.network.ahead import HORIZON
from dorothie_gym.sim.network.lane_lookup import project
from dorothie_gym.sim.pedestrians.walking import give_way_to_strayers
from dorothie_gym.sim.state.codes import NOBODY, Kind, Wait, Walk
from dorothie_gym.sim.traffic.junctions import announce, forget, note, request
from dorothie_gym.sim.traffic.lane_index import around, next_on_lane
from dorothie_gym.sim.traffic.parameters import (
    ACC_MAX,
    ASKING,
    CRITICAL_GAP,
    CROSSING_MARGIN,
    CROSSING_SIGHT,
    CURVE_BRAKING,
    CYCLIST_ACCELERATION,
    HARDEST_BRAKING,
    LINE_GAP,
    STEP_AHEAD,
    STEP_PAST,
    STOP_BRAKING,
)
from dorothie_gym.sim.traffic.vehicle_models import (
    brake_to,
    change_lanes,
    desired_on,
    extend,
    follow_road,
    following_acceleration,
    free_acceleration,
    slip_towards_lane,
)
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import LaneRecord, PassageRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays

NO_ROOM_PATIENCE = 5.0
"""Wait for room beyond a junction after which a vehicle draws another route [s]."""

SLOWEST_BEND = 0.5
"""Minimum speed in a bend [m/s]."""

CURVES_SIGHT = 40.0
"""Distance up to which bends limit the speed [m]: braking from 14 m/s to 5 m/s takes 43 m."""

CROSSWALK_GAP = 1.0
"""Room that is left before a crosswalk [m]."""


@inlined
def drive(town: TownArrays, world: WorldArrays, i: int) -> None:
    """Sets acceleration and slip angle of a vehicle."""
    vehicle = world.vehicles[i]
    if vehicle.crashed:
        return
    follow_road(town, vehicle)
    note(town, vehicle, world.clock[0].time)
    change_lanes(town, world, i)
    most = CYCLIST_ACCELERATION if vehicle.kind == Kind.CYCLIST else ACC_MAX
    wanted = _acceleration(town, world, i)
    if world.clock[0].straying > 0:
        wanted = min(wanted, give_way_to_strayers(town, world, i))
    vehicle.acceleration = min(max(wanted, -ACC_MAX), most)
    vehicle.slip = slip_towards_lane(town.points, town.lanes[vehicle.plan[0]], vehicle)


@inlined
def _acceleration(town: TownArrays, world: WorldArrays, i: int) -> float:
    """Returns the acceleration by all that is ahead on the planned lanes [m/s^2], not limited yet."""
    vehicle = world.vehicles[i]
    target, stop = desired_on(town.lanes[vehicle.lane], vehicle), math.inf
    front, gap = NOBODY, math.inf
    begin = -vehicle.station  # of a lane, from the vehicle's centre
    junction, line = NOBODY, 0.0
    for k in range(int(vehicle.planned)):
        if begin > HORIZON or (front >= 0 and junction >= 0 and begin > CURVES_SIGHT):
            break
        lane = town.lanes[vehicle.plan[k]]
        if lane.curve_speed < target:
            reachable = lane.curve_speed * lane.curve_speed + 2.0 * CURVE_BRAKING * max(begin, 0.0)
            target = min(target, max(math.sqrt(reachable), SLOWEST_BEND))
        if front < 0:
            front, place = _first_on(town, world, i, k, lane)
            gap = begin + place
            if gap > HORIZON and k > 0:
                front = NOBODY
        if junction < 0 and lane.junction >= 0 and (k > 0 or vehicle.inside != vehicle.plan[0]):
            junction, line = k, begin - 0.5 * vehicle.length
        if lane.passages > 0:
            stop = min(stop, _give_way_to_walkers(town, world, vehicle, lane, begin))
        begin += lane.length
    found = free_acceleration(vehicle.speed, target, town.lanes[vehicle.lane].limit)
    free = found
    vehicle.blocked = False
    if front >= 0:
        found -= _held_up(world, vehicle, front, gap)
        vehicle.blocked = world.nodes[front].body >= len(world.vehicles)
    if vehicle.lane != vehicle.plan[0]:
        found = min(found, free - _held_up_beside(town, world, i))
    last = int(vehicle.plan[vehicle.planned - 1])
    if town.lanes[last].successors == 0:
        left = begin - (town.lanes[last].length - town.ways[last].end) - 0.5 * vehicle.length - LINE_GAP
        if left < vehicle.speed * vehicle.speed / (2.0 * STOP_BRAKING) + ASKING:
            stop = min(stop, brake_to(vehicle.speed, left))
    stop = min(stop, _give_way_to_turning(town, world, vehicle))
    return min(found, stop, _approach(town, world, i, junction, line, front, gap))


@compiled
def _give_way_to_turning(town: TownArrays, world: WorldArrays, vehicle: VehicleRecord) -> float:
    """Returns the acceleration that stops a vehicle before the ego's U-turn [m/s^2]; inf if the lane is clear."""
    car, other = world.car[0], world.vehicles[0]
    if not car.sweeping:
        return math.inf
    dx, dy = other.x - vehicle.x, other.y - vehicle.y
    if dx * dx + dy * dy > CROSSING_SIGHT * CROSSING_SIGHT or abs(other.height - vehicle.height) > LEVEL_HEIGHT:
        return math.inf
    gap, start = math.inf, 0.0
    beside = 0.5 * (vehicle.width + other.width) + CROSSING_MARGIN
    for k in range(min(int(vehicle.planned), 3)):
        lane = town.lanes[vehicle.plan[k]]
        for p in range(car.sweep_first, car.sweep_last + 1, U_TURN_SAMPLES):
            station, lateral, _ = project(town, vehicle.plan[k], world.course[p].x, world.course[p].y)
            if abs(lateral) < beside and 0.0 <= station <= lane.length:
                gap = min(gap, start + station - vehicle.station)
        start += lane.length
    gap -= 0.5 * (vehicle.length + other.length)
    # a vehicle that already obstructs it drives on
    return brake_to(vehicle.speed, gap) if -1.0 < gap < math.inf else math.inf


@inlined
def _held_up(world: WorldArrays, vehicle: VehicleRecord, front: int, gap: float) -> float:
    node = world.nodes[front]
    along = node.speed * (vehicle.cos * node.cos + vehicle.sin * node.sin)
    return following_acceleration(vehicle.speed, along, gap, 0.5 * vehicle.length + node.half_length)


@compiled
def _held_up_beside(town: TownArrays, world: WorldArrays, i: int) -> float:
    """Returns the loss of acceleration by the next body on the lane that a vehicle is leaving [m/s^2]."""
    vehicle = world.vehicles[i]
    lane = town.lanes[vehicle.lane]
    if lane.left != vehicle.plan[0] and lane.right != vehicle.plan[0]:
        return 0.0
    front, gap, _, _ = around(town, world, vehicle.lane, vehicle.own_station, i)
    return _held_up(world, vehicle, front, gap) if front >= 0 else 0.0


@inlined
def _first_on(town: TownArrays, world: WorldArrays, i: int, k: int, lane: LaneRecord) -> tuple[int, float]:
    """Returns node (-1 for none) and station [m] of the first body ahead on the `k`-th lane of a plan.

    A body near the start of a lane that begins at the same place also blocks it.
    """
    vehicle, nodes = world.vehicles[i], world.nodes
    own = vehicle.station if k == 0 else -math.inf
    if k == 0 and vehicle.lane == vehicle.plan[0]:
        found = next_on_lane(nodes, nodes[2 * i].next, i)
    else:
        found = next_on_lane(nodes, world.heads[vehicle.plan[k]], i)
        while found >= 0 and nodes[found].station < own:
            found = next_on_lane(nodes, nodes[found].next, i)
    place = nodes[found].station if found >= 0 else math.inf
    for s in range(lane.sibling, lane.sibling + lane.siblings):
        sibling = town.siblings[s]
        n = world.heads[sibling.lane]
        while n >= 0 and (nodes[n].body == i or nodes[n].station <= own):
            n = nodes[n].next
        if n >= 0 and nodes[n].station < min(sibling.until, place):
            found, place = n, nodes[n].station
    return found, place


@inlined
def _approach(town: TownArrays, world: WorldArrays, i: int, k: int, line: float, front: int, gap: float) -> float:
    """Returns the acceleration that stops a vehicle before a junction that it may not enter [m/s^2]; inf where it may.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        i: the vehicle.
        k: index of the lane in its plan that enters the junction, -1 for none.
        line: from its front to the start of that lane [m].
        front: node of the body in front, or -1.
        gap: to its centre [m].
    """
    vehicle = world.vehicles[i]
    stopping = vehicle.speed * vehicle.speed / (2.0 * STOP_BRAKING) + ASKING
    if k < 0 or line > max(stopping, CRITICAL_GAP * vehicle.speed):
        if vehicle.approach >= 0:
            forget(vehicle)
        return math.inf
    # the front may be past the line when the next lane begins to be followed
    before = vehicle.plan[k - 1] if k > 0 else vehicle.approach_lane
    announce(vehicle, before, vehicle.plan[k], line, world.clock[0].time)
    if line > stopping:
        return math.inf
    if front >= 0 and gap < line + 0.5 * vehicle.length and not _is_let_in(world, front):
        return math.inf  # a vehicle in front also waits, and requests admission first
    wait = request(town, world, i, k)
    if wait == Wait.NOT:
        return math.inf
    if wait == Wait.NO_ROOM and k > 0:
        _choose_another_way(town, vehicle, k, world.clock[0].time)
    return brake_to(vehicle.speed, line - LINE_GAP)


@compiled
def _choose_another_way(town: TownArrays, vehicle: VehicleRecord, k: int, now: float) -> None:
    """Draws another route beyond the first `k` planned lanes after a long wait for room beyond the junction.

    This resolves gridlocks: rings of full lanes in which every vehicle waits for the next one.
    """
    if vehicle.standing > NO_ROOM_PATIENCE and now - vehicle.rerouted > NO_ROOM_PATIENCE:
        vehicle.rerouted, vehicle.planned = now, k
        extend(town, vehicle)


@inlined
def _is_let_in(world: WorldArrays, front: int) -> bool:
    body = world.nodes[front].body
    return bool(body < len(world.vehicles) and world.vehicles[body].claim >= 0)


@compiled
def _give_way_to_walkers(
    town: TownArrays, world: WorldArrays, vehicle: VehicleRecord, lane: LaneRecord, begin: float
) -> float:
    """Returns the acceleration that stops a vehicle before crosswalks with pedestrians in its path [m/s^2]."""
    found = math.inf
    for p in range(lane.passage, lane.passage + lane.passages):
        passage = town.passages[p]
        if world.busy[passage.crossing] == 0:
            continue
        left = begin + passage.start - 0.5 * vehicle.length
        if left < 0.0 or left > CRITICAL_GAP * vehicle.speed + ASKING:
            continue
        if vehicle.speed * vehicle.speed > 2.0 * HARDEST_BRAKING * left:
            continue  # too late to stop: pedestrians step out only where this does not happen
        if _is_walked(world, passage):
            found = min(found, brake_to(vehicle.speed, left - CROSSWALK_GAP))
    return found


@compiled
def _is_walked(world: WorldArrays, passage: PassageRecord) -> bool:
    """Returns whether a pedestrian on a crosswalk is about to pass a lane, or has just passed it."""
    for p in range(len(world.pedestrians)):
        walker = world.pedestrians[p]
        if walker.state == Walk.CROSSING and walker.crossing == passage.crossing:
            left = (passage.across - walker.station) * walker.direction
            if -STEP_PAST < left < STEP_AHEAD:
                return True
    return False
