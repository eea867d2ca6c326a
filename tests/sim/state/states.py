"""Random states of vehicles, in the kernel's arrays and as stock vehicles on the same road."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from highway_env.vehicle.behavior import IDMVehicle

from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_vehicle
from dorothie_gym.sim.road import TownRoad
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.vehicle_models import take, update_lane

DT = 1.0 / 30.0


class Pose(NamedTuple):
    """State of a vehicle on a lane: station [m], angle [rad], speed and desired speed [m/s]."""

    lane: int
    station: float
    lateral: float = 0.0
    turned: float = 0.0
    speed: float = 0.0
    desired: float = 8.0
    target: int | None = None


def kernel_world(network: TownNetwork, poses: Sequence[Pose], seed: int = 0) -> tuple[TownArrays, WorldArrays]:
    """A world with vehicles in some poses."""
    town = town_arrays(network)
    world = empty_world(town, vehicles=len(poses), pedestrians=0, seed=seed)
    for pose in poses:
        number = add_vehicle(town, world, pose.lane, pose.station, desired=pose.desired)
        lane, vehicle = network.town.lanes[pose.lane], world.vehicles[number]
        vehicle.x, vehicle.y = lane.position(pose.station, pose.lateral)
        vehicle.heading = lane.heading_at(pose.station) + pose.turned
        vehicle.cos, vehicle.sin = np.cos(vehicle.heading), np.sin(vehicle.heading)
        vehicle.speed, vehicle.timer = pose.speed, 0.0
        if pose.target is not None:
            take(town, vehicle, pose.target)
        update_lane(town, vehicle)
    rebuild(town, world)
    return town, world


def stock_road(network: TownNetwork, poses: Sequence[Pose]) -> TownRoad:
    """Stock vehicles in the same poses."""
    road = TownRoad(network)
    for pose in poses:
        lane = network.town.lanes[pose.lane]
        vehicle = IDMVehicle(
            road,
            lane.position(pose.station, pose.lateral),
            heading=lane.heading_at(pose.station) + pose.turned,
            speed=pose.speed,
            target_lane_index=network.index_of(pose.lane if pose.target is None else pose.target),
            target_speed=pose.desired,
            timer=1e-3,  # no thought of changing lanes for a second, but a change may be given up
        )
        road.vehicles.append(vehicle)
    return road
