"""Vectorised navigation environments, the results of `gymnasium.make_vec`."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from dorothie_gym.copying import Restorable
from dorothie_gym.envs.driving_session import DrivingEnv
from dorothie_gym.envs.episode import TERMS
from dorothie_gym.errors import short_repr
from dorothie_gym.maps import Town
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.sim.infractions import INFRACTION_KINDS
from dorothie_gym.vector_infos import Infos, mask_of, masked_infos, seeds_of

Env = TypeVar("Env", bound=DrivingEnv[Any])

Towns: TypeAlias = "str | Path | Town | Sequence[str | Path | Town]"
"""A town, or several that the environments of a batch play in turn."""

INFRACTIONS: Final = tuple(kind.value for kind in INFRACTION_KINDS)
"""Names of the infractions that infos count."""


class DrivingVectorEnv(Restorable, VectorEnv[Vector, NDArray[np.generic], NDArray[np.generic]], Generic[Env]):
    """Base class of the vectorised navigation environments.

    Each environment has episodes of its own: they depend on its seed and actions, and neither on the other
    environments, nor on its place among them.

    Attributes:
        autoreset_mode: when environments that are over begin anew, as `SyncVectorEnv` has it.
    """

    metadata: dict[str, object] = {"render_modes": ["rgb_array"], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    CHANGES: ClassVar[Sequence[str]] = (
        "_observations", "_rewards", "_terminations", "_truncations", "_terms", "_infractions", "_refused", "_subgoals",
        "_success", "_reasons", "_begun"
    )  # fmt: skip

    def __init__(
        self, make: Callable[[str | Path | Town], Env], num_envs: int, town: Towns,
        render_mode: str | None, autoreset_mode: str | AutoresetMode,
    ) -> None:  # fmt: skip
        if num_envs < 1:
            raise ValueError(f"num_envs is {num_envs}; it must be at least 1")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode is {render_mode!r}; it must be None or 'rgb_array' for several environments")
        towns = [town] if isinstance(town, str | Path | Town) else list(town)
        if not towns:
            raise ValueError("town is an empty sequence; it must name at least one town")
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self._envs = [make(towns[i % len(towns)]) for i in range(num_envs)]
        self.single_observation_space = self._envs[0].observation_space
        self.single_action_space = self._envs[0].action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.metadata["render_fps"] = self._envs[0].metadata["render_fps"]
        assert self.observation_space.shape is not None
        self._observations: Vector = np.zeros(self.observation_space.shape, dtype=np.float32)
        self._rewards = np.zeros(num_envs)
        self._terminations, self._truncations = (np.zeros(num_envs, dtype=np.bool_) for _ in range(2))
        self._terms = np.zeros((num_envs, len(TERMS)))
        self._infractions = np.zeros((num_envs, len(INFRACTIONS)), dtype=np.int64)
        self._subgoals = np.zeros((num_envs, 2), dtype=np.int64)
        self._success = np.zeros(num_envs, dtype=np.bool_)
        self._refused, self._reasons = np.full(num_envs, None), np.full(num_envs, None)
        self._begun = np.zeros(num_envs, dtype=np.bool_)

    # --- Gymnasium's interface ----------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, object] | None = None
    ) -> tuple[Vector, Infos]:
        """Begins new episodes.

        Args:
            seed: of the first environment; the others have the numbers that follow. Or one for each.
            options: `reset_mask`, a bool array (num_envs,): which environments, by default all; the others as in the
                single environment.

        Returns:
            Observations (num_envs, n) of all environments, and infos of those that begin.

        Raises:
            ValueError: not one seed for each environment, or a mask of the wrong shape or type.
        """
        options = dict(options or {})
        mask = mask_of(options.pop("reset_mask", None), self.num_envs)
        for i, each in enumerate(seeds_of(seed, self.num_envs)):
            if mask[i]:
                self._begin(i, each, options)
        return self._observations.copy(), self._infos(mask)

    def step(
        self, actions: NDArray[np.generic]
    ) -> tuple[Vector, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Infos]:
        """Plays a decision in every environment; those that are over begin anew, as the autoreset mode says.

        Args:
            actions: (num_envs, ...) one for each.

        Returns:
            Observations (num_envs, n), rewards, terminations and truncations (num_envs,), infos.

        Raises:
            ValueError: the actions are none of the action space.
            gymnasium.error.ResetNeeded: an environment was never reset, or is over and not reset by itself.
        """
        actions = self._checked(actions)
        over = self._terminations | self._truncations
        mode = self.autoreset_mode
        if not self._begun.all() or (mode is AutoresetMode.DISABLED and over.any()):
            waiting = np.flatnonzero(~self._begun | over)
            raise gym.error.ResetNeeded(f"environments {short_repr(waiting.tolist())} wait for a reset: call reset()")
        for i in range(self.num_envs):
            if over[i]:
                self._begin(i, None, {})
            else:
                self._play(i, actions[i])
        rewards, terminations, truncations = self._rewards.copy(), self._terminations.copy(), self._truncations.copy()
        everywhere = np.ones(self.num_envs, dtype=np.bool_)
        over = terminations | truncations
        if mode is AutoresetMode.SAME_STEP and over.any():
            infos = self._begin_at_once(over)
        else:
            infos = self._infos(everywhere)
        return self._observations.copy(), rewards, terminations, truncations, infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Draws the first environment; `render_one` draws another one."""
        frame = self.render_one(0)
        return None if frame is None else (frame,)

    def render_one(self, number: int) -> NDArray[np.uint8] | None:
        """Draws one of the environments (800, 1280, 3), as the single environment does."""
        return self._envs[range(self.num_envs)[number]].render()

    def close_extras(self, **_kwargs: object) -> None:
        """Closes the environments."""
        for env in self._envs:
            env.close()

    # of many environments instead of one, and read-only
    @property  # type: ignore[misc]  # gymnasium's is writable
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]  # see above
        """The environments' generators."""
        return tuple(env.np_random for env in self._envs)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]  # see `np_random`
        """The environments' seeds."""
        return tuple(env.np_random_seed for env in self._envs)

    # --- states -------------------------------------------------------------------------------------------------------

    def mutable_values(self) -> dict[str, object]:
        """Returns what changes in the environments."""
        return {**super().mutable_values(), "envs": [env.mutable_values() for env in self._envs]}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values of the environments."""
        parts = values.pop("envs")
        assert isinstance(parts, list)  # of `mutable_values`
        for env, part in zip(self._envs, parts, strict=True):
            env.apply_values(part)
        super().apply_values(values)

    def compatibility(self) -> dict[str, object]:
        """Returns the kind of environment, their towns and their settings."""
        towns, configs = [env.town for env in self._envs], self._envs[0].config
        return {**super().compatibility(), "the towns": towns, "the settings": configs}

    # --- episodes -----------------------------------------------------------------------------------------------------

    @abstractmethod
    def _checked(self, actions: object) -> NDArray[np.generic]:
        """Returns actions as an array; raises `ValueError` if they are none of the action space."""

    def _begin(self, i: int, seed: int | None, options: dict[str, object]) -> None:
        self._observations[i], _ = self._envs[i].reset(seed=seed, options=options)
        self._rewards[i], self._terminations[i], self._truncations[i], self._begun[i] = 0.0, False, False, True
        self._note(i)

    def _play(self, i: int, action: object) -> None:
        env = self._envs[i]
        self._observations[i], self._rewards[i], self._terminations[i], self._truncations[i], _ = env.step(action)
        self._note(i)

    def _note(self, i: int) -> None:
        info = self._envs[i].drive.info()
        self._terms[i] = list(info["reward_terms"].values())
        self._infractions[i] = list(info["infractions"].values())
        self._refused[i] = info["refused"]
        if "reason" in info:
            self._success[i], self._reasons[i] = info["is_success"], info["reason"]
            self._subgoals[i] = info["subgoals"]["live"], info["subgoals"]["reached"]

    def _begin_at_once(self, over: NDArray[np.bool_]) -> Infos:
        """Resets environments that are over; returns the infos of the mode `SAME_STEP`."""
        final = np.full(self.num_envs, None, dtype=object)
        ended = self._infos(over)
        for i in np.flatnonzero(over).tolist():
            final[i] = self._observations[i].copy()
            self._begin(i, None, {})
        infos = self._infos(np.ones(self.num_envs, dtype=np.bool_))
        return {**infos, "final_obs": final, "_final_obs": over, "final_info": ended, "_final_info": over.copy()}

    def _infos(self, mask: NDArray[np.bool_]) -> Infos:
        """Returns the infos of the environments of a mask."""
        terms = {name: self._terms[:, k] for k, name in enumerate(TERMS)}
        infractions = {name: self._infractions[:, k] for k, name in enumerate(INFRACTIONS)}
        infos = masked_infos(
            {
                "reward_terms": masked_infos(terms, mask),
                "refused": self._refused,
                "infractions": masked_infos(infractions, mask),
            },
            mask,
        )
        ended = mask & (self._terminations | self._truncations)
        subgoals = masked_infos({"live": self._subgoals[:, 0], "reached": self._subgoals[:, 1]}, ended)
        return {
            **infos,
            **masked_infos({"is_success": self._success, "reason": self._reasons, "subgoals": subgoals}, ended),
        }
