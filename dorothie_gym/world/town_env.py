"""`Town-v0`: a plain highway-env environment in a town, without roles, talk or tasks."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.envs.common.graphics import EnvViewer
from numpy.typing import NDArray

from dorothie_gym.world.actors import Actors
from dorothie_gym.world.junctions import JunctionControl
from dorothie_gym.world.network.network import FARTHEST, TownNetwork
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.places import free_places
from dorothie_gym.world.town import load_town


class TownEnv(AbstractEnv):
    """Drives through a town among other vehicles.

    ## Description
    highway-env's own environment on a town's road network: its vehicles, observation and action types, its viewer.
    Routes are drawn by chance at junctions; other vehicles drive as in `DuoWizardEnv`.

    ## Observation Space
    As `config["observation"]` says (highway-env's `Kinematics` by default), with finite bounds.

    ## Action Space
    As `config["action"]` says (highway-env's `DiscreteMetaAction` by default).

    ## Rewards
    Progress on the road: speed along the lane as a share of `config["reward_speed"]`, in [0, 1], and 0 off the road,
    plus `config["collision_reward"]` for a crash. The terms are in `info["rewards"]`.

    ## Episode End
    Terminates when the vehicle crashes, truncates after `config["duration"]` seconds.

    ## Arguments
    `config`: highway-env's settings, and
    - `town`: name of a town, or path of an `.xodr` or `.yaml` file;
    - `vehicles`: how many others, as many as fit;
    - `duration` [s], `reward_speed` [m/s], `collision_reward`: see above.

    ## Version History
    - v0: first version.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"], "render_fps": 2}

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

    def define_spaces(self) -> None:
        """Sets the spaces, with finite bounds: nothing in a town is beyond `FARTHEST`."""
        super().define_spaces()
        space: spaces.Space[Any] = self.observation_type.space()
        if isinstance(space, spaces.Box) and space.dtype != np.uint8:
            low, high = np.clip(space.low, -FARTHEST, FARTHEST), np.clip(space.high, -FARTHEST, FARTHEST)
            self.observation_space = spaces.Box(low, high, dtype=space.dtype)

    def _reset(self) -> None:
        if self._network is None or self._network_of != self.config["town"]:
            self._network_of = self.config["town"]
            self._network = TownNetwork(load_town(self._network_of))
        town = self._network.town
        self.road = TownRoad(self._network, np_random=self.np_random, record_history=self.config["show_trajectories"])
        lane, station = free_places(town, self.np_random, 1)[0]
        start = town.lanes[lane]
        self.vehicle = self.action_type.vehicle_class(
            self.road, start.position(station), heading=start.heading_at(station), speed=0.0
        )
        self.road.vehicles.append(self.vehicle)
        self._actors = Actors(
            self.road, JunctionControl(town), self.vehicle, traffic_rng=self.np_random, walk_rng=self.np_random
        )
        self._actors.populate(vehicles=self.config["vehicles"], pedestrians=0)

    def _simulate(self, action: Any = None) -> None:
        super()._simulate(action)
        self._actors.tidy()

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
