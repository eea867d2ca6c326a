"""What a rollout is to play: who, where, with which seeds."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym.envs.config import EnvConfig
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import ALL_SCRIPTED, Player
from dorothie_gym.sessions import safe_name
from dorothie_gym.world.town import SEEN_TOWNS, UNSEEN_TOWNS, load_town

SESSIONS_FOLDER: Final = "sessions"
"""Within the folder of a rollout: the sessions, for replay."""

_ROLLOUTS: Final = 7
"""Branch of the seed; corpora draw from another, so that nobody is tested on a session that it was trained on."""

_GROUPS: Final[Mapping[str, tuple[str, ...]]] = {
    "seen": SEEN_TOWNS, "unseen": UNSEEN_TOWNS, "all": (*SEEN_TOWNS, *UNSEEN_TOWNS),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class RolloutPlan:
    """A session of a rollout.

    Attributes:
        number: in the rollout, from 0.
        town: name or file of its town.
        seed: everything in it follows from this, and from who plays.
    """

    number: int
    town: str
    seed: int

    @property
    def path(self) -> str:
        """Its folder within that of the rollout."""
        return f"{SESSIONS_FOLDER}/{self.number:04d}-{safe_name(Path(self.town).stem)}"


@dataclass(frozen=True, kw_only=True)
class RolloutSettings:
    """Everything that a rollout's table follows from.

    Attributes:
        cast: who plays the three roles.
        towns: names or files of towns, which take turns.
        sessions: how many in all.
        seed: the seed of a session follows from it and from the session's number only, whoever plays.
        config: of the environment.
    """

    cast: Mapping[Role, Player] = field(default_factory=lambda: ALL_SCRIPTED)
    towns: tuple[str, ...] = UNSEEN_TOWNS
    sessions: int = 20
    seed: int = 0
    config: EnvConfig = field(default_factory=EnvConfig)

    def __post_init__(self) -> None:
        """Checks the fields."""
        if self.sessions < 1:
            raise ValueError(f"sessions is {self.sessions}; it must be at least 1")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}; it must be at least 0")
        if not self.towns:
            raise ValueError("towns is empty; give at least one")
        missing = [str(role) for role in AGENT_ROLES if role not in self.cast]
        if missing:
            raise ValueError(f"cast has nobody for {', '.join(missing)}; each of the three roles needs a player")

    def plans(self) -> tuple[RolloutPlan, ...]:
        """Returns the sessions, in order."""
        return tuple(
            RolloutPlan(number=number, town=self.towns[number % len(self.towns)], seed=_seed(self.seed, number))
            for number in range(self.sessions)
        )

    def to_json(self) -> dict[str, Any]:
        """Returns what the table follows from, in JSON types; of learned players their SHA-256 and their cost, too."""
        return {
            **{str(role): self.cast[role].name for role in AGENT_ROLES},
            "sha256": {str(role): self.cast[role].sha256 for role in AGENT_ROLES if self.cast[role].sha256},
            "training": {str(role): dict(self.cast[role].training) for role in AGENT_ROLES if self.cast[role].training},
            "towns": list(self.towns),
            "sessions_planned": self.sessions,
            "seed": self.seed,
            "config": asdict(self.config),
        }


def command_of(settings: Mapping[str, Any]) -> str:
    """Returns the command that plays a rollout again, from what `RolloutSettings.to_json` returned.

    Settings of the environment that no option has are left out.
    """
    usual, config = EnvConfig(), settings["config"]
    words = ["dorothie-gym", "rollout"]
    for role in (Role.CO_WIZARD, Role.PARTICIPANT, Role.AD_WIZARD):
        words += [f"--{str(role).replace('_', '-')}", str(settings[str(role)])]
    words += ["--towns", ",".join(settings["towns"])]
    words += ["--sessions", str(settings["sessions_planned"]), "--seed", str(settings["seed"])]
    for option, name in (("--max-seconds", "max_seconds"), ("--word-errors", "word_error_rate")):
        if config[name] != getattr(usual, name):
            words += [option, f"{config[name]:g}"]
    return shlex.join(words)


def parse_towns(text: str) -> tuple[str, ...]:
    """Returns the towns that are meant by "seen", "unseen", "all", or names or files with commas between them.

    Raises:
        TownError: there is no such town.
        ValueError: none is named.
    """
    found: list[str] = []
    for name in filter(None, (part.strip() for part in text.split(","))):
        if name not in _GROUPS:
            load_town(name)
        found += [town for town in _GROUPS.get(name, (name,)) if town not in found]
    if not found:
        raise ValueError(f"towns is {text!r}; give seen, unseen, all, or names with commas between them")
    return tuple(found)


def fold_of_towns(towns: Sequence[str]) -> str | None:
    """Returns "seen" or "unseen" where all towns are of the one fold; None where they are of both, or of none."""
    return next((fold for fold in ("seen", "unseen") if towns and set(towns) <= set(_GROUPS[fold])), None)


def _seed(seed: int, number: int) -> int:
    return int(np.random.SeedSequence([seed, number, _ROLLOUTS]).generate_state(1)[0] >> 1)
