"""Settings of reinforcement learning; tuned defaults are in data files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib import resources
from typing import Any

import yaml

from dorothie_gym.errors import SettingsError

ALGORITHMS: Mapping[str, tuple[str, str]] = {
    "ppo": ("stable_baselines3", "PPO"),
    "maskable_ppo": ("sb3_contrib", "MaskablePPO"),
    "a2c": ("stable_baselines3", "A2C"),
    "dqn": ("stable_baselines3", "DQN"),
    "sac": ("stable_baselines3", "SAC"),
}
"""Algorithms by name: the package and the class."""

CLONING = ("ppo", "maskable_ppo", "a2c")
"""Algorithms that support a warm start by behaviour cloning."""

NAVIGATION = "dorothie_gym/Navigation-v0"
"""Id of the environment whose policies can play the Co-Wizard."""

DEFAULT = "default"
"""Entry of a data file for environments without an own one."""

FINAL_RATE = "final_learning_rate"
"""Additional parameter: the learning rate falls linearly from `learning_rate` to this."""


@dataclass(frozen=True, kw_only=True)
class TrainingSettings:
    """Settings of a training run.

    Attributes:
        algorithm: one of `ALGORITHMS`.
        env: id of the environment.
        env_settings: arguments of the environment.
        steps: of all environments together.
        environments: number of parallel environments.
        workers: processes that step them; 0 steps them in the process that learns.
        seed: of networks, environments and exploration.
        evaluate_every: steps between evaluations.
        episodes: of an evaluation.
        network: widths of the hidden layers.
        parameters: of the algorithm, as stable-baselines3 names them; see `FINAL_RATE`.
        warm_start: folder of a corpus whose Co-Wizards are cloned first; None for none.
    """

    algorithm: str
    env: str
    env_settings: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 600_000
    environments: int = 8
    workers: int = 0
    seed: int = 0
    evaluate_every: int = 50_000
    episodes: int = 50
    network: tuple[int, ...] = (64, 64)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    warm_start: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "network", tuple(self.network))
        if self.algorithm not in ALGORITHMS:
            raise SettingsError(f"algorithm is {self.algorithm!r}; it must be one of {', '.join(ALGORITHMS)}")
        for name in ("steps", "environments", "evaluate_every", "episodes"):
            if not isinstance(getattr(self, name), int) or getattr(self, name) < 1:
                raise SettingsError(f"{name} is {getattr(self, name)!r}; it must be a whole number of at least 1")
        if not 0 <= self.workers <= self.environments:
            raise SettingsError(f"workers is {self.workers}; it must be in 0..{self.environments}, the environments")
        if self.warm_start is not None and (self.algorithm not in CLONING or self.env != NAVIGATION):
            raise SettingsError(
                f"warm_start: {self.algorithm} on {self.env} cannot learn from a corpus; {', '.join(CLONING)} "
                f"on {NAVIGATION} can"
            )
        if not 0 <= self.seed < 2**31:
            raise SettingsError(f"seed is {self.seed}; it must be in 0..{2**31 - 1}")

    @property
    def masked(self) -> bool:
        """Whether the algorithm respects the action mask."""
        return self.algorithm == "maskable_ppo"

    def as_json(self) -> dict[str, Any]:
        """The settings in JSON types; `TrainingSettings(**...)` reads them back."""
        return {**asdict(self), "network": list(self.network)}


def tuned_settings(algorithm: str, env: str, **changes: Any) -> TrainingSettings:
    """Returns the tuned settings of an algorithm and an environment, with changes.

    Args:
        algorithm: one of `ALGORITHMS`.
        env: id of the environment; the file's default is taken where there is nothing for it.
        changes: fields of `TrainingSettings`; None leaves a field as it is.

    Raises:
        SettingsError: there is no such algorithm, or a field is out of its range.
    """
    if algorithm not in ALGORITHMS:
        raise SettingsError(f"algorithm is {algorithm!r}; it must be one of {', '.join(ALGORITHMS)}")
    text = resources.files(__package__).joinpath("data", f"{algorithm}.yaml").read_text(encoding="utf-8")
    entries = yaml.safe_load(text)
    tuned = TrainingSettings(algorithm=algorithm, env=env, **entries.get(env, entries[DEFAULT]))
    return replace(tuned, **{name: value for name, value in changes.items() if value is not None})
