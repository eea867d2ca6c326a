"""Environments as learners take them: one vector in, discrete or continuous numbers out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import dorothie_gym
from dorothie_gym.baselines.rl.settings import TrainingSettings
from dorothie_gym.errors import SettingsError
from dorothie_gym.spaces.limits import UNBOUNDED

if TYPE_CHECKING:
    from dorothie_gym.baselines.rl.vector_env import MakeEnv

_PLAIN = (spaces.Discrete, spaces.MultiDiscrete, spaces.Box)


def make_env(name: str, settings: Mapping[str, Any] | None = None) -> gym.Env[Any, Any]:
    """Makes an environment whose observations are vectors.

    Environments with richer spaces are flattened (`dorothie_gym.flatten`), and their quantities squashed.

    Args:
        name: id of the environment.
        settings: its arguments.

    Raises:
        SettingsError: there is no such environment, or it does not take these arguments.
    """
    try:
        env: gym.Env[Any, Any] = gym.make(name, disable_env_checker=True, **(settings or {}))
    except (gym.error.Error, TypeError, ValueError) as error:
        raise SettingsError(f"env {name}: {error}") from error
    observed, acted = env.observation_space, env.action_space
    if isinstance(observed, spaces.Box) and len(observed.shape) == 1 and isinstance(acted, _PLAIN):
        return env
    return Squashed(dorothie_gym.flatten(env))


class Squashed(gym.ObservationWrapper[NDArray[np.float32], Any, Any]):
    """Keeps `observation` of a flat observation, each number x as sign(x) log(1 + |x|), scaled to -1..1.

    It takes metres, ids and shares alike without having to know them or to gather statistics.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        assert isinstance(env.observation_space, spaces.Dict)
        shape = env.observation_space["observation"].shape
        self.observation_space = spaces.Box(-1.0, 1.0, shape, dtype=np.float32)

    def observation(self, observation: Any) -> NDArray[np.float32]:
        """Returns the squashed vector."""
        values = np.asarray(observation["observation"], dtype=np.float64)
        squashed = np.sign(values) * np.log1p(np.abs(values)) / math.log1p(UNBOUNDED)
        return np.clip(squashed, -1.0, 1.0).astype(np.float32)

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns the mask of the wrapped environment, see `FlattenAction`."""
        masks: NDArray[np.bool_] = self.env.get_wrapper_attr("action_masks")()
        return masks


def masks_of(env: gym.Env[Any, Any]) -> NDArray[np.bool_] | None:
    """Returns the action mask of an environment; None if it has none."""
    if not env.has_wrapper_attr("action_masks"):
        return None
    masks: NDArray[np.bool_] = env.get_wrapper_attr("action_masks")()
    return masks


def make_vector(settings: TrainingSettings, ray: str | None = None) -> Any:
    """Returns stable-baselines3's vector environment for a run; see `shared_out`."""
    from stable_baselines3.common.vec_env import VecMonitor

    maker = EnvFactory(settings.env, settings.env_settings)
    maker().close()  # says in this process what is wrong with the settings
    vector = shared_out(maker, settings.environments, settings.workers, ray)
    vector.seed(settings.seed * 10_000)
    return VecMonitor(vector)


def shared_out(make: MakeEnv, environments: int, workers: int, ray: str | None = None) -> Any:
    """Returns environments as one vector.

    Args:
        make: makes an environment.
        environments: how many.
        workers: processes that step them; 0: this one, or as many as a cluster has processors.
        ray: address of a Ray cluster whose machines step them; None: this one does.

    Raises:
        ProcessError: Ray is not installed, or there is no cluster at the address.
    """
    from stable_baselines3.common.vec_env import DummyVecEnv

    from dorothie_gym.baselines.rl.ray_vector_env import RayVecEnv
    from dorothie_gym.baselines.rl.vector_env import WorkerVecEnv

    if ray is not None:
        return RayVecEnv(make, environments, workers, ray)
    return WorkerVecEnv(make, environments, workers) if workers else DummyVecEnv([make] * environments)


class EnvFactory:
    """Picklable factory of an environment."""

    def __init__(self, name: str, settings: Mapping[str, Any]) -> None:
        self._name, self._settings = name, dict(settings)

    def __call__(self) -> gym.Env[Any, Any]:
        """Returns a new environment."""
        return make_env(self._name, self._settings)
