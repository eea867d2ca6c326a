"""Settings of reinforcement learning; tuned defaults are in data files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib import resources
from typing import Any, Final, Self, TypeAlias

import yaml

from dorothie_gym.errors import SettingsError, did_you_mean, short_repr

Arguments: TypeAlias = Mapping[str, Any]
"""Keyword arguments of an environment or an algorithm, of any type; both check them."""

Page: TypeAlias = dict[str, Any]
"""Object of a JSON or YAML file by field; a reader checks the fields that it uses."""

ALGORITHMS: Mapping[str, tuple[str, str]] = {
    "ppo": ("stable_baselines3", "PPO"),
    "maskable_ppo": ("sb3_contrib", "MaskablePPO"),
    "a2c": ("stable_baselines3", "A2C"),
    "dqn": ("stable_baselines3", "DQN"),
    "sac": ("stable_baselines3", "SAC"),
}
"""Algorithms by name: the package and the class."""

ON_POLICY: Final = ("ppo", "maskable_ppo", "a2c")
"""Algorithms that learn from rollouts; they support a warm start by behaviour cloning."""

CAMERA: Final = "camera"
"""Observation of the navigation environments that consists of pictures; entry of a data file for these."""

NAVIGATION: Final = "dorothie_gym/Navigation-v0"
"""Id of the environment whose policies can play the Co-Wizard."""

DEFAULT: Final = "default"
"""Entry of a data file for environments without an entry of their own."""

FINAL_RATE: Final = "final_learning_rate"
"""Additional parameter: the learning rate falls linearly from `learning_rate` to this."""

FINAL_ENTROPY: Final = "final_ent_coef"
"""Additional parameter: the weight of the entropy falls linearly from `ent_coef` to this."""

MAX_ENVIRONMENTS: Final = 4096
"""Maximum number of parallel environments."""

SHORTEST_ROLLOUT: Final = 8
"""Minimum number of steps of each environment in a rollout."""

MAX_LAYERS, MAX_WIDTH = 16, 8192
"""Maximum number of hidden layers, and of numbers in a layer."""

MAX_CHANNELS: Final = 512
"""Maximum number of channels of a convolution."""

MAX_PARAMETER: Final = 1e8
"""Largest number among an algorithm's parameters, such as the size of a replay buffer."""

RESUMABLE: Final = ("steps", "evaluate_every", "episodes", "workers")
"""Settings that may change when a run is resumed."""


