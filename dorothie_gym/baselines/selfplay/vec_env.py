"""Sessions of self-play as a `VecEnv` of stable-baselines3."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvObs, VecEnvStepReturn

from dorothie_gym.baselines.rl.settings import Arguments
from dorothie_gym.baselines.selfplay.env import SelfPlayEnv, SelfPlaySessions
from dorothie_gym.ontology.roles import Role


class SelfPlayVecEnv(VecEnv):
    """`SelfPlaySessions` as `DummyVecEnv` steps as many `SelfPlayEnv`.

    Attributes:
        sessions: the sessions.
        envs: what the roles of each session keep; attributes of environments are theirs.
    """

    def __init__(self, sessions: SelfPlaySessions) -> None:
        self.sessions, self.envs = sessions, sessions.players
        self._actions: NDArray[np.int64] = np.zeros((len(self.envs), 0), dtype=np.int64)
        self.reset_infos: list[dict[str, Any]] = [{} for _ in self.envs]
        super().__init__(len(self.envs), sessions.layout.observation_space, sessions.layout.action_space)

    def reset(self) -> VecEnvObs:
        """Begins all sessions with the seeds that were set."""
        self.sessions.begin(dict(enumerate(self._seeds)))
        self.reset_infos = [{} for _ in self.envs]
        self._reset_seeds()
        self._reset_options()
        return self.sessions.rows.copy()

    def step_async(self, actions: np.ndarray) -> None:
        """Keeps the actions."""
        self._actions = np.asarray(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Plays a decision; sessions that are over begin anew."""
        rewards, terminated, truncated, successes = self.sessions.step(self._actions)
        infos: list[dict[str, Any]] = [{"rewards": own} for own in rewards.astype(np.float32)]
        for number, info in enumerate(infos):
            info["TimeLimit.truncated"] = bool(truncated[number] and not terminated[number])
        over = terminated | truncated
        for number in np.flatnonzero(over).tolist():
            infos[number]["is_success"] = bool(successes[number])
            infos[number]["terminal_observation"] = self.sessions.rows[number].copy()
        if over.any():
            self.sessions.begin(dict.fromkeys(np.flatnonzero(over).tolist()))
        return self.sessions.rows.copy(), rewards[:, 0].astype(np.float32), over, infos

    def close(self) -> None:
        """Closes the environments inside."""
        self.sessions.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Returns an attribute of some environments."""
        return [getattr(self.envs[k], attr_name) for k in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: object, indices: VecEnvIndices = None) -> None:
        """Sets an attribute of some environments."""
        for k in self._get_indices(indices):
            setattr(self.envs[k], attr_name, value)

    def env_method(
        self, method_name: str, *method_args: object, indices: VecEnvIndices = None, **method_kwargs: object
    ) -> list[Any]:
        """Calls a method of some environments, and returns the results."""
        return [getattr(self.envs[k], method_name)(*method_args, **method_kwargs) for k in self._get_indices(indices)]

    def has_attr(self, attr_name: str) -> bool:
        """Returns whether the environments have an attribute."""
        return all(hasattr(env, attr_name) for env in self.envs)

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper], indices: VecEnvIndices = None) -> list[bool]:
        """Returns False for each environment: they have no wrappers."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[None]:
        """Returns no images."""
        return [None] * self.num_envs


class SelfPlayEnvFactory:
    """Picklable factory of environments for self-play."""

    def __init__(self, settings: Arguments, scripted: Collection[Role] = (), threads: int | None = None) -> None:
        """Keeps the arguments.

        Args:
            settings: arguments of `SelfPlayEnv`.
            scripted: roles that the built-in policies play.
            threads: number of threads of a batch; None for one per processor.
        """
        self._settings, self._scripted, self._threads = dict(settings), tuple(scripted), threads

    def __call__(self) -> SelfPlayEnv:
        """Returns a new environment."""
        return SelfPlayEnv(**self._settings, scripted=self._scripted)

    def batch(self, count: int) -> SelfPlayVecEnv:
        """Returns new environments in one batch."""
        sessions = SelfPlaySessions(count, **self._settings, scripted=self._scripted, threads=self._threads)
        return SelfPlayVecEnv(sessions)
