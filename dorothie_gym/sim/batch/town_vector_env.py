"""Vectorised `Town-v0`, the result of `gymnasium.make_vec`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, TypeAlias, cast

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from highway_env.envs.common.action import ContinuousAction, DiscreteMetaAction, action_factory
from highway_env.envs.common.observation import KinematicObservation
from highway_env.road.lane import AbstractLane
from highway_env.utils import lmap
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import NDArray

from dorothie_gym.action_values import as_array
from dorothie_gym.compilation.records import RecordArray, empty_records
from dorothie_gym.copying import Restorable
from dorothie_gym.errors import short_repr
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.model import Array
from dorothie_gym.sim.batch.egos import (
    FASTER,
    FEATURES,
    IDLE,
    LEFT,
    NOTHING,
    RIGHT,
    SLOWER,
    Egos,
    HelmRecord,
    OutcomeRecord,
    View,
    begin_one,
    lanes_beside,
    play_share,
)
from dorothie_gym.sim.batch.worlds import VectorWorld
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.population import add_vehicle, free_places
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.sim.town_env import SEEDS, TownConfig, TownEnv, config_with_town, finite, populate_around
from dorothie_gym.vector_infos import Infos, mask_of, masked_infos, seeds_of

ActionArray: TypeAlias = "NDArray[np.int64] | NDArray[np.float32]"
"""Meta actions (n,), or continuous actions (n, 1 or 2) in [-1, 1]."""

_CODES = {"LANE_LEFT": LEFT, "IDLE": IDLE, "LANE_RIGHT": RIGHT, "FASTER": FASTER, "SLOWER": SLOWER}


class Actions:
    """Actions of the egos.

    Attributes:
        space: of the actions of one.
        speeds: possible target speeds with meta actions [m/s]; empty for continuous actions.
    """

    def __init__(self, config: Mapping[str, object]) -> None:
        """Reads highway-env's setting `action`; raises `ValueError` for types of plain environments only."""
        if config.get("type") not in ("DiscreteMetaAction", "ContinuousAction"):
            raise _sync_only("action", f"type {config.get('type')!r}")
        self._stock = action_factory(None, dict(config))
        self.space: spaces.Space[ActionArray] = self._stock.space()
        self.speeds: Array = np.zeros(0)
        self._codes: NDArray[np.int32] = np.zeros(0, dtype=np.int32)
        self._discrete = isinstance(self._stock, DiscreteMetaAction)
        if self._discrete:
            self._read_speeds()
        else:
            self._read_ranges()

    def _read_speeds(self) -> None:
        self.speeds = np.array(self._stock.target_speeds, dtype=np.float64)
        if self.speeds.ndim != 1 or len(self.speeds) < 2 or self.speeds[0] == self.speeds[-1]:
            raise ValueError(f"action: target_speeds must be two or more speeds, not {self._stock.target_speeds}")
        self._codes = np.array([_CODES[self._stock.actions[k]] for k in range(len(self._stock.actions))], np.int32)

    def _read_ranges(self) -> None:
        stock: ContinuousAction = self._stock
        if stock.dynamical:
            raise _sync_only("action", "dynamical")
        if stock.speed_range and max(map(abs, stock.speed_range)) > Vehicle.MAX_SPEED:
            raise _sync_only("action", f"a speed_range beyond {Vehicle.MAX_SPEED} m/s")

    def read(
        self, actions: ActionArray, space: spaces.Space[ActionArray], helms: RecordArray[HelmRecord]
    ) -> NDArray[np.int32]:
        """Returns the codes (n,) of meta actions; continuous actions are written to the helms, and are no meta actions.

        Args:
            actions: (n, ...) one for each ego.
            space: of the actions of all.
            helms: `HelmRecord` of each ego.

        Raises:
            ValueError: actions of the wrong shape, or that do not exist.
        """
        if actions.shape != space.shape:
            raise ValueError(f"actions must have the shape {space.shape}, not {actions.shape}")
        if self._discrete:
            if not np.issubdtype(actions.dtype, np.integer) or actions.min() < 0 or actions.max() >= len(self._codes):
                raise ValueError(
                    f"actions must be integers from 0 to {len(self._codes) - 1}, not {short_repr(actions)}"
                )
            codes: NDArray[np.int32] = self._codes[actions]
            return codes
        if actions.dtype.kind not in "iuf" or not np.isfinite(actions).all():
            raise ValueError(f"actions must be finite numbers, not {short_repr(actions)}")
        stock: ContinuousAction = self._stock
        wanted = np.clip(actions, -1, 1) if stock.clip else actions
        helms["acceleration"] = lmap(wanted[:, 0], [-1, 1], stock.acceleration_range) if stock.longitudinal else 0.0
        helms["steering"] = lmap(wanted[:, -1], [-1, 1], stock.steering_range) if stock.lateral else 0.0
        return np.full(len(actions), NOTHING, dtype=np.int32)

    def limit(self, helm: HelmRecord) -> None:
        """Sets the range of an ego's speeds."""
        if not self._discrete and self._stock.speed_range:
            helm.lowest, helm.highest = self._stock.speed_range


