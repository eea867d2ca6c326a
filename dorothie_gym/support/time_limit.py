"""Base class of the environments that limit the time of their episodes themselves."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import replace
from itertools import accumulate, repeat
from typing import TypeVar

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec

ObsType = TypeVar("ObsType")
ActType = TypeVar("ActType")


class TimeLimited(ABC):
    """Part of an environment; its `spec.max_episode_steps` is the number of decisions until it truncates an episode.

    The number follows from the arguments. The ids are registered without one, because `gymnasium.make` would then
    add a `TimeLimit` of the default arguments and truncate longer episodes.
    """

    _spec: EnvSpec | None = None

    @property
    @abstractmethod
    def decision_limit(self) -> int:
        """Decisions until truncation."""

    @property
    def spec(self) -> EnvSpec | None:
        """Specification of the environment; None if it was not made by `gymnasium.make`."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None and spec.max_episode_steps is None:
            spec = replace(spec, max_episode_steps=self.decision_limit)
        self._spec = spec


class TimeLimitedEnv(TimeLimited, gym.Env[ObsType, ActType]):
    """Environment with a limit of its own, see `TimeLimited`."""


def steps_until(seconds: float, step: float) -> int:
    """Returns the number of steps of equal length [s] after which a clock reaches a time [s]."""
    return next(number for number, time in enumerate(accumulate(repeat(step)), start=1) if time >= seconds)


def decisions_in(seconds: float, decision_frequency: float) -> int:
    """Returns the number of decisions in a time [s] at a frequency [Hz]."""
    return math.ceil(seconds * decision_frequency - 1e-9)
