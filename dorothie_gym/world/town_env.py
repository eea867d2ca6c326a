"""`Town-v0`: a plain highway-env environment in a town, without roles, talk or tasks."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.envs.common.graphics import EnvViewer
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.objects import Landmark
from numpy.typing import NDArray

from dorothie_gym.world.compiled_road import CompiledRoad
from dorothie_gym.world.kernel import empty_world, town_arrays
from dorothie_gym.world.network.network import FARTHEST, TownNetwork
from dorothie_gym.world.observing import parts_of, quicken
from dorothie_gym.world.places import free_places
from dorothie_gym.world.surroundings import SEEDS, populate_around
from dorothie_gym.world.town import load_town
from dorothie_gym.world.town.model import Array


class TownEnv(AbstractEnv):
    """Drives through a town among other vehicles.

    ## Description
    highway-env's own environment on a town's road network: its observation and action types, its viewer, and its
    vehicle under the agent's control. Routes are drawn by chance at junctions. Traffic, cyclists among it, and
    pedestrians live as in `DuoWizardEnv`: with lights, signs, priorities and crosswalks, in compiled loops
    (`world.kernel`); `env.unwrapped.road.vehicles` and `.objects` show them as highway-env's objects.

    ## Observation Space
    As `config["observation"]` says (highway-env's `Kinematics` by default), with finite bounds. All types work but
    `ExitObservation`, which is written for one road of highway-env's. `KinematicsGoal` is given a place in the town as
    its goal, and `AttributesObservation` may read `ego`.

    ## Action Space
    As `config["action"]` says (highway-env's `DiscreteMetaAction` by default); any type.

    ## Rewards
    Progress on the road: speed along the lane as a share of `config["reward_speed"]`, in [0, 1], and 0 off the road,
    plus `config["collision_reward"]` for a crash. The terms are in `info["rewards"]`.

    ## Episode End
    Terminates when the vehicle crashes, be it into a vehicle, a pedestrian or a prop; truncates after
    `config["duration"]` seconds.

    ## Arguments
    `config`: highway-env's settings, and
    - `town`: name of a town, or path of an `.xodr` or `.yaml` file;
    - `vehicles`: how many others, as many as fit, nobody within 25 m of the start;
    - `pedestrians`: how many people on the pavements; none in a town without them. By default there are none:
      highway-env's `Kinematics` cannot tell them from vehicles, and those who pass by would fill its rows;
    - `duration` [s], `reward_speed` [m/s], `collision_reward`: see above.

    ## Version History
    - v0: first version.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"], "render_fps": 2}

    # set by highway-env's methods, which carry no types
    observation_type: Any
    observation_space: Any

    def __init__(self, config: dict[str, Any] | None = None, render_mode: str | None = None) -> None:
        self._network: TownNetwork | None = None
        self._network_of: Any = None
        super().__init__(config, render_mode)

    @classmethod
    def default_config(cls) -> dict[str, Any]:
        """Settings that hold where `config` gives no other."""
        config: dict[str, Any] = super().default_config()
        config.update(
            town="brookside",
            vehicles=10,
            pedestrians=0,
            duration=60.0,
            reward_speed=9.0,
            collision_reward=-1.0,
            action={"type": "DiscreteMetaAction", "target_speeds": [0.0, 4.5, 9.0]},
            neighbour_vehicles_connected_lanes=True,
            screen_width=600,
            screen_height=600,
            centering_position=[0.5, 0.5],
        )
        return config

    @property
    def ego(self) -> Array:
        """The vehicle under control: x, y [m], heading [rad], speed [m/s]."""
        vehicle = self.vehicle
        return np.array((*vehicle.position, vehicle.heading, vehicle.speed))

    def define_spaces(self) -> None:
        """Sets the spaces, with finite bounds: nothing in a town is beyond `FARTHEST`."""
        super().define_spaces()
        quicken(self.observation_type)
        self.observation_space = finite(self.observation_space)
        for kind in parts_of(self.observation_type):
            viewer = getattr(kind, "viewer", None)
            if viewer is not None:
                viewer.enabled = True  # under SDL's dummy video driver it would show black

    def _reset(self) -> None:
        if self._network is None or self._network_of != self.config["town"]:
            self._network_of = self.config["town"]
            self._network = TownNetwork(load_town(self._network_of))
        network, town = self._network, self._network.town
        vehicles, pedestrians = int(self.config["vehicles"]), int(self.config["pedestrians"])
        seed = int(self.np_random.integers(SEEDS))
        arrays = empty_world(town_arrays(network), vehicles=vehicles + 1, pedestrians=pedestrians, seed=seed)
        self.road = CompiledRoad(
            network, arrays, np_random=self.np_random, record_history=self.config["show_trajectories"]
        )
        (lane, station), (goal, there) = free_places(town, self.np_random, 2)
        start = town.lanes[lane]
        vehicle = self.vehicle = self.action_type.vehicle_class(
            self.road, start.position(station), heading=start.heading_at(station), speed=0.0
        )
        vehicle.height = start.height_at(station)
        vehicle.lane_index = network.index_of(lane)  # highway-env asks for the closest one, be it under a bridge
        vehicle.lane = network.get_lane(vehicle.lane_index)
        if isinstance(vehicle, ControlledVehicle):
            vehicle.target_lane_index = vehicle.lane_index
        self.vehicle.goal = Landmark(self.road, town.lanes[goal].position(there), town.lanes[goal].heading_at(there))
        self.road.vehicles.append(self.vehicle)
        self.road.show()
        populate_around(network, arrays, self.np_random, vehicles=vehicles, pedestrians=pedestrians)
        self.road.show()

    def _reward(self, action: Any) -> float:
        return float(sum(self._rewards(action).values()))

    def _rewards(self, action: Any) -> dict[str, float]:
        vehicle = self.vehicle
        station, _ = vehicle.lane.local_coordinates(vehicle.position)
        along = vehicle.speed * np.cos(vehicle.lane.heading_at(station) - vehicle.heading)
        return {
            "progress": float(vehicle.on_road * np.clip(along / self.config["reward_speed"], 0.0, 1.0)),
            "collision": float(self.config["collision_reward"] * vehicle.crashed),
        }

    def render(self) -> NDArray[np.uint8] | None:
        """Draws as highway-env does, also under SDL's dummy video driver, where its viewer would show black."""
        if self.viewer is None and self.render_mode is not None:
            viewer = EnvViewer(self)
            viewer.enabled = True
            self.viewer: EnvViewer | None = viewer
        picture: NDArray[np.uint8] | None = super().render()
        return picture

    def _is_terminated(self) -> bool:
        return bool(self.vehicle.crashed)

    def _is_truncated(self) -> bool:
        return bool(self.time >= self.config["duration"])


def finite(space: spaces.Space[Any]) -> spaces.Space[Any]:
    """The same space with finite bounds; images have them."""
    if isinstance(space, spaces.Dict):
        return spaces.Dict({name: finite(part) for name, part in space.items()})
    if isinstance(space, spaces.Tuple):
        return spaces.Tuple([finite(part) for part in space])
    if isinstance(space, spaces.Box) and space.dtype != np.uint8:
        low, high = np.clip(space.low, -FARTHEST, FARTHEST), np.clip(space.high, -FARTHEST, FARTHEST)
        return spaces.Box(low, high, dtype=space.dtype.type)
    return space
