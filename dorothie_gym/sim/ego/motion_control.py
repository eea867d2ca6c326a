"""Motion control of the ego: throttle, brake and steering along its path.

The speed is limited by curves, speed limits, goals, sight and hazards. `guide` runs once a substep.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.sim.ego.attention import keep_noticed
from dorothie_gym.sim.ego.ego_hazards import look
from dorothie_gym.sim.ego.limits import (
    APPROACH_DISTANCE,
    APPROACH_SPEED,
    BEGUN,
    BLIND_SPEED,
    LATERAL,
    LONGITUDINAL,
    MAX_ACCELERATION,
    MAX_BRAKING,
    MAX_SLIP,
    MAX_STEERING,
    PLANNED_BRAKING,
    PROFILE_BRAKING,
    PROP_DEPTH,
    SURE_BRAKING,
)
from dorothie_gym.sim.ego.obstacles import SHORTEST_STOP, room, safe_speed
from dorothie_gym.sim.ego.path import advance, heading_at, point_at, take_lanes
from dorothie_gym.sim.ego.path_builder import height_at_point
from dorothie_gym.sim.network.lane_lookup import wrap_radians
from dorothie_gym.sim.sensing.perception import see
from dorothie_gym.sim.state.codes import STATIC, U_TURN, EventCode, Motion
from dorothie_gym.sim.state.world_arrays import log
from dorothie_gym.sim.traffic.junctions import note
from dorothie_gym.sim.traffic.vehicle_models import slip_of
from dorothie_gym.sim.weather import (
    AIR_DENSITY,
    CORNERING_STIFFNESS,
    FRONTAL_AREA,
    GALE,
    GUSTINESS,
    PERIODS,
    SIDE_FORCE,
)
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import EgoRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays


@inlined
def drift(car: EgoRecord, time: float, heading: float, speed: float) -> float:
    """Returns the angle of the ego's course to its heading in wind, positive right [rad]; see `Wind.drift`."""
    swing = 0.0
    for k in range(len(PERIODS)):
        swing += pm.sin(2.0 * math.pi * time / PERIODS[k] + car.wind_phase[k])
    wind = GALE * car.wind * max(1.0 + GUSTINESS * math.sqrt(2.0 / len(PERIODS)) * swing, 0.0)
    angle = car.wind_heading - heading
    across, along = wind * pm.sin(angle), wind * pm.cos(angle) - speed
    force = AIR_DENSITY / 2.0 * FRONTAL_AREA * SIDE_FORCE * math.sqrt(across * across + along * along) * across
    return float(force / CORNERING_STIFFNESS)


# --- Speed and steering -----------------------------------------------------------------------------------------------

HARD = 3.5
"""Deceleration for a body ahead at which a stop becomes a hazard stop [m/s^2]."""

HAZARD_SPEED = 1.0
"""Speed of ego and body below which a standstill before the body also is a hazard stop [m/s]."""

HAZARD_PAUSE = 15
"""Time without an obstruction after which a hazard stop ends [substeps]."""

LIMITING = 0.5
"""Reduction of the speed at which a body counts as an obstruction [m/s]."""

CREEPING = 0.3
"""Speed below which the distance from the path is not corrected [m/s]."""

RETURN_GAIN = 1.4
"""Factor from the output of the lateral controller to a speed towards the path."""


