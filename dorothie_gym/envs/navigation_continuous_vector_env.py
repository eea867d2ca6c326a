"""Vectorised `Navigation-continuous-v0`, the result of `gymnasium.make_vec`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from dorothie_gym.action_values import real_numbers
from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.envs.driving_vector_env import DrivingVectorEnv, Towns
from dorothie_gym.envs.navigation_config import NavigationWeights
from dorothie_gym.envs.navigation_continuous_v0 import CONTINUOUS_FIELDS, CONTROL_SPECS, NavigationContinuousEnv
from dorothie_gym.maps import Town
from dorothie_gym.policies.navigation.observation_vector import Vector
from dorothie_gym.tasks import StoryboardTemplate


class NavigationContinuousVectorEnv(DrivingVectorEnv):
    """Vectorised `NavigationContinuousEnv`: observations, rewards and infos are those of single environments.

    ## Observation Space
    `Box(-1, 1, (num_envs, n), float32)`, see `NavigationContinuousEnv`.

    ## Action Space
    `Box(-1, 1, (num_envs, 3), float32)`: throttle, steer and brake of each environment.

    ## Episode End
    As `NavigationContinuousEnv`, with the autoreset modes of `NavigationVectorEnv`.

    ## Arguments
    `num_envs`, `town`, `autoreset_mode` and `render_mode` as in `NavigationVectorEnv`, the others as in
    `NavigationContinuousEnv`.

    ## Version History
    - v0: first version.
    """

    def __init__(
        self,
        num_envs: int = 1,
        town: Towns = "brookside",
        storyboard: str | Path | StoryboardTemplate | None = None,
        *,
        traffic: str = "light",
        exceptions: float = 0.0,
        reward: str | NavigationWeights = "dense",
        max_seconds: float = 600.0,
        patience: float = 60.0,
        decision_frequency: float = 10.0,
        render_mode: str | None = None,
        view: str = "role",
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    ) -> None:
        def make(town: Town) -> NavigationContinuousEnv:
            return NavigationContinuousEnv(
                town, storyboard, traffic=traffic, exceptions=exceptions, reward=reward, max_seconds=max_seconds,
                patience=patience, decision_frequency=decision_frequency, render_mode=render_mode, view=view,
            )  # fmt: skip

        action_space: spaces.Space[NDArray[np.float32]] = spaces.Box(-1.0, 1.0, (len(CONTROL_SPECS),), dtype=np.float32)
        observation_space: spaces.Space[Vector] = spaces.Box(
            -1.0, 1.0, (sum(CONTINUOUS_FIELDS.values()),), dtype=np.float32
        )
        super().__init__(
            num_envs, town, observation_space, action_space, decision_frequency, render_mode, autoreset_mode
        )  # fmt: skip
        self._envs = [make(each) for each in self.towns]

    def render_one(self, number: int) -> NDArray[np.uint8] | None:
        """Draws one of the environments (800, 1280, 3), as the single environment does."""
        return self._envs[range(self.num_envs)[number]].render()

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
        """Returns the kind of environment, the towns and the settings."""
        return {**super().compatibility(), "the settings": self._envs[0].config}

    def close_extras(self, **_kwargs: object) -> None:
        """Closes the environments."""
        for env in self._envs:
            env.close()

    # --- Episodes -----------------------------------------------------------------------------------------------------

    def _checked(self, actions: object) -> NDArray[np.float64]:
        shape = self.num_envs, len(CONTROL_SPECS)
        return real_numbers("actions", actions, shape, f"finite numbers {shape}: throttle, steer, brake of each")

    def _start(self, seeds: Mapping[int, int], scenario: Scenario | None) -> None:
        for number, seed in seeds.items():
            self._observations[number], _ = self._envs[number].reset(seed=seed, options={"scenario": scenario})
            self._note(number)

    def _play(self, actions: NDArray[np.generic], playing: NDArray[np.bool_]) -> None:
        for number in np.flatnonzero(playing).tolist():
            outcome = self._envs[number].step(actions[number])
            self._observations[number], self._rewards[number] = outcome[:2]
            self._terminations[number], self._truncations[number] = outcome[2:4]
            self._note(number)

    def _note(self, number: int) -> None:
        info = self._envs[number].drive.info()
        self._terms[number] = list(info["reward_terms"].values())
        self._infractions[number] = list(info["infractions"].values())
        self._refused[number] = info["refused"]
        if "reason" in info:
            self._success[number], self._reasons[number] = info["is_success"], info["reason"]
            self._subgoals[number] = info["subgoals"]["live"], info["subgoals"]["reached"]