class Kinematics:
    """Observation of the egos.

    Attributes:
        space: of the observations of one.
        view: its columns and settings.
        shuffled: whether the rows of others are in random order.
    """

    def __init__(self, config: Mapping[str, object]) -> None:
        """Reads highway-env's setting `observation`; raises `ValueError` for types of plain environments only."""
        if config.get("type") != "Kinematics":
            raise _sync_only("observation", f"type {config.get('type')!r}")
        self._stock = KinematicObservation(None, **config)
        unknown = [feature for feature in self._stock.features if feature not in FEATURES]
        if unknown:
            raise _sync_only("observation", f"features {', '.join(unknown)}")
        if self._stock.vehicles_count < 1:
            raise ValueError(f"observation: vehicles_count must be at least 1, not {self._stock.vehicles_count}")
        if self._stock.order not in ("sorted", "shuffled"):
            raise ValueError(f"observation: order must be 'sorted' or 'shuffled', not {self._stock.order!r}")
        self.space: spaces.Box = self._stock.space()
        self.shuffled = self._stock.order == "shuffled"
        codes = np.array([FEATURES[feature] for feature in self._stock.features], dtype=np.int32)
        self.view = View(
            codes,
            absolute=bool(self._stock.absolute),
            ordered=not self.shuffled,
            behind=bool(self._stock.see_behind),
            clip=bool(self._stock.clip),
            walkers=bool(self._stock.include_obstacles),
        )

    def ranges(self, lanes: int) -> Array:
        """Returns (f, 2) values of each feature that are shown as -1 and 1, NaN where values are not scaled.

        Args:
            lanes: how many there are on the road where the ego begins: highway-env's unit of `y`.
        """
        found = np.full((len(self._stock.features), 2), np.nan)
        if self._stock.normalize:
            far, fast, wide = 5.0 * Vehicle.MAX_SPEED, 2.0 * Vehicle.MAX_SPEED, AbstractLane.DEFAULT_WIDTH * lanes
            usual = {"x": (-far, far), "y": (-wide, wide), "vx": (-fast, fast), "vy": (-fast, fast)}
            for name, limits in (self._stock.features_range or usual).items():
                found[[feature == name for feature in self._stock.features]] = limits
        return found


def _sync_only(setting: str, what: str) -> ValueError:
    return ValueError(
        f"{setting}: {what} is not compiled for many environments at once; "
        'gymnasium.make_vec(..., vectorization_mode="sync") runs the plain environments with it'
    )


# --- Vector environment -----------------------------------------------------------------------------------------------


