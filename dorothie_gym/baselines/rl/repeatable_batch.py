"""Vector environments of trainings whose episodes in progress another process can repeat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from dorothie_gym.baselines.rl.sb3_vec_env import NativeVecEnv
from dorothie_gym.baselines.rl.settings import Page

Episode: TypeAlias = tuple[Page, NDArray[Any]]
"""Beginning of an episode in JSON types, and its actions so far (n, ...)."""


class RepeatableVecEnv(NativeVecEnv):
    """Batch that records the start and actions of each current episode; see `RepeatableEpisodes` for one environment.

    The start is the seed of a reset; for a reset without a seed, the state of the environment's random generator
    before it, which is its state after the reset before.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self._starts: list[Page] = [{} for _ in range(self.num_envs)]
        self._taken: list[list[NDArray[Any]]] = [[] for _ in range(self.num_envs)]
        self._generators: Sequence[np.random.Generator] = ()
        self._states: list[Page] = []

    def reset(self) -> VecEnvObs:
        """Resets all environments with the seeds and options that were set."""
        before = self._states or [_state(generator) for generator in self._find_generators()]
        self._starts = [
            state if seed is None else {"seed": seed} for seed, state in zip(self._seeds, before, strict=True)
        ]
        self._taken = [[] for _ in range(self.num_envs)]
        observations = super().reset()
        self._note_generators()
        return observations

    def step_wait(self) -> VecEnvStepReturn:
        """Steps all environments by one decision."""
        actions = np.array(self._actions)  # a copy: the caller may use the array again
        observations, rewards, dones, infos = super().step_wait()
        for number in range(self.num_envs):
            self._taken[number].append(actions[number])
        for number in np.flatnonzero(dones).tolist():
            self._starts[number], self._taken[number] = self._states[number], []
            self._states[number] = _state(self._generators[number])
        return observations, rewards, dones, infos

    def recorded_episodes(self) -> list[Episode]:
        """Returns the current episodes of all environments."""
        kind = self.action_space
        return [
            (start, np.array(taken, dtype=kind.dtype).reshape(-1, *(kind.shape or ())))
            for start, taken in zip(self._starts, self._taken, strict=True)
        ]

    def repeat_episodes(self, episodes: Sequence[Episode]) -> NDArray[Any]:
        """Plays recorded episodes, one in each environment, and returns their last observations (num_envs, ...).

        All environments take their last action in the same step, so each episode begins with a matching delay.

        Raises:
            ValueError: there is not one episode for each environment, or one has an action that is none.
        """
        if len(episodes) != self.num_envs:
            raise ValueError(f"{len(episodes)} episodes were recorded in other than these {self.num_envs} environments")
        if not all(self.action_space.contains(action) for _, actions in episodes for action in actions):
            raise ValueError("a recorded action is none of the environment")
        lengths = np.array([len(actions) for _, actions in episodes])
        idle = np.zeros((self.num_envs, *(self.action_space.shape or ())), dtype=self.action_space.dtype)
        observations, _ = self.env.reset()
        for left in range(int(lengths.max()), -1, -1):
            if (lengths == left).any():
                observations = self._begin([start for start, _ in episodes], lengths == left)
            if left:
                chosen = idle.copy()
                for number in np.flatnonzero(lengths >= left).tolist():
                    chosen[number] = episodes[number][1][lengths[number] - left]
                observations, *_ = self.env.step(chosen)
        self._starts = [start for start, _ in episodes]
        self._taken = [list(actions) for _, actions in episodes]
        self._note_generators()
        return np.asarray(observations)

    def _begin(self, starts: Sequence[Page], mask: NDArray[np.bool_]) -> NDArray[Any]:
        seeds: Any = [None] * self.num_envs  # one for each environment, which gymnasium's annotation leaves out
        generators = self._find_generators()
        for number in np.flatnonzero(mask).tolist():
            if "seed" in starts[number]:
                seeds[number] = starts[number]["seed"]
            else:
                generators[number].bit_generator.state = starts[number]
        observations, _ = self.env.reset(seed=seeds, options={"reset_mask": mask})
        return np.asarray(observations)

    def _find_generators(self) -> Sequence[np.random.Generator]:
        generators: Any = self.env.np_random  # one for each environment, which gymnasium's annotation leaves out
        return tuple(generators)

    def _note_generators(self) -> None:
        self._generators = self._find_generators()
        self._states = [_state(generator) for generator in self._generators]

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """As in the base class; `recorded_episodes` and `repeat_episodes` are this object's own."""
        if method_name in ("recorded_episodes", "repeat_episodes"):
            found: list[Any] = list(getattr(self, method_name)(*method_args, **method_kwargs))
            return found
        return super().env_method(method_name, *method_args, indices=indices, **method_kwargs)


def _state(generator: np.random.Generator) -> Page:
    return dict(generator.bit_generator.state)
