"""`Town-v0`: a highway-env environment in a town, without roles, dialogue or tasks."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final, TypedDict

import gymnasium
import numpy as np
from gymnasium import spaces
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.envs.common.graphics import EnvViewer
from highway_env.envs.common.observation import (
    ObservationType,
)
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.objects import Landmark
from numpy.typing import NDArray

from dorothie_gym.errors import short_repr
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.sim.network.network import LARGEST_COORDINATE, TownNetwork
from dorothie_gym.sim.population import free_places, populate
from dorothie_gym.sim.road import CompiledRoad
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.sim.town_observations import parts_of, use_faster_observations
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.parameters import CLEAR_OF_CAR
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.action_values import real_numbers, whole_number
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.support.copying import Restorable
from dorothie_gym.support.display import open_display
from dorothie_gym.support.time_limit import TimeLimited, steps_until

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

ROUNDS = 8
"""Maximum number of rounds in which vehicles and pedestrians too close to the ego are placed again."""

SEEDS = 2**31
"""Upper bound of the seeds of a world's random numbers."""


def populate_around(
    network: TownNetwork, world: WorldArrays, rng: np.random.Generator, *, vehicles: int, pedestrians: int
) -> None:
    """Adds vehicles and pedestrians at random places, as many as fit and none close to the ego, the first vehicle.

    Args:
        network: network of the town.
        world: arrays of the world with the ego.
        rng: generator of the places.
        vehicles: number of other vehicles.
        pedestrians: number of pedestrians.
    """
    town = town_arrays(network)
    ego = world.vehicles[0]
    others = ((plain(world.vehicles)[1:], "kind", Kind.EMPTY), (plain(world.pedestrians), "state", Walk.EMPTY))
    for _ in range(ROUNDS):
        there = _counts(world)
        missing = np.array((vehicles + 1, pedestrians)) - there
        if not missing.any():
            break
        seed = int(rng.integers(SEEDS))
        populate(network, town, world, seed=seed, vehicles=int(missing[0]), pedestrians=int(missing[1]))
        if (_counts(world) == there).all():
            break  # the town is full
        for bodies, state, empty in others:
            close = pn.hypot(bodies["x"] - ego.x, bodies["y"] - ego.y) < CLEAR_OF_CAR
            bodies[state][close] = empty
    rebuild(town, world)


def _counts(world: WorldArrays) -> NDArray[np.int64]:
    """Returns the numbers of vehicles and pedestrians (2,)."""
    return np.array(((world.vehicles["kind"] != Kind.EMPTY).sum(), (world.pedestrians["state"] != Walk.EMPTY).sum()))


class TownConfig(TypedDict):
    """Settings of `TownEnv`, with those of highway-env that the vectorised version reads."""

    town: str
    vehicles: int
    pedestrians: int
    duration: float
    reward_speed: float
    collision_reward: float
    simulation_frequency: float
    policy_frequency: float
    observation: dict[str, object]
    action: dict[str, object]


def config_with_town(config: Mapping[str, object] | None, town: str | Path | None) -> dict[str, object]:
    """Returns settings with the town of the argument `town`.

    Raises:
        ValueError: the settings are not a dictionary, or name another town.
    """
    if config is not None and not isinstance(config, Mapping):
        raise ValueError(f"config is a {type(config).__name__}; it must be a dictionary of settings")
    settings = dict(config or {})
    if town is not None and str(settings.setdefault("town", str(town))) != str(town):
        raise ValueError(f"town is {str(town)!r}, but config has the town {settings['town']!r}; give one of them")
    return settings


