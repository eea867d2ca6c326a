"""The ego of highway-env's meta actions: `MDPVehicle` and `ControlledVehicle`, driving a vehicle of the kind `EGO`.

In every substep it follows its target lane, draws the next one at random where the lane ends, and holds its target
speed. Its numbers are those of stock to rounding; where stock draws from the road's generator it draws its own.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import NDArray

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.lanes import project, value_near
from dorothie_gym.world.kernel.motion import slip_towards, steering_angle
from dorothie_gym.world.kernel.parameters import AFTER_END, CAR_LENGTH, MAX_SPEED
from dorothie_gym.world.kernel.randomness import choose
from dorothie_gym.world.kernel.records import Records
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.town.model import Array

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays

KP_SPEED = float(ControlledVehicle.KP_A)
"""Gain from the error of speed to the acceleration [1/s]."""

MIN_SPEED = float(Vehicle.MIN_SPEED)
"""[m/s]."""

REACHABLE = 2.0
"""A lane whose middle is farther to the side than this many of its widths is not changed to."""

NOTHING, LEFT, IDLE, RIGHT, FASTER, SLOWER = range(-1, 5)
"""Meta actions, as `DiscreteMetaAction.ACTIONS_ALL` numbers them, and none at all."""

HELM = np.dtype(
    [
        ("target_speed", "f8"),  # [m/s]
        ("acceleration", "f8"), ("steering", "f8"),  # what it does [m/s^2], [rad]
        ("lowest", "f8"), ("highest", "f8"),  # speeds beyond which it no longer accelerates [m/s]
        ("lane", "i4"),  # target lane
    ],
    align=True,
)  # fmt: skip
"""What the ego has in mind."""


def lanes_beside(network: TownNetwork) -> NDArray[np.int32]:
    """(lanes, 2) the lanes left and right of each one in highway-env's graph; itself at the edge of the road."""
    beside = np.empty((len(network.town.lanes), 2), dtype=np.int32)
    for start, end, place in network.lanes_dict():
        edge = network.graph[start][end]
        for side, number in enumerate((max(place - 1, 0), min(place + 1, len(edge) - 1))):
            beside[network.lane_id((start, end, place)), side] = network.lane_id((start, end, number))
    return beside


@compiled
def take_helm(vehicle: Records, helm: Records, speeds: Array) -> None:
    """Begins to drive: on the closest lane, at the possible speed that is closest to the present one."""
    helm.lane = vehicle.lane
    helm.acceleration, helm.steering = 0.0, 0.0
    helm.lowest, helm.highest = MIN_SPEED, MAX_SPEED
    if len(speeds):
        helm.target_speed = speeds[speed_index(speeds, vehicle.speed)]


@compiled
def speed_index(speeds: Array, speed: float) -> int:
    """Which of some evenly spaced speeds is closest to one: `MDPVehicle.speed_to_index`."""
    last = len(speeds) - 1
    share = (speed - speeds[0]) / (speeds[last] - speeds[0])
    return int(min(max(round(share * last), 0), last))


@compiled
def decide(
    town: TownArrays, beside: NDArray[np.int32], vehicle: Records, helm: Records, speeds: Array, action: int
) -> None:
    """Takes a meta action: `MDPVehicle.act` with one.

    Args:
        town: arrays of the town.
        beside: see `lanes_beside`.
        vehicle: the ego.
        helm: what it has in mind.
        speeds: that it may hold, evenly spaced [m/s].
        action: what it is to do.
    """
    if action == FASTER or action == SLOWER:
        index = speed_index(speeds, vehicle.speed) + (1 if action == FASTER else -1)
        helm.target_speed = speeds[min(max(index, 0), len(speeds) - 1)]
    _follow_road(town, vehicle, helm)
    if action == LEFT or action == RIGHT:
        lane = beside[helm.lane, 0 if action == LEFT else 1]
        if is_reachable(town, lane, vehicle):
            helm.lane = lane


@compiled
def is_reachable(town: TownArrays, lane: int, vehicle: Records) -> bool:
    """Whether a vehicle may change to a lane: `AbstractLane.is_reachable_from`."""
    station, lateral, segment = project(town, lane, vehicle.x, vehicle.y)
    if not 0.0 <= station < town.lanes[lane].length + CAR_LENGTH:
        return False
    return bool(abs(lateral) <= REACHABLE * value_near(town.points, town.lanes[lane], segment, 5, station))


@inlined
def control(town: TownArrays, vehicle: Records, helm: Records) -> None:
    """Steers towards the target lane and accelerates to the target speed: `MDPVehicle.act` without an action."""
    station, lateral, segment = _follow_road(town, vehicle, helm)
    slip = slip_towards(town.points, town.lanes[helm.lane], vehicle, segment, station, lateral)
    helm.steering = steering_angle(slip)
    helm.acceleration = KP_SPEED * (helm.target_speed - vehicle.speed)


@inlined
def move(vehicle: Records, helm: Records, pose: Array, dt: float) -> None:
    """Writes where it is after a time [s], as `Vehicle.step`: x, y, heading and speed (4,)."""
    speed, heading = vehicle.speed, vehicle.heading
    if vehicle.crashed:
        helm.acceleration, helm.steering = -speed, 0.0
    if speed > helm.highest:
        helm.acceleration = min(helm.acceleration, helm.highest - speed)
    elif speed < helm.lowest:
        helm.acceleration = max(helm.acceleration, helm.lowest - speed)
    slip = math.atan(0.5 * math.tan(helm.steering))
    pose[0] = vehicle.x + speed * math.cos(heading + slip) * dt
    pose[1] = vehicle.y + speed * math.sin(heading + slip) * dt
    pose[2] = heading + speed * math.sin(slip) / (CAR_LENGTH / 2.0) * dt
    pose[3] = speed + helm.acceleration * dt


@compiled
def _follow_road(town: TownArrays, vehicle: Records, helm: Records) -> tuple[float, float, int]:
    """Goes on to a next lane at the end of the target lane; returns the place on the target lane, as `project`."""
    station, lateral, segment = project(town, helm.lane, vehicle.x, vehicle.y)
    lane = town.lanes[helm.lane]
    if station <= lane.length - AFTER_END or lane.successors == 0:
        return station, lateral, segment
    way = choose(vehicle, lane.successors) if lane.successors > 1 else 0
    helm.lane = town.neighbours[lane.successor + way]
    return project(town, helm.lane, vehicle.x, vehicle.y)


@compiled
def speed_along(town: TownArrays, vehicle: Records) -> float:
    """Speed along the closest lane [m/s], 0 off the road (`RoadObject.on_road`)."""
    lane, station = town.lanes[vehicle.lane], vehicle.own_station
    if not -CAR_LENGTH <= station < lane.length + CAR_LENGTH:
        return 0.0
    if abs(vehicle.own_lateral) > 0.5 * value_near(town.points, lane, lane.first, 5, station):
        return 0.0
    return float(vehicle.speed * math.cos(value_near(town.points, lane, lane.first, 3, station) - vehicle.heading))
