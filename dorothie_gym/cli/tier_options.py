"""Option `--tier`: settings, players and towns of a tier, which other options replace."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym import policies as players
from dorothie_gym.cli.options import env_config
from dorothie_gym.cli.output import fail
from dorothie_gym.errors import PolicyLoadError, SpeechError
from dorothie_gym.evaluation.tiers import POOL_SEPARATOR, TIERS, Tier, find_tier
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import CameraConfig, ChannelKind, EnvConfig, PerceptionModel
from dorothie_gym.support.optional_modules import check_installed

if TYPE_CHECKING:
    from dorothie_gym.cli.language_model import LanguageModelOptions

TierName = Annotated[
    str | None,
    typer.Option(
        "--tier",
        metavar="|".join(TIERS),
        help="Conditions of a tier of the benchmark: settings, partners and towns; other options replace its parts.",
    ),
]


def tier_of(name: str | None) -> Tier | None:
    """Returns the tier with a name; exits if it is unknown."""
    if name is None:
        return None
    try:
        return find_tier(name)
    except ValueError as error:
        fail(str(error))


def chosen_config(
    tier: Tier | None,
    *,
    oracle: bool = False,
    max_seconds: float | None,
    word_errors: float | None,
    perception: PerceptionModel,
    speech: bool,
    pictures: bool,
) -> EnvConfig:
    """Returns the settings of the engine: the usual ones or those of a tier, with those that are given.

    Exits if options exclude each other, or speech is not installed.

    Args:
        tier: the tier; None for the usual settings.
        oracle: whether the settings of the tier's oracle are taken.
        max_seconds: simulated time after which a session is truncated, in place of a multiple of the reference [s].
        word_errors: word error rate of simulated recognition, also in place of speech.
        perception: what participant and Co-Wizard see.
        speech: whether they speak.
        pictures: whether they observe the picture of the car's camera.
    """
    if tier is None:
        return env_config(max_seconds, word_errors, perception, speech, pictures=pictures)
    config = tier.oracle if oracle else tier.config
    if max_seconds is not None:
        config = replace(config, max_seconds=max_seconds, time_factor=None)
    if word_errors is not None:
        config = replace(config, word_error_rate=word_errors, channel=ChannelKind.TEXT)
    if speech:
        config = replace(config, channel=ChannelKind.SPEECH)
    if config.channel is ChannelKind.SPEECH:
        try:
            check_installed()
        except SpeechError as error:
            fail(f"{error}; --word-errors RATE replaces speech by simulated recognition")
    return replace(config, perception=perception, camera=CameraConfig() if pictures else None)


def participants_of(given: str | None, tier: Tier | None) -> tuple[str, ...]:
    """Returns the names of the participants who take turns: those that are given, joined by "+", or the tier's."""
    if given is not None:
        return tuple(given.split(POOL_SEPARATOR))
    return ("scripted",) if tier is None else tier.participants


def participant_of(given: str | None, tier: Tier | None, seed: int) -> str:
    """Returns the participant of a single session with a seed."""
    names = participants_of(given, tier)
    return names[seed % len(names)]


def find_pool(names: tuple[str, ...], language_model: LanguageModelOptions) -> tuple[players.Player, ...]:
    """Returns the participants who take turns; empty for a single one. Exits if one is unknown."""
    if len(names) < 2:
        return ()
    asks = any(name.startswith(players.LANGUAGE_MODEL) for name in names)
    model = language_model.config() if asks else None
    try:
        return tuple(players.find_player(name, Role.PARTICIPANT, model) for name in names)
    except PolicyLoadError as error:
        fail(str(error))
