"""Models of a single vehicle: planned lanes, car following (IDM), lane keeping, motion, lane changes (MOBIL).

They follow highway-env's: the Intelligent Driver Model (Treiber, Hennecke and Helbing 2000), its lateral controller and
kinematic bicycle, and MOBIL (Kesting, Treiber and Helbing 2007) without politeness.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.sim.network.ahead import HORIZON
from dorothie_gym.sim.network.lane_lookup import closest_lane, locate, project, value_near, wrap_radians
from dorothie_gym.sim.randomness import choose
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.traffic.lane_index import around
from dorothie_gym.sim.traffic.parameters import (
    ACC_MAX,
    AFTER_END,
    CAR_LENGTH,
    CHANGE_TIME,
    CLOSING,
    COMFORT,
    CYCLIST_BEFORE,
    CYCLIST_BEHIND,
    CYCLIST_FROM_EDGE,
    KP_HEADING,
    KP_LATERAL,
    LANE_CHANGE_BRAKING,
    LANE_CHANGE_DELAY,
    LANE_CHANGE_GAIN,
    LARGEST_HEADING,
    MAX_SLIP_SINE,
    MAX_SPEED,
    PLANNED,
    STANDING_GAP,
    STOP_BRAKING,
    STOPPED,
    TAU_PURSUIT,
    TIME_WANTED,
)
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.sim.state.records import VehicleRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import LaneRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays


# --- Planned lanes ----------------------------------------------------------------------------------------------------
# Route of a vehicle: its planned lanes, drawn from the vehicle's own random numbers.


@inlined
def follow_road(town: TownArrays, vehicle: VehicleRecord) -> None:
    """Moves on to the next planned lane at the end of the current one, and extends the plan."""
    while vehicle.planned > 1 and vehicle.station > town.lanes[vehicle.plan[0]].length - AFTER_END:
        for k in range(1, vehicle.planned):
            vehicle.plan[k - 1] = vehicle.plan[k]
        vehicle.planned -= 1
        keep_side(town, vehicle, town.lanes[vehicle.plan[0]])
        locate(town, vehicle)
        extend(town, vehicle)


@inlined
def keep_side(town: TownArrays, vehicle: VehicleRecord, lane: LaneRecord) -> None:
    """Sets the offset in a lane: cyclists keep to the edge at the kerb, cars to the centre."""
    if vehicle.kind == Kind.CYCLIST:
        vehicle.to_right = town.sign * max(lane.half_width - CYCLIST_FROM_EDGE, 0.0)


@inlined
def update_lane(town: TownArrays, vehicle: VehicleRecord) -> None:
    """Updates the closest lane of a vehicle, and its place on the lane that it follows."""
    lane, station, lateral, segment = closest_lane(
        town, vehicle.x, vehicle.y, vehicle.heading, vehicle.cos, vehicle.sin, vehicle.height, vehicle.lane
    )
    vehicle.lane, vehicle.own_station, vehicle.own_lateral = lane, station, lateral
    if vehicle.kind == Kind.EGO:
        vehicle.plan[0], vehicle.planned = lane, 1
        vehicle.inside = lane if town.lanes[lane].junction >= 0 else -1
    if lane == vehicle.plan[0]:
        vehicle.station, vehicle.lateral, vehicle.segment = station, lateral, segment
    else:
        locate(town, vehicle)
    if not town.flat and vehicle.kind != Kind.DRIVEN:
        vehicle.height = value_near(town.points, town.lanes[lane], segment, 4, station)


@compiled
def take(town: TownArrays, vehicle: VehicleRecord, lane: int) -> None:
    """Makes a vehicle follow a lane, and extends the plan."""
    vehicle.plan[0], vehicle.planned = lane, 1
    keep_side(town, vehicle, town.lanes[lane])
    locate(town, vehicle)
    extend(town, vehicle)


@compiled
def extend(town: TownArrays, vehicle: VehicleRecord) -> None:
    """Draws lanes until the plan reaches `HORIZON` beyond the lane that the vehicle follows."""
    ahead = 0.0
    for k in range(1, vehicle.planned):
        ahead += town.lanes[vehicle.plan[k]].length
    while ahead < HORIZON and vehicle.planned < PLANNED:
        last = town.lanes[vehicle.plan[vehicle.planned - 1]]
        if last.successors == 0:
            return
        lane = town.neighbours[last.successor]
        if last.successors > 1:
            lane = _drawn(town, vehicle, last)
        vehicle.plan[vehicle.planned] = lane
        vehicle.planned += 1
        ahead += town.lanes[lane].length


@compiled
def _drawn(town: TownArrays, vehicle: VehicleRecord, last: LaneRecord) -> int:
    """Draws one of the successors of a lane; for cyclists one on which they may ride, if there is any."""
    streets = 0
    if vehicle.kind == Kind.CYCLIST:
        for k in range(last.successor, last.successor + last.successors):
            streets += town.lanes[town.neighbours[k]].cycling
    if streets == 0:
        return int(town.neighbours[last.successor + choose(vehicle, last.successors)])
    left = choose(vehicle, streets)
    for k in range(last.successor, last.successor + last.successors):
        if town.lanes[town.neighbours[k]].cycling:
            if left == 0:
                return int(town.neighbours[k])
            left -= 1
    return int(town.neighbours[last.successor])


# --- Car following ----------------------------------------------------------------------------------------------------


@inlined
def not_zero(x: float) -> float:
    """Returns a number kept away from 0, as `highway_env.utils.not_zero` does."""
    if abs(x) > 1e-2:
        return x
    return 1e-2 if x >= 0.0 else -1e-2


@inlined
def desired_on(lane: LaneRecord, vehicle: VehicleRecord) -> float:
    """Returns the desired speed of a vehicle on a lane [m/s]."""
    return float(vehicle.desired * lane.pace) if vehicle.kind == Kind.CAR else float(vehicle.desired)


@inlined
def free_acceleration(speed: float, target: float, limit: float) -> float:
    """Returns the acceleration towards a target speed on a free road, on a lane with a speed limit [m/s^2]."""
    share = max(speed, 0.0) / abs(not_zero(min(max(target, 0.0), limit)))
    square = share * share
    return COMFORT * (1.0 - square * square)


@inlined
def following_acceleration(speed: float, other: float, gap: float, lengths: float) -> float:
    """Returns the loss of acceleration behind another vehicle [m/s^2].

    Args:
        speed: [m/s].
        other: speed of the vehicle in front along the own heading [m/s].
        gap: from centre to centre [m].
        lengths: half of both lengths together [m].
    """
    wanted = STANDING_GAP + lengths + TIME_WANTED * speed + speed * (speed - other) / CLOSING
    share = wanted / not_zero(gap)
    return COMFORT * share * share


@compiled
def wanted_gap(speed: float, other: float, lengths: float) -> float:
    """Returns the desired distance to the vehicle in front, from centre to centre [m]."""
    return STANDING_GAP + lengths + TIME_WANTED * speed + speed * (speed - other) / CLOSING


@inlined
def brake_to(speed: float, distance: float) -> float:
    """Returns the acceleration that stops at a place [m/s^2]; inf as long as it is too early to brake."""
    if distance <= 0.3:
        return -ACC_MAX if speed > 0.0 else 0.0
    needed = speed * speed / (2.0 * distance)
    if needed < 0.6 * STOP_BRAKING:
        return math.inf if speed > 2.0 else 0.5 * min(distance, 1.0)
    return -needed


# --- Lane keeping and motion ------------------------------------------------------------------------------------------

STEEP = pm.sin(LARGEST_HEADING)


@inlined
def slip_towards_lane(points: Array, lane: LaneRecord, vehicle: VehicleRecord) -> float:
    """Returns the sine of the slip angle that keeps a vehicle on the lane that it follows."""
    return slip_towards(points, lane, vehicle, vehicle.segment, vehicle.station, vehicle.lateral - vehicle.to_right)


@inlined
def slip_towards(
    points: Array, lane: LaneRecord, vehicle: VehicleRecord, segment: int, station: float, off: float
) -> float:
    """Returns the sine of the slip angle that brings a vehicle to a lane.

    Args:
        points: points of all lanes.
        lane: the lane.
        vehicle: the vehicle.
        segment: segment of the lane that is closest to it.
        station: station of the vehicle along the lane [m].
        off: how far to the right of its place across the lane it is [m].
    """
    ahead = value_near(points, lane, segment, 3, station + vehicle.speed * TAU_PURSUIT)
    speed = not_zero(vehicle.speed)
    back = -KP_LATERAL * off / speed
    if back >= STEEP:
        back = LARGEST_HEADING
    elif back <= -STEEP:
        back = -LARGEST_HEADING
    else:
        back = pm.asin(back)
    rate = KP_HEADING * wrap_radians(ahead + back - vehicle.heading)
    return float(min(max(vehicle.length / 2.0 / speed * rate, -MAX_SLIP_SINE), MAX_SLIP_SINE))


@compiled
def steering_angle(slip: float) -> float:
    """Returns the angle of the front wheel [rad] that belongs to the sine of a slip angle."""
    return pm.atan(2.0 * slip / math.sqrt(1.0 - slip * slip))


@compiled
def slip_of(steering: float) -> float:
    """Returns the sine of the slip angle that belongs to an angle of the front wheel [rad]."""
    tangent = 0.5 * pm.tan(steering)
    return tangent / math.sqrt(1.0 + tangent * tangent)


@inlined
def move(vehicle: VehicleRecord, dt: float) -> None:
    """Moves a vehicle on by `dt` [s] as highway-env's `Vehicle.step`; brakes stop it and do not reverse it."""
    speed, slip = vehicle.speed, vehicle.slip
    acceleration = vehicle.acceleration
    if vehicle.crashed:
        slip, acceleration = 0.0, -speed
    if speed > MAX_SPEED:
        acceleration = min(acceleration, MAX_SPEED - speed)
    if acceleration < 0.0:
        acceleration = max(acceleration, -speed / dt) if speed > STOPPED else -speed / dt
    if speed != 0.0:
        straight = math.sqrt(1.0 - slip * slip)
        vehicle.x += speed * (vehicle.cos * straight - vehicle.sin * slip) * dt
        vehicle.y += speed * (vehicle.sin * straight + vehicle.cos * slip) * dt
        vehicle.heading += speed * slip / (vehicle.length / 2.0) * dt
        vehicle.sin, vehicle.cos = pm.sincos(vehicle.heading)
        vehicle.odometer += abs(speed) * dt
    vehicle.speed = speed + acceleration * dt


