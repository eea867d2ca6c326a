"""Environments in the form that learners take: vectors or pictures as observations, numbers as actions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, SupportsFloat

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

import dorothie_gym
from dorothie_gym._registration import environments
from dorothie_gym.baselines.rl.repeatable_batch import RepeatableVecEnv
from dorothie_gym.baselines.rl.sb3_vec_env import unrelated_seeds
from dorothie_gym.baselines.rl.vector_env import AnyEnv, make_vector_env
from dorothie_gym.errors import ModelFileError, SettingsError, short_repr
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.navigation.observation_fields import Vector
from dorothie_gym.policies.policy_loader import find_player
from dorothie_gym.session.spaces.fields import UNBOUNDED, SpaceLimits

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl.settings import Arguments, Page, TrainingSettings

ENVIRONMENTS_OF_MODELS: Final = frozenset(
    f"dorothie_gym/{name}-v0"
    for name in ("Participant", "CoWizard", "AdWizard", "Navigation", "Navigation-continuous", "UfN", "RfN", "NfD")
)
"""Ids of environments that the folder of a model may name."""

ROLE_ENVIRONMENTS: Final[Mapping[str, Role]] = MappingProxyType(
    {env.id: Role(env.kwargs["role"]) for env in environments() if "role" in env.kwargs}
)
"""Roles of the environments in which an agent plays one of the three, by id."""

PARTNERS: Final = "partners"
"""Argument of these environments: policies of the other roles."""

TOWN: Final = "town"
"""Argument of environments; only batches accept a list of several towns."""

_PLAIN = (spaces.Discrete, spaces.MultiDiscrete, spaces.Box)


def make_env(name: str, settings: Arguments | None = None) -> AnyEnv:
    """Makes an environment whose observations are vectors or pictures; of several towns, the first one is used.

    Environments with other spaces are flattened (`dorothie_gym.flatten`), and their observations squashed.

    Args:
        name: id of the environment.
        settings: its arguments; `partners` may also name files of policies.

    Raises:
        SettingsError: there is no such environment, or it does not accept these arguments.
    """
    if ":" in name:
        raise SettingsError(f"env is {short_repr(name)}; it must be a registered id, without a module to import")
    try:
        arguments = each_town(settings or {})[0]
        env: AnyEnv = gym.make(name, disable_env_checker=True, **_with_partners(name, arguments))
    except (gym.error.Error, TypeError, ValueError) as error:
        raise SettingsError(f"env {name}: {error.__cause__ or error}") from error
    observed, acted = env.observation_space, env.action_space
    if isinstance(observed, spaces.Box) and len(observed.shape) in (1, 3) and isinstance(acted, _PLAIN):
        return env
    return SquashedObservation(dorothie_gym.flatten(env))


def _with_partners(name: str, settings: Arguments) -> Arguments:
    """Returns the arguments of an environment with the policies of the other roles instead of their names.

    Raises:
        ValueError: there is no such policy, or it plays another role.
    """
    partners = settings.get(PARTNERS)
    if name not in ROLE_ENVIRONMENTS or not isinstance(partners, Mapping):
        return settings
    spaces_only = gym.make(name, disable_env_checker=True, **{**settings, PARTNERS: {}})
    limits: SpaceLimits = spaces_only.get_wrapper_attr("engine").limits
    found = {
        role: find_player(given, Role(role)).make(Role(role), limits)
        if isinstance(given, str) and role in AGENT_ROLES
        else given
        for role, given in partners.items()
    }
    return {**settings, PARTNERS: found}


def each_town(settings: Arguments) -> list[Arguments]:
    """Returns the arguments of an environment for each of its towns, over which several environments cycle.

    Raises:
        SettingsError: the list of towns is empty.
    """
    towns = settings.get(TOWN)
    if not isinstance(towns, list | tuple):
        return [settings]
    if not towns:
        raise SettingsError(f"{TOWN} is []; it must have at least one town")
    return [{**settings, TOWN: town} for town in towns]


def make_env_of_model(name: str, settings: Arguments | None, folder: Path) -> AnyEnv:
    """Makes the environment that the description of a model names; the file may be untrusted.

    Args:
        name: id of the environment.
        settings: its arguments.
        folder: folder of the model.

    Raises:
        ModelFileError: it is not an environment of this package that vectors can play. `Town-v0` is excluded:
            highway-env imports the classes that its settings name.
        SettingsError: it does not accept these arguments.
    """
    if name not in ENVIRONMENTS_OF_MODELS:
        raise ModelFileError(
            f"{folder}: the model is one of the environment {short_repr(name)}; models of "
            f"{', '.join(sorted(ENVIRONMENTS_OF_MODELS))} can be opened"
        )
    others = {argument: value for argument, value in (settings or {}).items() if argument != PARTNERS}
    return make_env(name, others)  # the partners in training do not affect what the model observes and does


def squashed(values: NDArray[np.generic]) -> Vector:
    """Maps each number x to sign(x) log(1 + |x|), scaled to -1..1."""
    wide = np.asarray(values, dtype=np.float64)
    scaled = np.sign(wide) * np.log1p(np.abs(wide)) / math.log1p(UNBOUNDED)
    return np.clip(scaled, -1.0, 1.0).astype(np.float32)


class SquashedObservation(gym.ObservationWrapper[Vector, object, dict[str, NDArray[np.generic]]]):
    """Squashes the numbers of a flat observation: metres, ids and shares get similar magnitudes."""

    def __init__(self, env: AnyEnv) -> None:
        super().__init__(env)
        space = env.observation_space
        if not isinstance(space, spaces.Dict) or "observation" not in space.spaces:
            raise SettingsError(f"the observations are of {space}; wrap the environment in `FlattenObservation` first")
        shape = space["observation"].shape
        self.observation_space = spaces.Box(-1.0, 1.0, shape, dtype=np.float32)

    def observation(self, observation: dict[str, NDArray[np.generic]]) -> Vector:
        """Returns the squashed vector."""
        return squashed(observation["observation"])

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns the mask of the wrapped environment, see `FlattenAction`."""
        masks: NDArray[np.bool_] = self.env.get_wrapper_attr("action_masks")()
        return masks