@compiled
def guide(town: TownArrays, world: WorldArrays, dt: float) -> None:
    """Sets acceleration and slip angle of the ego for a substep of `dt` [s]."""
    car, vehicle, clock = world.car[0], world.vehicles[0], world.clock[0]
    take_lanes(town, world, vehicle)
    note(town, vehicle, clock.time)
    seen = see(
        world.vehicles, world.pedestrians, world.props, world.seen, world.eye[0], vehicle.x, vehicle.y, clock.frame, 0
    )
    if car.attentive:
        seen = keep_noticed(world, seen)
        car.sent = max(car.sent - vehicle.speed * dt, 0.0)
    look(town, world, seen)
    advance(town, world, vehicle)
    if car.s >= car.action_end:
        car.action = 0
    free = _free_speed(world)
    target = free
    limiting = False
    if car.kind > 0:
        left = room(int(car.kind), car.gap, car.ahead_speed, bool(car.tight), bool(car.line))
        safe = safe_speed(car.ahead_speed, left, car.friction)
        target, limiting = min(free, safe), safe < free - LIMITING
    if car.held:
        slow = vehicle.speed if car.hold_speed < 0.0 else min(car.hold_speed, vehicle.speed)
        car.hold_speed = max(slow - PLANNED_BRAKING * dt, 0.0)
        target = min(target, car.hold_speed)
    else:
        car.hold_speed = -1.0
    if not car.manual:
        _control(world, target, dt)
        _brake_surely(world)
    if clock.frame < car.stopped_until:
        car.throttle, car.brake = 0.0, 1.0
    _note_hazard(world, limiting)
    _note_sweep(world)
    vehicle.height = height_at_point(town, world, int(car.at))
    acceleration = car.throttle * MAX_ACCELERATION - car.brake * MAX_BRAKING
    if acceleration < 0.0:
        acceleration = max(acceleration, -MAX_BRAKING * car.friction, -vehicle.speed / dt)
    vehicle.acceleration, vehicle.slip = acceleration, slip_of(car.steer * MAX_STEERING)
    vehicle.desired, car.before = car.cruise, vehicle.speed
    if car.wind > 0.0 and vehicle.speed > 0.0:
        aside = vehicle.speed * dt * pm.tan(drift(car, clock.time, vehicle.heading, vehicle.speed))
        vehicle.x -= aside * vehicle.sin
        vehicle.y += aside * vehicle.cos


@inlined
def _free_speed(world: WorldArrays) -> float:
    """Returns the speed that the path, the goals and the sight allow [m/s]."""
    car, vehicle = world.car[0], world.vehicles[0]
    s = car.s + 0.1
    speed = min(car.cruise, world.course[point_at(world, s)].speed)
    if car.stop_at < math.inf:  # exact near the end, where the points are too coarse
        left = car.stop_at - s
        speed = min(speed, math.sqrt(2.0 * PROFILE_BRAKING * left) if left > 0.0 else 0.0)
    if not car.attentive:  # a roadblock may come into view at any time
        left = room(STATIC, world.eye[0].sight - 0.5 * vehicle.length - PROP_DEPTH, 0.0, False, False)
        speed = min(speed, max(safe_speed(0.0, left, car.friction), BLIND_SPEED))
    for g in range(car.goals):
        left = car.goal[g] - car.s
        if left >= -1.0:
            beyond = max(left - APPROACH_DISTANCE, 0.0)
            speed = min(speed, math.sqrt(APPROACH_SPEED * APPROACH_SPEED + 2.0 * PROFILE_BRAKING * beyond))
    return float(speed)


@inlined
def _control(world: WorldArrays, target: float, dt: float) -> None:
    """Sets throttle, brake and steering that keep the ego on its path at a speed.

    Lateral: highway-env's bicycle moves along its heading plus the slip angle, and the slip angle follows the wheel at
    once. So its course can be laid along the path in every substep, also where the path's curvature jumps; a PID on the
    the distance from the path adds the angle of return. Longitudinal: a PID on speed.
    """
    car, vehicle = world.car[0], world.vehicles[0]
    back = 0.0
    if vehicle.speed > CREEPING:
        error = -car.offset
        car.lateral_sum = min(max(car.lateral_sum + error * dt, -LATERAL.integral_limit), LATERAL.integral_limit)
        slope = (error - car.lateral_last) / dt if car.lateral_last < math.inf else 0.0
        car.lateral_last = error
        back = LATERAL.proportional * error + LATERAL.integral * car.lateral_sum + LATERAL.derivative * slope
    wanted = heading_at(world, car.s + 0.5 * vehicle.speed * dt) + pm.atan2(back * RETURN_GAIN, max(vehicle.speed, 1.0))
    slip = min(max(wrap_radians(wanted - vehicle.heading), -MAX_SLIP), MAX_SLIP)
    error = target - vehicle.speed
    limit = LONGITUDINAL.integral_limit
    car.speed_sum = min(max(car.speed_sum + error * dt, -limit), limit)
    pull = LONGITUDINAL.proportional * error + LONGITUDINAL.integral * car.speed_sum
    if target <= 0.0:
        car.speed_sum = 0.0
        pull = min(pull, -1.0) if vehicle.speed > 0.0 else -MAX_BRAKING
    car.throttle = min(max(pull / MAX_ACCELERATION, 0.0), 1.0)
    car.brake = min(max(-pull / MAX_BRAKING, 0.0), 1.0)
    car.steer = min(max(pm.atan(2.0 * pm.tan(slip)) / MAX_STEERING, -1.0), 1.0)