class TownVectorEnv(Restorable, VectorEnv[NDArray[np.float32], ActionArray, NDArray[np.generic]]):
    """Vectorised `TownEnv`: each environment has a world of its own, and a step is one compiled call per thread.

    ## Description
    Vehicles, rewards and episode ends are those of `TownEnv`; the ego is highway-env's `MDPVehicle` (or, with
    `ContinuousAction`, its `Vehicle`), implemented on the arrays. An environment depends on its own seed and actions
    only: not on the others, its place among them, or the number of threads.

    ## Observation Space
    `Kinematics` with the features presence, x, y, vx, vy, heading, cos_h and sin_h, and highway-env's options.

    ## Action Space
    `DiscreteMetaAction` or `ContinuousAction` (not `dynamical`), with highway-env's options.

    ## Rewards
    As `TownEnv`; `infos["rewards"]` has the terms.

    ## Episode End
    As `TownEnv`. `metadata["autoreset_mode"]` selects the reset: by default an environment that ended is reset by the
    next step, whose action it ignores.

    ## Arguments
    `num_envs`: how many; `config`: see `TownEnv`; `threads`: how many at most, by default one per processor;
    `autoreset_mode`: gymnasium's; `options["reset_mask"]` of `reset` resets some only.

    ## Version History
    - v0: first version.
    """

    metadata: dict[str, object] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    CHANGES: ClassVar[Sequence[str]] = (
        "_egos", "_shown", "_generators", "_seeds", "_elapsed", "_over", "_begun"
    )  # fmt: skip

    def __init__(
        self,
        num_envs: int = 1,
        config: dict[str, object] | None = None,
        render_mode: str | None = None,
        threads: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        town: str | Path | None = None,
    ) -> None:
        """Makes environments, to be reset before they are used.

        Raises:
            ValueError: `config` asks for something that only the plain environments can do; they run side by side with
                `vectorization_mode="sync"`.
        """
        if render_mode is not None:
            raise ValueError(f'{render_mode=}: there are no pictures of many towns; use vectorization_mode="sync"')
        self.num_envs = num_envs
        self.metadata = {**self.metadata, "autoreset_mode": AutoresetMode(autoreset_mode)}
        self.config = cast(TownConfig, {**TownEnv.default_config(), **config_with_town(config, town)})
        self._actions, self._kinematics = Actions(self.config["action"]), Kinematics(self.config["observation"])
        self.single_action_space = self._actions.space
        self.single_observation_space = finite(self._kinematics.space)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._network = network_of(load_town(self.config["town"]))
        self._town = town_arrays(self._network)
        self._worlds = VectorWorld(self._town, self._empty(0), num_envs, threads=threads)
        self._egos = self._make_egos()
        self._shown = np.zeros_like(self._egos.observations)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._seeds: list[int] = [-1] * num_envs
        self._elapsed = np.zeros(num_envs)
        self._over = np.ones(num_envs, dtype=np.bool_)
        self._begun = np.zeros(num_envs, dtype=np.bool_)

    def _make_egos(self) -> Egos:
        shape = (self.num_envs, *self._kinematics.space.shape)
        return Egos(
            lanes_beside(self._network),
            self._actions.speeds,
            np.zeros(1, dtype=np.int64),
            np.zeros((self.num_envs, 1, 4)),
            empty_records(HelmRecord, self.num_envs),
            np.zeros((self.num_envs, shape[2], 2)),
            np.zeros(shape[:2], dtype=np.int32),
            np.zeros(shape[:2]),
            np.zeros(shape, dtype=np.float32),
            empty_records(OutcomeRecord, self.num_envs),
        )

    def mutable_values(self) -> dict[str, object]:
        """Returns what changes in the environments and in their worlds."""
        return {**super().mutable_values(), "arrays": self._worlds.arrays}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environments and of their worlds."""
        self._worlds.arrays = cast(WorldArrays, values.pop("arrays"))
        super().apply_values(values)

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, their number, the town and the settings."""
        town = self._network.town.identity
        return {
            **super().compatibility(), "the number of environments": self.num_envs, "the town": town,
            "the settings": {name: value for name, value in self.config.items() if name != "town"},
        }  # fmt: skip

    # --- Gymnasium's interface ----------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, object] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, object]]:
        """Begins new episodes.

        Args:
            seed: of the first environment; the others have the numbers that follow. Or one for each.
            options: `reset_mask`, a bool array (num_envs,): which environments, by default all.

        Returns:
            Observations (num_envs, vehicles, features) and infos, of all environments and of those that begin.

        Raises:
            ValueError: not one seed for each environment, a mask of the wrong shape or type, or other options.
        """
        options = dict(options or {})
        mask = mask_of(options.pop("reset_mask", None), self.num_envs)
        if options:
            raise ValueError(f'options {sorted(options)} are understood with vectorization_mode="sync" only')
        seeds = seeds_of(seed, self.num_envs)
        for i in np.flatnonzero(mask):
            self._begin(int(i), seeds[int(i)])
        return self._observe(mask), self._infos(mask, np.zeros(self.action_space.shape or (), self.action_space.dtype))

    def step(
        self, actions: ActionArray
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, object]]:
        """Plays a decision in every environment.

        Args:
            actions: (num_envs, ...) one for each.

        Returns:
            Observations (num_envs, vehicles, features), rewards, terminations and truncations (num_envs,), infos.

        Raises:
            ValueError: actions that are not of the action space, or environments that were never reset (or are over,
                where the autoreset mode leaves resets to the caller).
        """
        actions = cast(ActionArray, as_array("actions", actions))
        mode = self.metadata["autoreset_mode"]
        if not self._begun.all():
            raise ValueError("reset the environments before the first step")
        if mode is AutoresetMode.DISABLED and self._over.any():
            raise ValueError(f"the environments {np.flatnonzero(self._over)} are over: reset them with a reset_mask")
        codes = self._actions.read(actions, self.action_space, self._egos.helms)
        again, everywhere = self._over.copy(), np.ones(self.num_envs, dtype=np.bool_)
        self._play(codes, ~again)
        self._begin_all(again)
        rewards = np.where(again, 0.0, sum(self._terms().values()))
        terminations = ~again & self._egos.outcomes["crashed"]
        truncations = ~again & (self._elapsed >= self.config["duration"])
        self._over = terminations | truncations
        observations, infos = self._observe(everywhere), self._infos(everywhere, _without(actions, again))
        if mode is AutoresetMode.SAME_STEP and self._over.any():
            observations, infos = self._begin_at_once(observations, actions)
        return observations, rewards, terminations, truncations, infos

    def _begin_at_once(
        self, last: NDArray[np.float32], actions: ActionArray
    ) -> tuple[NDArray[np.float32], dict[str, object]]:
        """Resets environments that are over; returns observations and infos as in the mode `SAME_STEP`."""
        over = self._over.copy()
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(over):
            final[i] = last[i]
        ended = self._infos(over, actions)
        self._begin_all(over)
        infos = self._infos(np.ones(self.num_envs, dtype=np.bool_), _without(actions, over))
        infos |= {"final_obs": final, "_final_obs": over, "final_info": ended, "_final_info": over.copy()}
        return self._observe(over), infos

    def close_extras(self, **_kwargs: object) -> None:
        """Ends the threads."""
        self._worlds.close()

    # of many environments instead of one, and read-only
    @property  # type: ignore[misc]  # gymnasium's is writable
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]  # see above
        """The environments' generators."""
        return tuple(self._generator(i) for i in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]  # see `np_random`
        """The environments' seeds."""
        return tuple(self._seeds[i] for i, _ in enumerate(self.np_random))

    @property
    def threads(self) -> int:
        """Number of threads."""
        return self._worlds.threads

    def world(self, number: int) -> WorldArrays:
        """Returns the world of an environment; its first vehicle is the ego."""
        return self._worlds.world(number)

    # --- Episodes -----------------------------------------------------------------------------------------------------

    def _play(self, codes: NDArray[np.int32], playing: NDArray[np.bool_]) -> None:
        frequency, decisions = self.config["simulation_frequency"], self.config["policy_frequency"]
        self._worlds.share(
            play_share, self._town, self._worlds.arrays, self._kinematics.view, self._egos, codes, playing,
            int(frequency // decisions), 1.0 / frequency,
        )  # fmt: skip
        self._elapsed += 1.0 / decisions

    def _begin(self, i: int, seed: int | None) -> None:
        """Begins an episode of one environment."""
        if seed is not None:
            self._generators[i], self._seeds[i] = seeding.np_random(seed)
        rng = self._generator(i)
        # in the order in which `TownEnv` draws, so that a seed is the same town there
        world = self._empty(int(rng.integers(SEEDS)))
        lane, station = free_places(self._network.town, rng, 2)[0]
        add_vehicle(self._town, world, lane, station, kind=Kind.EGO, desired=0.0)
        world.vehicles["key"][0] = world.clock["keys"][0] = 0
        vehicles, pedestrians = int(self.config["vehicles"]), int(self.config["pedestrians"])
        populate_around(self._network, world, rng, vehicles=vehicles, pedestrians=pedestrians)
        self._worlds.put(i, world)
        road = self._network.index_of(int(world.vehicles[0].lane))
        self._egos.ranges[i] = self._kinematics.ranges(len(self._network.all_side_lanes(road)))
        begin_one(i, self._town, self._worlds.arrays, self._kinematics.view, self._egos)
        self._actions.limit(self._egos.helms[i])
        self._elapsed[i], self._over[i], self._begun[i] = 0.0, False, True

    def _begin_all(self, mask: NDArray[np.bool_]) -> None:
        for i in np.flatnonzero(mask):
            self._begin(int(i), None)

    def _empty(self, seed: int) -> WorldArrays:
        vehicles, pedestrians = int(self.config["vehicles"]), int(self.config["pedestrians"])
        return empty_world(self._town, vehicles=1 + vehicles, pedestrians=pedestrians, props=0, seed=seed)

    def _generator(self, i: int) -> np.random.Generator:
        found = self._generators[i]
        if found is None:
            found, self._seeds[i] = seeding.np_random()
            self._generators[i] = found
        return found

    def _observe(self, mask: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Returns the observations of all environments, after an update of those of the mask."""
        self._shown[mask] = self._egos.observations[mask]
        if self._kinematics.shuffled:
            for i in np.flatnonzero(mask):
                self._generator(int(i)).shuffle(self._shown[i, 1:])
        return self._shown.copy()

    def _terms(self) -> dict[str, NDArray[np.float64]]:
        outcomes = self._egos.outcomes
        return {
            "progress": np.clip(outcomes["along"] / self.config["reward_speed"], 0.0, 1.0),
            "collision": self.config["collision_reward"] * outcomes["crashed"].astype(np.float64),
        }

    def _infos(self, mask: NDArray[np.bool_], actions: NDArray[np.generic]) -> dict[str, object]:
        """Returns the infos of `SyncVectorEnv`, for the environments of a mask."""
        outcomes = self._egos.outcomes
        values: dict[str, NDArray[np.generic] | Infos] = {
            "speed": outcomes["speed"],
            "crashed": outcomes["crashed"],
            "action": actions,
        }
        return masked_infos({**values, "rewards": masked_infos(self._terms(), mask)}, mask)


def _without(actions: ActionArray, mask: NDArray[np.bool_]) -> ActionArray:
    """Returns a copy of the actions with zeros for the egos of a mask, which took none."""
    taken = actions.copy()
    taken[mask] = 0
    return taken