class TownEnv(Restorable, TimeLimited, AbstractEnv):
    """Driving through a town among other vehicles, as an environment of highway-env.

    ## Description
    highway-env's `AbstractEnv` on the road network of a town, with highway-env's observation and action types, viewer
    and controlled vehicle. At junctions the route of the ego is random. Vehicles, cyclists and pedestrians behave as in
    `DuoWizardEnv`, with traffic lights, signs, priorities and crosswalks, and are simulated in compiled loops;
    `env.unwrapped.road.vehicles` and `.objects` represent them as objects of highway-env.

    ## Observation Space
    Set by `config["observation"]` (default: highway-env's `Kinematics`), with finite bounds. All types work except
    `ExitObservation`, which requires one road of highway-env. `KinematicsGoal` receives a random place in the town as
    its goal, and `AttributesObservation` may read `ego`.

    ## Action Space
    Set by `config["action"]` (default: highway-env's `DiscreteMetaAction`); all types work. There is no action mask,
    neither in the infos nor as `action_masks()`: an action without effect, such as a lane change on the outer lane, is
    ignored. Therefore sb3-contrib's MaskablePPO refuses the environment, unless a wrapper makes a mask of highway-env's
    `get_available_actions()` ([example](../integrations.md#sb3-contrib)).

    ## Rewards
    The progress on the road plus `config["collision_reward"]` for a crash. The progress is the speed along the lane as
    a share of `config["reward_speed"]`, in [0, 1], and 0 off the road. The terms are in `info["rewards"]`.

    ## Episode End
    Terminates when the ego collides with a vehicle, a pedestrian or a prop; truncates after `config["duration"]`
    seconds.

    ## Arguments
    `town`: name of a town, or path of an `.xodr` or `.yaml` file, as the setting of the same name.

    `config`: settings of highway-env, and:

    - `town`: name of a town, or path of an `.xodr` or `.yaml` file.
    - `vehicles`: number of other vehicles, at most as many as fit; none starts within 25 m of the ego.
    - `pedestrians`: number of pedestrians; 0 in a town without pavements. The default is 0, because `Kinematics` does
      not distinguish them from vehicles, so that passers-by would fill its rows.
    - `duration` [s], `reward_speed` [m/s], `collision_reward`: see above.

    Of highway-env's own settings, `simulation_frequency` [Hz], 15 by default, must be a whole multiple of
    `policy_frequency` [Hz]: highway-env leaves out the rest of every decision, but not on its clock.

    ## Version History
    - v0: first version.
    """

    metadata: ClassVar[dict[str, object]] = {"render_modes": ["human", "rgb_array"], "render_fps": 2}

    # set by highway-env's methods, which carry no types
    observation_type: ObservationType
    observation_space: spaces.Space[object]

    def __init__(
        self,
        config: dict[str, object] | None = None,
        render_mode: str | None = None,
        town: str | Path | None = None,
    ) -> None:
        self._network: TownNetwork | None = None
        self._network_of: str | None = None
        super().__init__(config_with_town(config, town), render_mode)

    @property
    def decision_limit(self) -> int:
        """Decisions until truncation."""
        return steps_until(self.config["duration"], 1.0 / self.config["policy_frequency"])

    @classmethod
    def default_config(cls) -> TownConfig:
        """Returns the settings that hold where `config` gives no others."""
        config = super().default_config()
        config.update(
            town=DEFAULT_TOWN,
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
        settings: TownConfig = config
        return settings

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, object]]:
        """Begins an episode.

        Args:
            seed: seed of the episode.
            options: `config` changes settings, as in highway-env; other options cause a warning.
        """
        for name in options or {}:
            if name != "config":
                gymnasium.logger.warn(f"reset option {short_repr(name)} is unknown and ignored; known: config")
        first: tuple[NDArray[np.float32], dict[str, object]] = super().reset(seed=seed, options=options)
        return first

    @property
    def ego(self) -> Array:
        """State of the ego: x, y [m], heading [rad], speed [m/s]."""
        vehicle = self.vehicle
        return np.array((*vehicle.position, vehicle.heading, vehicle.speed))

    def define_spaces(self) -> None:
        """Sets the spaces, with the finite bounds `LARGEST_COORDINATE`, which all values in a town keep.

        Raises:
            ValueError: the substeps of a decision do not last as long as the decision.
        """
        check_frequencies(self.config["simulation_frequency"], self.config["policy_frequency"])
        super().define_spaces()
        use_faster_observations(self.observation_type)
        self.observation_space = finite(self.observation_space)
        # highway-env makes new spaces in each reset, and draws the action of the first info from them: they follow from
        # the environment's seed, whose own generator stays as it was.
        self.action_space.seed(int(copy.deepcopy(self.np_random).integers(SEEDS)))
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
        vehicle.lane_index = network.index_of(lane)  # highway-env finds the closest lane, which may be under a bridge
        vehicle.lane = network.get_lane(vehicle.lane_index)
        if isinstance(vehicle, ControlledVehicle):
            vehicle.target_lane_index = vehicle.lane_index
        self.vehicle.goal = Landmark(self.road, town.lanes[goal].position(there), town.lanes[goal].heading_at(there))
        self.road.vehicles.append(self.vehicle)
        self.road.show()
        populate_around(network, arrays, self.np_random, vehicles=vehicles, pedestrians=pedestrians)
        self.road.show()

    def step(self, action: object) -> tuple[object, float, bool, bool, dict[str, object]]:
        """Plays one decision, as highway-env does.

        Raises:
            ValueError: the action is malformed.
        """
        if not self.config["manual_control"]:
            check_action("action", action, self.action_space)
        outcome: tuple[object, float, bool, bool, dict[str, object]] = super().step(action)
        return outcome

    # --- Copies -------------------------------------------------------------------------------------------------------

    def mutable_values(self) -> dict[str, object]:
        """Returns the attributes of highway-env that change."""
        return {name: value for name, value in self.__dict__.items() if name not in _CONSTANT}

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, the town and the settings."""
        town = load_town(self.config["town"]) if self._network is None else self._network.town
        settings = {name: value for name, value in self.config.items() if name != "town"}
        return {**super().compatibility(), "the town": town.identity, "the settings": settings}

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "viewer": None, "_record_video_wrapper": None}

    def _reward(self, action: object) -> float:
        return float(sum(self._rewards(action).values()))

    def _rewards(self, action: object) -> dict[str, float]:
        vehicle = self.vehicle
        station, _ = vehicle.lane.local_coordinates(vehicle.position)
        along = vehicle.speed * pn.cos(vehicle.lane.heading_at(station) - vehicle.heading)
        return {
            "progress": float(vehicle.on_road * np.clip(along / self.config["reward_speed"], 0.0, 1.0)),
            "collision": float(self.config["collision_reward"] * vehicle.crashed),
        }

    def render(self) -> NDArray[np.uint8] | None:
        """Renders as highway-env does, also under SDL's dummy video driver, where its viewer would show black.

        Raises:
            RuntimeError: the mode is "human", and there is no display.
        """
        if self.viewer is None and self.render_mode is not None:
            if self.render_mode == "human":
                open_display()
            viewer = EnvViewer(self)
            viewer.enabled = True
            self.viewer: EnvViewer | None = viewer
        picture: NDArray[np.uint8] | None = super().render()
        return picture

    def _is_terminated(self) -> bool:
        return bool(self.vehicle.crashed)

    def _is_truncated(self) -> bool:
        return bool(self.time >= self.config["duration"])


_CONSTANT = frozenset({
    "render_mode", "viewer", "_record_video_wrapper", "config", "action_space", "observation_space", "_network",
    "_network_of", "spec", "_spec",
})  # fmt: skip
"""Attributes of `TownEnv` that do not change between resets, or belong to pictures."""


FREQUENCIES: Final = (1e-3, 1e4)
"""Smallest and largest frequency of substeps and decisions [Hz]."""


def check_frequencies(simulation: float, policy: float) -> None:
    """Checks that the substeps of a decision last as long as the decision.

    highway-env (1.12.1, `AbstractEnv`) simulates `simulation // policy` substeps in each decision, and adds
    `1 / policy` to its clock: with 15 and 4 Hz the world is a fifth slower than the clock, with 15 and 20 Hz it stands.

    Args:
        simulation: substeps a second [Hz].
        policy: decisions a second [Hz].

    Raises:
        ValueError: a frequency is no number in `FREQUENCIES`, or `simulation` is no whole multiple of `policy` in
            floating point.
    """
    given = f"simulation_frequency is {short_repr(simulation)} and policy_frequency {short_repr(policy)}"
    low, high = FREQUENCIES
    if not all(isinstance(rate, int | float | np.number) and low <= rate <= high for rate in (simulation, policy)):
        raise ValueError(f"{given}; both must be numbers from {low:g} to {high:g} [Hz]")
    substeps = int(simulation // policy)
    if substeps * policy != simulation:
        doublings = next(number for number in itertools.count() if policy * 2**number >= simulation)
        raise ValueError(
            f"{given}: highway-env would simulate only {substeps} substeps, {substeps / simulation:.3g} s, in a "
            f"decision of {1.0 / policy:.3g} s; choose a simulation_frequency that is a whole multiple, such as "
            f"{policy * 2**doublings:g}"
        )


def check_action(name: str, action: object, space: spaces.Space[object]) -> None:
    """Raises `ValueError` for an action of another form than those of a space; numbers of a `Box` must be finite."""
    if isinstance(space, spaces.Discrete):
        whole_number(name, action, int(space.start), int(space.start + space.n) - 1)
    elif isinstance(space, spaces.Box):
        real_numbers(name, action, space.shape, f"finite numbers of the shape {space.shape}")
    elif isinstance(space, spaces.Tuple):
        if not isinstance(action, tuple | list) or len(action) != len(space):
            raise ValueError(f"{name} is {short_repr(action)}; it must be {len(space)} actions, one for each vehicle")
        for number, (part, own) in enumerate(zip(action, space, strict=True)):
            check_action(f"{name}[{number}]", part, own)


def finite(space: spaces.Space[object]) -> spaces.Space[object]:
    """Returns the same space with finite bounds; those of images are finite already."""
    if isinstance(space, spaces.Dict):
        return spaces.Dict({name: finite(part) for name, part in space.items()})
    if isinstance(space, spaces.Tuple):
        return spaces.Tuple([finite(part) for part in space])
    if isinstance(space, spaces.Box) and space.dtype != np.uint8:
        low, high = (
            np.clip(space.low, -LARGEST_COORDINATE, LARGEST_COORDINATE),
            np.clip(space.high, -LARGEST_COORDINATE, LARGEST_COORDINATE),
        )
        return spaces.Box(low, high, dtype=space.dtype.type)
    return space
