"""The rollouts of a leaderboard: which policies play in which towns, planned and played by one command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from dorothie_gym.evaluation.closed_loop.leaderboard import ENOUGH, IMPORTED
from dorothie_gym.evaluation.closed_loop.many_rollouts import folder_name
from dorothie_gym.evaluation.closed_loop.running import RolloutSettings
from dorothie_gym.maps.default_lights import split_lights
from dorothie_gym.maps.folds import FOLD_TOWNS, TownFold
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.policy_loader import ALL_SCRIPTED, LANE_FOLLOW, AnyPlayer, Player, player_of
from dorothie_gym.policies.pretrained import names_for
from dorothie_gym.session.config import EnvConfig

PARTS: Final[tuple[str, ...]] = (TownFold.SEEN, TownFold.UNSEEN)
"""Parts that are played by default."""

CHOICES: Final[tuple[str, ...]] = (TownFold.SEEN, TownFold.DEVELOPMENT, TownFold.UNSEEN)
"""Parts that can be played."""


def usual_rows() -> tuple[str, ...]:
    """Returns the names of the Co-Wizards that are played by default: scripts, and all models that are shipped."""
    return ("scripted", LANE_FOLLOW, "random", *names_for(Role.CO_WIZARD))


@dataclass(frozen=True, kw_only=True)
class LeaderboardPlan:
    """Rollouts of a leaderboard.

    Attributes:
        co_wizards: players in any form that `player_of` takes, at least one; participant and Ad-Wizard are scripted.
        parts: parts to be played, of `CHOICES`.
        imported: OpenDRIVE files; if there are any, the part "imported" is played in them.
        sessions: number of sessions of each row.
        seed: seed of the sessions.
        config: settings of the engine.
    """

    co_wizards: Sequence[AnyPlayer]
    parts: tuple[str, ...] = PARTS
    imported: tuple[str, ...] = ()
    sessions: int = ENOUGH
    seed: int = 0
    config: EnvConfig = field(default_factory=EnvConfig)

    def __post_init__(self) -> None:
        """Checks the fields."""
        unknown = [part for part in self.parts if part not in CHOICES]
        if unknown or not (self.parts or self.imported):
            raise ValueError(f"parts is {', '.join(self.parts) or 'empty'}; give some of {', '.join(CHOICES)}")
        wrong = [name for name in self.imported if not split_lights(name)[0].lower().endswith(".xodr")]
        if wrong:
            raise ValueError(f"imported has {wrong[0]}; give OpenDRIVE files (.xodr)")
        names = [player.name for player in self.players]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"co_wizards has {', '.join(names) or 'nobody'}; give each once")

    @property
    def players(self) -> tuple[Player, ...]:
        """Players of the Co-Wizard."""
        return tuple(player_of(given, Role.CO_WIZARD) for given in self.co_wizards)

    def rollouts(self) -> dict[str, RolloutSettings]:
        """Returns the rollouts by the name of their folder, part by part."""
        towns = {str(fold): there for fold, there in FOLD_TOWNS.items()} | {IMPORTED: self.imported}
        parts = (*self.parts, *((IMPORTED,) if self.imported else ()))
        return {
            f"{part}-{folder_name(player, Role.CO_WIZARD)}": RolloutSettings(
                cast={**ALL_SCRIPTED, Role.CO_WIZARD: player},
                towns=towns[part],
                sessions=self.sessions,
                seed=self.seed,
                config=self.config,
            )
            for part in parts
            for player in self.players
        }