# --- Lane changes -----------------------------------------------------------------------------------------------------

GIVING_UP = 1.0
"""Stand during a lane change after which the vehicle gives it up [s]: by then others may come."""


@inlined
def change_lanes(town: TownArrays, world: WorldArrays, i: int) -> None:
    """Considers a lane change, once in `LANE_CHANGE_DELAY`, or gives up a change that is in progress.

    A lane that ends is left as soon as there is room beside it, also from a standstill at its end.
    """
    vehicle = world.vehicles[i]
    if vehicle.lane != vehicle.plan[0]:
        lane = town.lanes[vehicle.lane]
        if lane.left == vehicle.plan[0] or lane.right == vehicle.plan[0]:
            held_up = vehicle.standing > GIVING_UP and lane.successors > 0
            if held_up or _is_taken(world, i):
                take(town, vehicle, int(vehicle.lane))
        return
    if vehicle.timer <= LANE_CHANGE_DELAY:
        return
    vehicle.timer = 0.0
    lane = town.lanes[vehicle.lane]
    left = lane.length - vehicle.station
    if lane.junction >= 0 or vehicle.claim >= 0 or vehicle.inside >= 0:
        return
    if lane.successors == 0:
        _consider(town, world, i, lane, int(town.ways[vehicle.lane].merge))
        return
    if abs(vehicle.speed) < 1.0 or left < CAR_LENGTH + CHANGE_TIME * vehicle.speed:
        return
    if vehicle.kind == Kind.CYCLIST:
        _move_over(town, world, i, lane)
        return
    _consider(town, world, i, lane, int(lane.inner))
    _consider(town, world, i, lane, int(lane.outer))


