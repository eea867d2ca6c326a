"""Lane keeping and motion: highway-env's lateral controller and its bicycle, written with the sine of the slip angle.

`ControlledVehicle.steering_control` works out a slip angle, turns it into a steering angle, and `Vehicle.step` turns
that back into the slip angle. Here the way over the steering angle is left out, and with it five of eight calls of
trigonometric functions.
"""

from __future__ import annotations

import math

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.following import not_zero
from dorothie_gym.world.kernel.lanes import value_near, wrapped
from dorothie_gym.world.kernel.parameters import (
    KP_HEADING,
    KP_LATERAL,
    LARGEST_HEADING,
    MAX_SLIP,
    MAX_SPEED,
    STOPPED,
    TAU_PURSUIT,
)
from dorothie_gym.world.kernel.records import Records
from dorothie_gym.world.town.model import Array

STEEP = math.sin(LARGEST_HEADING)


@inlined
def slip_towards_lane(points: Array, lane: Records, vehicle: Records) -> float:
    """Sine of the slip angle that keeps a vehicle on the lane that it follows (where `station` and `lateral` are)."""
    return slip_towards(points, lane, vehicle, vehicle.segment, vehicle.station, vehicle.lateral - vehicle.to_right)


@inlined
def slip_towards(points: Array, lane: Records, vehicle: Records, segment: int, station: float, off: float) -> float:
    """Sine of the slip angle that brings a vehicle to a lane.

    Args:
        points: of all lanes.
        lane: the lane.
        vehicle: the vehicle.
        segment: of the lane that is closest to it.
        station: of the vehicle along the lane [m].
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
        back = math.asin(back)
    rate = KP_HEADING * wrapped(ahead + back - vehicle.heading)
    return float(min(max(vehicle.length / 2.0 / speed * rate, -MAX_SLIP), MAX_SLIP))


@compiled
def steering_angle(slip: float) -> float:
    """Angle of the front wheel [rad] that belongs to the sine of a slip angle."""
    return math.atan(2.0 * slip / math.sqrt(1.0 - slip * slip))


@compiled
def slip_of(steering: float) -> float:
    """Sine of the slip angle that belongs to an angle of the front wheel [rad]."""
    tangent = 0.5 * math.tan(steering)
    return tangent / math.sqrt(1.0 + tangent * tangent)


@inlined
def move(vehicle: Records, dt: float) -> None:
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
        vehicle.cos, vehicle.sin = math.cos(vehicle.heading), math.sin(vehicle.heading)
        vehicle.odometer += abs(speed) * dt
    vehicle.speed = speed + acceleration * dt
