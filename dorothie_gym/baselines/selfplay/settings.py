"""Settings of self-play; the defaults are in `rl/data/selfplay.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from importlib import resources
from typing import Any, Final

import yaml

from dorothie_gym.baselines.rl.settings import TrainingSettings
from dorothie_gym.errors import SettingsError

SELFPLAY: Final = "selfplay"
"""Name of the algorithm at the command line, and kind of its models in `model.json`."""

ARGUMENTS: Final = ("town", "storyboard", "traffic", "max_seconds", "progress")
"""Fields that are arguments of `SelfPlayEnv`."""

PARTS: Final = ("past_environments", "coached_environments")
"""Fields with numbers of environments in which not all roles learn."""


@dataclass(frozen=True, kw_only=True)
class SelfPlaySettings:
    """Settings of a run.

    Attributes:
        shared: whether one network plays all roles; otherwise each has its own.
        town, storyboard, traffic, max_seconds, progress: see `SelfPlayEnv`.
        coached_environments: in so many, in turn Co-Wizard and participant learn with the others scripted. Who only
            plays with one another has to find a language first, and it need not be ours (Lowe et al. 2020, "On the
            interaction between supervision and self-play in emergent communication").
        past_environments: in so many environments the Ad-Wizard is one of earlier times, which does not learn.
        steps: decisions of all environments together.
        environments: how many play at once.
        workers: processes that step them; 0 steps them in the process that learns.
        seed: of networks, environments and exploration.
        evaluate_every: steps between evaluations.
        episodes: of each of an evaluation's two parts.
        network: widths of the hidden layers.
        parameters: of MaskablePPO, as sb3-contrib names them; see `rl.settings.FINAL_RATE`.
        warm_start: folder of a corpus; what its roles did is learned first. None for nothing.
    """

    shared: bool = False
    town: str = "brookside"
    storyboard: str | None = None
    traffic: str = "light"
    max_seconds: float = 600.0
    progress: float = 0.02
    coached_environments: int = 0
    past_environments: int = 0
    steps: int = 600_000
    environments: int = 16
    workers: int = 0
    seed: int = 0
    evaluate_every: int = 100_000
    episodes: int = 20
    network: tuple[int, ...] = (128, 128)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    warm_start: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "network", tuple(self.network))
        if not isinstance(self.shared, bool):
            raise SettingsError(f"shared is {self.shared!r}; it must be true or false")
        left = self.environments - 1
        for name in PARTS:
            value = getattr(self, name)
            if not isinstance(value, int) or not 0 <= value <= left:
                raise SettingsError(f"{name} is {value!r}; it must be in 0..{left}: all roles learn in one at least")
            left -= value
        self.learner()

    @property
    def env_settings(self) -> dict[str, Any]:
        """Arguments of `SelfPlayEnv`."""
        return {name: getattr(self, name) for name in ARGUMENTS}

    def learner(self, seed: int = 0) -> TrainingSettings:
        """Returns the settings of a learner; `seed` is that of its network."""
        return TrainingSettings(
            algorithm="maskable_ppo", env=SELFPLAY, seed=seed, network=self.network, parameters=self.parameters,
            steps=self.steps, environments=self.environments, workers=self.workers, episodes=self.episodes,
            evaluate_every=self.evaluate_every,
        )  # fmt: skip

    def as_json(self) -> dict[str, Any]:
        """The settings in JSON types; `SelfPlaySettings(**...)` reads them back."""
        return {**asdict(self), "network": list(self.network)}


def selfplay_settings(given: Mapping[str, Any] | None = None, **changes: Any) -> SelfPlaySettings:
    """Returns the default settings with changes.

    Args:
        given: what a user sets: `shared`, `PARTS` and arguments of `SelfPlayEnv`.
        changes: other fields; None leaves a field as it is.

    Raises:
        SettingsError: there is no such field, or it is out of its range.
    """
    settable = ("shared", *PARTS, *ARGUMENTS)
    unknown = [name for name in given or {} if name not in settable]
    if unknown:
        raise SettingsError(f"selfplay has no {unknown[0]!r}; what can be set is {', '.join(settable)}")
    file = resources.files("dorothie_gym.baselines.rl").joinpath("data", f"{SELFPLAY}.yaml")
    tuned = yaml.safe_load(file.read_text(encoding="utf-8"))
    known = {name: value for name, value in changes.items() if value is not None}
    found = {**tuned, **known, **(given or {})}
    for name in set(PARTS) - set(given or {}):  # in proportion, where there are fewer environments
        found[name] = tuned[name] * min(found["environments"], tuned["environments"]) // tuned["environments"]
    assert set(found) <= {each.name for each in fields(SelfPlaySettings)}
    return SelfPlaySettings(**found)