@compiled
def _consider(town: TownArrays, world: WorldArrays, i: int, lane: LaneRecord, side: int) -> None:
    if side < 0:
        return
    vehicle = world.vehicles[i]
    beside = town.lanes[side]
    if beside.successors == 0 and lane.successors > 0:
        return
    station, lateral, _ = project(town, side, vehicle.x, vehicle.y)
    if abs(lateral) > 4.0 * beside.half_width or station < 0.0 or station >= beside.length + CAR_LENGTH:
        return
    if mobil(town, world, i, side, station, lane.successors == 0):
        take(town, vehicle, side)


@compiled
def _move_over(town: TownArrays, world: WorldArrays, i: int, lane: LaneRecord) -> None:
    """Changes the lane of a cyclist towards the kerb if it may ride there and has room, and never to the middle."""
    vehicle = world.vehicles[i]
    if lane.outer < 0 or not town.lanes[lane.outer].cycling or town.lanes[lane.outer].successors == 0:
        return
    station, _, _ = project(town, lane.outer, vehicle.x, vehicle.y)
    _, ahead, _, behind = around(town, world, lane.outer, station, i)
    if ahead > CYCLIST_BEFORE and behind > CYCLIST_BEHIND:
        take(town, vehicle, int(lane.outer))


@compiled
def mobil(town: TownArrays, world: WorldArrays, i: int, side: int, station: float, must: bool) -> bool:
    """Returns whether to change to an adjacent lane: this allows acceleration, and forces no vehicle to brake hard.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        i: the vehicle.
        side: lane beside.
        station: where the vehicle is along that lane [m].
        must: whether it has to leave its lane in any case.
    """
    vehicle = world.vehicles[i]
    front, ahead, rear, behind = around(town, world, side, station, i)
    if rear >= 0 and world.nodes[rear].body < len(world.vehicles):
        follower = world.vehicles[world.nodes[rear].body]
        along = vehicle.speed * (vehicle.cos * follower.cos + vehicle.sin * follower.sin)
        behind_on = town.lanes[follower.lane]
        imposed = free_acceleration(follower.speed, desired_on(behind_on, follower), behind_on.limit)
        imposed -= following_acceleration(follower.speed, along, behind, 0.5 * (vehicle.length + follower.length))
        if imposed < -LANE_CHANGE_BRAKING:
            return False
    there = -_held_up(world, vehicle, front, ahead)
    if must:
        return there > -LANE_CHANGE_BRAKING
    front, ahead, _, _ = around(town, world, vehicle.lane, vehicle.own_station, i)
    return there + _held_up(world, vehicle, front, ahead) >= LANE_CHANGE_GAIN


@compiled
def _held_up(world: WorldArrays, vehicle: VehicleRecord, front: int, gap: float) -> float:
    """Returns the loss of acceleration by a body in front [m/s^2]."""
    if front < 0:
        return 0.0
    node = world.nodes[front]
    along = node.speed * (vehicle.cos * node.cos + vehicle.sin * node.sin)
    return following_acceleration(vehicle.speed, along, gap, 0.5 * vehicle.length + node.half_length)


@compiled
def _is_taken(world: WorldArrays, i: int) -> bool:
    """Returns whether a vehicle close in front changes into the same lane."""
    vehicle = world.vehicles[i]
    for j in range(len(world.vehicles)):
        other = world.vehicles[j]
        if j == i or other.kind == Kind.EMPTY or other.plan[0] != vehicle.plan[0] or other.lane == other.plan[0]:
            continue
        gap = other.station - vehicle.station
        along = other.speed * (vehicle.cos * other.cos + vehicle.sin * other.sin)
        if 0.0 < gap < wanted_gap(vehicle.speed, along, 0.5 * (vehicle.length + other.length)):
            return True
    return False