def masks_of(env: AnyEnv) -> NDArray[np.bool_] | None:
    """Returns the action mask of an environment; None if it has none."""
    if not env.has_wrapper_attr("action_masks"):
        return None
    masks: NDArray[np.bool_] = env.get_wrapper_attr("action_masks")()
    return masks


class EnvFactory:
    """Picklable factory of an environment."""

    def __init__(self, name: str, settings: Arguments) -> None:
        self._name, self._settings = name, dict(settings)

    def __call__(self) -> AnyEnv:
        """Returns a new environment."""
        return make_env(self._name, self._settings)


class RepeatableEpisodes(gym.Wrapper[Vector, Any, Vector, Any]):
    """Records the start of the current episode and its actions, with which another process can repeat it.

    The start is the seed of the reset; for a reset without a seed, the state of the environment's random generator
    before it. That is exact if the environment depends on its seed and the actions only, as Gymnasium demands.
    """

    def __init__(self, env: AnyEnv) -> None:
        super().__init__(env)
        self._start: Page = {}
        self._actions: list[NDArray[np.generic]] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[Vector, dict[str, object]]:
        """Begins an episode."""
        self._start = {"seed": seed} if seed is not None else {**self.unwrapped.np_random.bit_generator.state}
        self._actions = []
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[Vector, SupportsFloat, bool, bool, dict[str, object]]:
        """Plays one step."""
        self._actions.append(np.array(action))  # a copy: the caller may use the array again
        return self.env.step(action)

    def recorded_episode(self) -> tuple[Page, NDArray[np.generic]]:
        """Returns the start of the current episode in JSON types, and its actions (n, ...)."""
        return self._start, np.array(self._actions)

    def repeat_episode(self, start: Page, actions: NDArray[np.generic]) -> Vector:
        """Plays a recorded episode, and returns its last observation; raises `ValueError` for another action."""
        if not all(self.action_space.contains(action) for action in actions):
            raise ValueError("a recorded action is none of the environment")
        if "seed" in start:
            observation, _ = self.reset(seed=start["seed"])
        else:
            self.unwrapped.np_random.bit_generator.state = start
            observation, _ = self.reset()
        for action in actions:
            observation, *_ = self.step(action)
        return observation


class RepeatableEnvFactory(EnvFactory):
    """Picklable factory of an environment whose episodes can be repeated."""

    def __call__(self) -> RepeatableEpisodes:
        """Returns a new environment."""
        return RepeatableEpisodes(super().__call__())


def has_batch(name: str) -> bool:
    """Returns whether all environments of an id can be stepped as one batch, see `gymnasium.make_vec`."""
    return name in gym.registry and gym.registry[name].vector_entry_point is not None and name in ENVIRONMENTS_OF_MODELS


def make_batch(name: str, settings: Arguments, environments: int, mode: AutoresetMode) -> VectorEnv[Any, Any, Any]:
    """Makes environments of an id with a batch; raises `SettingsError` if it does not accept the arguments."""
    try:
        return gym.make_vec(name, num_envs=environments, autoreset_mode=mode, **settings)
    except (TypeError, ValueError) as error:
        raise SettingsError(f"env {name}: {error}") from error


def make_training_env(settings: TrainingSettings, ray: str | None = None) -> VecMonitor:
    """Returns the vector environment of a training with stable-baselines3.

    Without worker processes the environments are one batch if their id has one; else see `make_vector_env`.

    Raises:
        SettingsError: the environment does not accept its arguments, or there are several towns but no batch.
    """
    make = RepeatableEnvFactory(settings.env, settings.env_settings)
    make().close()  # reports invalid settings in this process
    vector: VecEnv
    if has_batch(settings.env) and not settings.workers and ray is None:
        batch = make_batch(settings.env, settings.env_settings, settings.environments, AutoresetMode.SAME_STEP)
        vector = RepeatableVecEnv(batch)
    else:
        if len(each_town(settings.env_settings)) > 1:
            raise SettingsError(f"{TOWN}: only the navigation environments without workers play several towns at once")
        vector = make_vector_env(make, settings.environments, settings.workers, ray)
    monitor = _Monitor(vector)
    monitor.seed(settings.seed)
    return monitor


class _Monitor(VecMonitor):
    """Monitor that sets the same seeds for batches, processes and single environments, see `unrelated_seeds`."""

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Sets the seeds of the next reset; the algorithms call it with the seed of the run."""
        seeds = unrelated_seeds(seed, self.num_envs)
        self.unwrapped._seeds = seeds
        return seeds