@inlined
def _brake_surely(world: WorldArrays) -> None:
    """Applies the brake that stops the ego before a hazard or line, since the speed controller lags behind."""
    car, speed = world.car[0], world.vehicles[0].speed
    needed = 0.0
    if car.stop_at < math.inf:
        needed = speed * speed / (2.0 * max(car.stop_at - car.s, SHORTEST_STOP))
    if car.kind > 0:
        left = room(int(car.kind), car.gap, car.ahead_speed, bool(car.tight), bool(car.line))
        closing = max(speed * speed - car.ahead_speed * car.ahead_speed, 0.0)
        needed = max(needed, closing / (2.0 * max(left, SHORTEST_STOP)))
    if needed > SURE_BRAKING:
        car.throttle, car.brake = 0.0, max(car.brake, min(needed / MAX_BRAKING, 1.0))


@inlined
def _note_sweep(world: WorldArrays) -> None:
    """Records the remaining part of a U-turn, to which others yield even while the ego waits in it."""
    car = world.car[0]
    at = int(car.at)
    car.sweeping = bool(car.action == U_TURN and world.course[at].manoeuvre and car.s >= BEGUN)
    if car.sweeping:
        car.sweep_first = at
        while at + 1 < car.points and world.course[at + 1].manoeuvre:
            at += 1
        car.sweep_last = at


# --- Event log --------------------------------------------------------------------------------------------------------


@inlined
def _note_hazard(world: WorldArrays, limiting: bool) -> None:
    """Logs the start and end of a hazard stop."""
    car, speed, frame = world.car[0], world.vehicles[0].speed, world.clock[0].frame
    if car.hazard == 0:
        stands = speed < HAZARD_SPEED and car.ahead_speed < HAZARD_SPEED
        if limiting and not car.held:
            if stands or car.brake * MAX_BRAKING > HARD:
                car.hazard, car.hazard_gap, car.hazard_key = car.kind, car.gap, car.other
                car.hazard_since = car.hazard_seen = frame
                log(world, EventCode.HAZARD_STOP, int(car.kind), int(car.other), max(car.gap, 0.0))
        return
    if limiting:
        car.hazard, car.hazard_gap, car.hazard_key, car.hazard_seen = car.kind, car.gap, car.other, frame
    if frame - car.hazard_seen > HAZARD_PAUSE:
        log(world, EventCode.HAZARD_END, int(car.hazard), int(car.hazard_key), float(frame - car.hazard_since))
        car.hazard = 0


# --- State of motion --------------------------------------------------------------------------------------------------

WAITING_ROOM, WAITING_SPEED = 5.0, 0.3
"""Room ahead [m] and speed [m/s] below which the ego waits at the end of its path."""


@compiled
def motion_of(world: WorldArrays) -> int:
    """Returns the `codes.Motion` of the ego."""
    plan, car = world.plan[0], world.car[0]
    if plan.held:
        return _STOPPED
    if car.hazard > 0:
        return _HAZARD
    waits = plan.open_end and plan.length - car.s < WAITING_ROOM and world.vehicles[0].speed < WAITING_SPEED
    return _WAITING if waits else _DRIVING


_DRIVING, _STOPPED, _WAITING, _HAZARD = (int(motion) for motion in Motion)
