"""Unmodified highway-env as the reference of speed: its own road in one of our towns, and one of its environments."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.road.lane import PolyLaneFixedWidth, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle

from dorothie_gym.maps.model import Lane
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.world_arrays import WorldArrays

POINTS_APART = 2.0
"""Distance of the points of a lane that is not straight [m]."""

LARGEST_STRAIGHT_TURN = 0.02
"""A lane whose heading changes by less is taken as straight [rad]."""

INTERSECTION = "intersection-v0"
"""highway-env's environment with traffic at a junction."""

_IDLE = 1
"""Its action that changes nothing."""

_PARAMETERS = ("DISTANCE_WANTED", "COMFORT_ACC_MAX", "COMFORT_ACC_MIN")
"""Parameters of `IDMVehicle` that it changes."""


def stock_road(network: TownNetwork, world: WorldArrays) -> Road:
    """Returns highway-env's own network, lanes and IDM vehicles at the places of those of a world.

    Args:
        network: network of the town.
        world: its vehicles, cyclists too, become `IDMVehicle`s at the same places, headings and speeds.
    """
    plain = RoadNetwork()
    for index, lane in network.lanes_dict().items():
        plain.add_lane(index[0], index[1], stock_lane(lane.town_lane))
    road = Road(network=plain, np_random=np.random.default_rng(0))
    for vehicle in world.vehicles[world.vehicles["kind"] != Kind.EMPTY]:
        place = np.array([float(vehicle.x), float(vehicle.y)])
        road.vehicles.append(
            IDMVehicle(
                road,
                place,
                heading=float(vehicle.heading),
                speed=float(vehicle.speed),
                target_speed=float(vehicle.desired),
            )
        )
    return road


def stock_lane(lane: Lane) -> StraightLane | PolyLaneFixedWidth:
    """Returns a straight lane, or one through points 2 m apart."""
    if float(np.ptp(lane.headings)) < LARGEST_STRAIGHT_TURN:
        return StraightLane(lane.points[0, :2], lane.points[-1, :2], speed_limit=lane.speed_limit)
    stations = np.linspace(0.0, lane.length, max(int(lane.length / POINTS_APART) + 1, 3))
    points = [tuple(lane.position(float(station))) for station in stations]
    return PolyLaneFixedWidth(points, speed_limit=lane.speed_limit)


def run_stock(road: Road, substeps: int, dt: float) -> None:
    """Steps a road of highway-env as its environments do: all vehicles decide, then all move.

    Args:
        road: with its vehicles.
        substeps: how many.
        dt: time of each [s].
    """
    for _ in range(substeps):
        road.act()
        road.step(dt)


class StockIntersection:
    """`intersection-v0` with its own settings, whose ego keeps its speed and lane.

    Its `reset` changes parameters of the class `IDMVehicle`, for every road of the process; `close` restores them.

    Attributes:
        seconds_per_step: simulated time of a step [s].
        substeps_per_step: substeps per step of its physics.
    """

    def __init__(self, seed: int = 0) -> None:
        self._parameters = {name: getattr(IDMVehicle, name) for name in _PARAMETERS}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # that there are newer versions of it
            self._env: gymnasium.Env[object, int] = gymnasium.make(INTERSECTION, disable_env_checker=True)
        self._env.reset(seed=seed)
        config = self._inside.config
        self.seconds_per_step = 1.0 / float(config["policy_frequency"])
        self.substeps_per_step = int(config["simulation_frequency"] // config["policy_frequency"])
        self._ended = False

    @property
    def _inside(self) -> AbstractEnv:
        return self._env.unwrapped

    @property
    def vehicles(self) -> int:
        """Number of vehicles now, the ego included."""
        return len(self._inside.road.vehicles)

    def prepare(self) -> None:
        """Resets the environment where an episode has ended."""
        if self._ended:
            self._env.reset()
            self._ended = False

    def step(self) -> None:
        """Plays one step; call `prepare` before."""
        *_, terminated, truncated, _ = self._env.step(_IDLE)
        self._ended = bool(terminated or truncated)

    def close(self) -> None:
        """Closes the environment and restores the parameters of `IDMVehicle`."""
        self._env.close()
        for name, value in self._parameters.items():
            setattr(IDMVehicle, name, value)
