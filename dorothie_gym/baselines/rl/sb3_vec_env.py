"""Gymnasium's vector environments for the algorithms of stable-baselines3 and sb3-contrib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

TRUNCATED, FINAL_OBSERVATION = "TimeLimit.truncated", "terminal_observation"
"""Keys of infos by which stable-baselines3 finds out how an episode ended, and its last observation."""


def sb3_vec_env(env: VectorEnv[Any, Any, Any]) -> VecEnv:
    """Returns a vector environment as a `VecEnv`, which steps all of its environments in one call.

    An info is empty except at the end of an episode, where it contains the last observation, whether the episode was
    truncated by the time limit, and the environment's information on the end, such as `is_success`. `env_method` and
    `get_attr` access the methods and attributes of the vector environment, such as `action_masks` for `MaskablePPO`.

    Args:
        env: vector environment in the autoreset mode `SAME_STEP`, such as
            `gymnasium.make_vec("dorothie_gym/Navigation-v0", num_envs=64, autoreset_mode="SameStep")`.

    Raises:
        ValueError: the environment has another autoreset mode.
    """
    return NativeVecEnv(env)


class NativeVecEnv(VecEnv):
    """See `sb3_vec_env`.

    Attributes:
        env: the vector environment.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise ValueError(
                f"the autoreset mode is {mode}; stable-baselines3 resets in the same step: "
                'make the environment with autoreset_mode="SameStep"'
            )
        self.env = env
        self._actions: NDArray[Any] = np.zeros(0)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    @property
    def render_mode(self) -> str | None:
        """Render mode of the environments."""
        return self.env.render_mode

    @render_mode.setter
    def render_mode(self, mode: str | None) -> None:
        """Ignores the render mode that the base class sets, which belongs to the environments."""

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Sets the seeds of the next reset; neighbouring seeds give unrelated ones.

        stable-baselines3 gives environment k the seed `seed + k`, so that two runs share most of their episodes.
        """
        self._seeds = unrelated_seeds(seed, self.num_envs)
        return self._seeds

    def reset(self) -> VecEnvObs:
        """Resets all environments with the seeds and options that were set."""
        options = next((dict(each) for each in self._options if each), None)
        seeds: Any = list(self._seeds)  # one for each environment, which gymnasium's annotation leaves out
        observations, infos = self.env.reset(seed=seeds, options=options)
        self.reset_infos = [_of_one(infos, number) for number in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return np.asarray(observations)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Records the actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Steps all environments by one decision."""
        observations, rewards, terminated, truncated, all_infos = self.env.step(self._actions)
        over = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for number in np.flatnonzero(over).tolist():
            infos[number] = {
                **_of_one(all_infos["final_info"], number),
                FINAL_OBSERVATION: all_infos["final_obs"][number],
                TRUNCATED: bool(truncated[number] and not terminated[number]),
            }
        return observations, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        """Closes the environments."""
        self.env.close()

    def has_attr(self, attr_name: str) -> bool:
        """Returns whether the vector environment has an attribute."""
        return hasattr(self.env, attr_name)

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Returns an attribute of the vector environment for each of the given environments."""
        return [getattr(self.env, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Sets an attribute of the vector environment, which all environments share.

        Raises:
            ValueError: it would be set in a part of the environments only.
        """
        if indices is not None and len(list(self._get_indices(indices))) != self.num_envs:
            raise ValueError(f"{attr_name} is one attribute of all {self.num_envs} environments; set it for all")
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Calls a method of the vector environment once, and returns the results of the given environments.

        The method has to return one result for each environment, as `action_masks` does.
        """
        results = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [results[number] for number in self._get_indices(indices)]

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Returns that no environment has a wrapper of its own."""
        return [False] * len(list(self._get_indices(indices)))

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Returns the pictures that the vector environment draws."""
        frames = self.env.render()
        drawn = [np.asarray(frame) for frame in frames] if isinstance(frames, tuple) else []
        return [*drawn, *[None] * (self.num_envs - len(drawn))]


def unrelated_seeds(seed: int | None, count: int) -> list[int | None]:
    """Returns the seeds of the given environments of a run; runs with neighbouring seeds get different ones."""
    return [int(number) for number in np.random.SeedSequence(seed).generate_state(count)]


def _of_one(infos: Mapping[str, Any], number: int) -> dict[str, Any]:
    """Returns the info of one environment."""
    found: dict[str, Any] = {}
    for name, value in infos.items():
        has = infos.get(f"_{name}")
        if has is not None and has[number]:
            found[name] = _of_one(value, number) if isinstance(value, Mapping) else _plain(value[number])
    return found


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