@dataclass(frozen=True, kw_only=True)
class TrainingSettings:
    """Settings of reinforcement learning.

    Attributes:
        steps: number of steps of all environments together.
        environments: number of parallel environments.
        workers: number of processes that step them; 0 steps them in the process that learns.
        seed: seed of networks, environments and exploration.
        evaluate_every: number of steps between evaluations.
        episodes: number of episodes of an evaluation.
        network: widths of the hidden layers.
        parameters: parameters of the algorithm, as stable-baselines3 names them; see `FINAL_RATE` and `FINAL_ENTROPY`.
        warm_start: folder of a corpus for behaviour cloning before the training; None for no warm start.
        algorithm: one of `ALGORITHMS`.
        env: id of the environment.
        env_settings: arguments of the environment.
        fine_inputs: whether networks receive each input in two scales, see `FineInputs`.
        channels: channels of the convolutions for pictures, see `PictureFeatures`.
    """

    steps: int = 600_000
    environments: int = 8
    workers: int = 0
    seed: int = 0
    evaluate_every: int = 50_000
    episodes: int = 50
    network: tuple[int, ...] = (64, 64)
    parameters: Arguments = field(default_factory=dict)
    warm_start: str | None = None
    algorithm: str
    env: str
    env_settings: Arguments = field(default_factory=dict)
    fine_inputs: bool = False
    channels: tuple[int, ...] = (32, 64, 64)

    def __post_init__(self) -> None:
        object.__setattr__(self, "network", tuple(self.network))
        object.__setattr__(self, "channels", tuple(self.channels))
        _check_algorithm(self.algorithm)
        self._check_run()
        if len(self.channels) != 3 or not all(type(n) is int and 1 <= n <= MAX_CHANNELS for n in self.channels):
            raise SettingsError(
                f"channels is {short_repr(self.channels)}; it must be three numbers in 1..{MAX_CHANNELS}"
            )
        if self.sees:
            self._check_pictures()
        if FINAL_ENTROPY in self.parameters:
            self._check_entropy()
        if self.warm_start is not None and (self.algorithm not in ON_POLICY or self.env != NAVIGATION):
            raise SettingsError(
                f"warm_start: {self.algorithm} on {self.env} cannot learn from a corpus; {', '.join(ON_POLICY)} "
                f"on {NAVIGATION} can"
            )

    def _check_run(self) -> None:
        for name in ("steps", "environments", "evaluate_every", "episodes"):
            if not isinstance(getattr(self, name), int) or getattr(self, name) < 1:
                raise SettingsError(f"{name} is {getattr(self, name)!r}; it must be a whole number of at least 1")
        if self.environments > MAX_ENVIRONMENTS:
            raise SettingsError(f"environments is {self.environments}; it must be in 1..{MAX_ENVIRONMENTS}")
        if len(self.network) > MAX_LAYERS or not all(type(w) is int and 1 <= w <= MAX_WIDTH for w in self.network):
            raise SettingsError(
                f"network is {short_repr(self.network)}; it must be up to {MAX_LAYERS} widths in 1..{MAX_WIDTH}"
            )
        _check_parameters(self.parameters)
        if not 0 <= self.workers <= self.environments:
            raise SettingsError(f"workers is {self.workers}; it must be in 0..{self.environments}, the environments")
        if not 0 <= self.seed < 2**31:
            raise SettingsError(f"seed is {self.seed}; it must be in 0..{2**31 - 1}")

    def as_json(self) -> Page:
        """Returns the settings in JSON types; the class accepts them as keyword arguments."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    def check_resumable(self, begun: Self, folder: object) -> None:
        """Raises `SettingsError` if a run in a folder was begun with other settings; `RESUMABLE` may differ."""
        wanted = json.loads(json.dumps(self.as_json()))  # tuples become lists, as in a file
        same = replace(begun, **{name: getattr(self, name) for name in RESUMABLE}).as_json()
        for name, value in wanted.items():
            if same[name] != value:
                raise SettingsError(
                    f"{folder}: a run with another {name} is there ({same[name]}, not {value}); "
                    "choose another folder, or resume with the same settings"
                )

    def _check_pictures(self) -> None:
        if self.algorithm not in ON_POLICY:
            raise SettingsError(
                f"observation=camera: {self.algorithm} would keep gigabytes of pictures; {', '.join(ON_POLICY)} do not"
            )
        if self.warm_start is not None:
            raise SettingsError("warm_start: the sessions of a corpus have no pictures; choose observation=vector")
        if self.fine_inputs:
            raise SettingsError("fine_inputs is true; pictures have one scale only")

    def _check_entropy(self) -> None:
        entropy, final = self.parameters.get("ent_coef"), self.parameters[FINAL_ENTROPY]
        if self.algorithm not in ON_POLICY or not isinstance(entropy, int | float):
            raise SettingsError(
                f"parameters.{FINAL_ENTROPY} needs a number ent_coef of {', '.join(ON_POLICY)}; "
                f"ent_coef of {self.algorithm} is {short_repr(entropy)}"
            )
        if not isinstance(final, int | float):
            raise SettingsError(f"parameters.{FINAL_ENTROPY} is {short_repr(final)}; it must be a number")

    @property
    def sees(self) -> bool:
        """Whether the observations are pictures."""
        return bool(self.env_settings.get("observation") == CAMERA)

    @property
    def masked(self) -> bool:
        """Whether the algorithm respects the action mask."""
        return self.algorithm == "maskable_ppo"


def _check_parameters(parameters: Arguments) -> None:
    """Raises `SettingsError` for a parameter of the algorithm that is larger than any memory."""
    for name, value in parameters.items():
        if not isinstance(value, bool | str | int | float | list | tuple | None):
            raise SettingsError(f"parameters.{name} is {short_repr(value)}; it must be a number, text or list")
        if isinstance(value, int | float) and not abs(value) <= MAX_PARAMETER:
            raise SettingsError(f"parameters.{name} is {short_repr(value)}; it must be at most {MAX_PARAMETER:g}")


def tuned_settings(algorithm: str, env: str, **changes: object) -> TrainingSettings:
    """Returns the tuned settings of an algorithm and an environment, with changes.

    With a different number of environments, the steps per environment are adjusted to keep the size of PPO's rollouts.

    Args:
        algorithm: one of `ALGORITHMS`.
        env: id of the environment; the defaults of the algorithm apply to environments without tuned settings.
        changes: fields of `TrainingSettings`; None leaves a field as it is, and so do the arguments of the environment
            that `env_settings` does not name.

    Raises:
        SettingsError: there is no such algorithm, or a field is out of its range.
    """
    _check_algorithm(algorithm)
    entries, given = _read_data(algorithm), _given(changes)
    asked = given.pop("env_settings", {})
    entry = CAMERA if asked.get("observation") == CAMERA and CAMERA in entries else env
    tuned = TrainingSettings(algorithm=algorithm, env=env, **entries[entry if entry in entries else DEFAULT])
    changed = replace(tuned, **given, env_settings={**tuned.env_settings, **asked})
    on_policy = algorithm in ON_POLICY and "batch_size" in tuned.parameters
    if on_policy and "parameters" not in given:
        steps = max(tuned.parameters["n_steps"] * tuned.environments // changed.environments, SHORTEST_ROLLOUT)
        changed = replace(changed, parameters={**changed.parameters, "n_steps": steps})
    return changed


def _check_algorithm(name: str) -> None:
    if name not in ALGORITHMS:
        hint = did_you_mean(name, tuple(ALGORITHMS))
        raise SettingsError(f"algorithm is {name!r}; {hint}it must be one of {', '.join(ALGORITHMS)}")


def _read_data(name: str) -> Page:
    text = resources.files(__package__).joinpath("data", f"{name}.yaml").read_text(encoding="utf-8")
    entries: Page = yaml.safe_load(text)
    return entries


def _given(changes: Arguments) -> Page:
    return {name: value for name, value in changes.items() if value is not None}
