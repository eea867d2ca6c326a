"""Option `--tier`: settings, players and towns of a tier, which other options replace."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.options import find_players
from dorothie_gym.cli.output import fail
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.evaluation.tiers import POOL_SEPARATOR, TIERS, Tier, find_tier
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym import policies as players
    from dorothie_gym.cli.language_model import LanguageModelOptions
    from dorothie_gym.session.config import EnvConfig
    from dorothie_gym.session.scenario import ReferenceDrive

TierName = Annotated[
    str | None,
    typer.Option(
        "--tier",
        metavar="|".join(TIERS),
        help="Conditions of a tier of the benchmark: settings, partners and towns; other options replace its parts.",
    ),
]

References = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.json",
        help="References of scenarios, from `reference-times`; others are measured when they are played.",
    ),
]


def read_references(file: Path | None) -> dict[str, ReferenceDrive]:
    """Returns the references in a file, by `drive_key`; none without one. Exits if it cannot be read."""
    if file is None:
        return {}
    try:
        return rollouts.read_drives(file)
    except OSError as error:
        fail(f"{file}: cannot be read ({error.strerror}); write it with `dorothie-gym reference-times`")


def tier_of(name: str | None) -> Tier | None:
    """Returns the tier with a name; exits if it is unknown."""
    if name is None:
        return None
    try:
        return find_tier(name)
    except ValueError as error:
        fail(str(error))


def tier_config(tier: Tier | None, *, oracle: bool = False) -> EnvConfig | None:
    """Returns the settings of a tier, or of its oracle, which other options change; None without a tier."""
    if tier is None:
        return None
    return tier.oracle if oracle else tier.config


def check_oracle(tier: Tier | None, replaced: Mapping[str, bool]) -> None:
    """Exits unless there is a tier whose oracle can be played.

    Args:
        tier: the tier.
        replaced: whether each option that would replace a part of the oracle is given.
    """
    if tier is None:
        fail("--oracle plays the oracle of a tier; give it with --tier")
    given = [option for option, is_given in replaced.items() if is_given]
    if given:
        fail(
            f"--oracle plays {tier.oracle_player} as Co-Wizard with exact words and acts; leave out {', '.join(given)}"
        )


def participants_of(given: str | None, tier: Tier | None) -> tuple[str, ...]:
    """Returns the names of the participants who take turns: those that are given, joined by "+", or the tier's."""
    if given is not None:  # the name of a file may contain the separator
        return (given,) if Path(given).exists() else tuple(given.split(POOL_SEPARATOR))
    return ("scripted",) if tier is None else tier.participants


def participant_of(given: str | None, tier: Tier | None, seed: int) -> str:
    """Returns the participant of a single session with a seed."""
    names = participants_of(given, tier)
    return names[seed % len(names)]


def find_pool(
    names: tuple[str, ...], first: players.Player, language_model: LanguageModelOptions
) -> tuple[players.Player, ...]:
    """Returns the participants who take turns; empty for a single one. Exits if one is unknown or cannot be loaded.

    Args:
        names: names of the participants.
        first: the first of them.
        language_model: options of the policies `llm:MODEL`.
    """
    if len(names) < 2:
        return ()
    return (first, *(find_players({Role.PARTICIPANT: name}, language_model)[Role.PARTICIPANT] for name in names[1:]))
