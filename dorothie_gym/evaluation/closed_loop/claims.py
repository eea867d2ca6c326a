"""Claims of a rollout: statements in its files that no check can compute again, and those that a check can refute."""

from __future__ import annotations

import enum
import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from dorothie_gym.errors import PolicyLoadError, short_repr
from dorothie_gym.evaluation.closed_loop.running import CONDITIONS, RolloutSettings
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.language_model.config import LanguageModelConfig
from dorothie_gym.policies.policy_loader import (
    ALL_SCRIPTED,
    LANGUAGE_MODEL,
    WITH_TRAITS,
    Player,
    find_player,
    policy_names,
)
from dorothie_gym.policies.pretrained import is_pretrained
from dorothie_gym.session.recording.files import same_json
from dorothie_gym.session.spaces.fields import SpaceLimits


class Claim(enum.StrEnum):
    """Statements about a rollout that may be unchecked."""

    FIGURES = "figures"
    """Metrics, seeds, towns, settings and partners: all that follows from the sessions."""
    NAME = "name"
    """Which policy chose the actions of the Co-Wizard."""
    WEIGHTS = "weights"
    """SHA-256 of its weights."""
    LANGUAGE_MODEL = "language model"
    """Settings of its language model."""
    PERSONA = "persona"
    """Traits of the Co-Wizard in the headers of the sessions."""
    TRAINING = "training cost"
    """Steps and time of its training."""
    USAGE = "usage"
    """Calls, tokens, latency and cost of language models."""
    DATES = "dates of seal and beacon"
    """Days on which a model was sealed, and on which the text of its beacon became known."""
    RUN_TIME = "run time"
    """Wall time, processor time and number of processes of the rollout."""


def claims_of(
    settings: Mapping[str, Any],
    *,
    checked: bool,
    played: bool,
    persona: bool = False,
    usage: bool = False,
    run_time: bool = False,
) -> tuple[Claim, ...]:
    """Returns the claims of a rollout, in the order of `Claim`.

    Args:
        settings: its settings (`RolloutSettings.to_json`).
        checked: whether its sessions were checked, and those of the sample played again.
        played: whether the policy of the Co-Wizard was played again as well.
        persona: whether headers have a persona of the Co-Wizard.
        usage: whether sessions have a usage of language models.
        run_time: whether there is a `cost.json`.
    """
    there = {
        Claim.FIGURES: not checked,
        Claim.NAME: not played,
        Claim.WEIGHTS: not played and bool(settings.get("sha256")),
        Claim.LANGUAGE_MODEL: bool(settings.get("language_models")),
        Claim.PERSONA: not played and persona,
        Claim.TRAINING: bool(settings.get("training")),
        Claim.USAGE: usage,
        Claim.DATES: "seal" in settings,
        Claim.RUN_TIME: run_time,
    }
    return tuple(claim for claim, is_claim in there.items() if is_claim)


# --- Shipped policies -------------------------------------------------------------------------------------------------


def shipped_player(name: str) -> Player | None:
    """Returns the Co-Wizard with a name if the package has its policy; None for a file or a language model.

    Raises:
        PolicyLoadError: the name begins like one of the package, which has none of that name.
    """
    if name in policy_names(Role.CO_WIZARD) or is_pretrained(name) or name.startswith(WITH_TRAITS):
        return find_player(name, Role.CO_WIZARD)
    return None


def can_play(player: Player, role: Role = Role.CO_WIZARD) -> bool:
    """Returns whether the libraries that the policy of a role needs are installed."""
    try:
        player.make(role, SpaceLimits())
    except PolicyLoadError:
        return False
    return True


# --- Settings that are claims -----------------------------------------------------------------------------------------

_SETTINGS: Final = frozenset(RolloutSettings().to_json())
_LANGUAGE_MODELS: Final = "language_models"
_OPTIONAL: Final = frozenset({"prices", "parameters"})
"""Settings of a language model that are recorded where they are given."""

_COSTS: Final = frozenset({"steps", "seconds"})
_HASH: Final = re.compile(r"[0-9a-f]{64}")
_MAX_NAME: Final = 200
"""Characters of the name of a policy on a leaderboard."""


def faults_of_claims(settings: Mapping[str, Any]) -> Iterator[str]:
    """Yields faults of settings that only the submitter knows: names, hashes, costs, unknown fields.

    Args:
        settings: output of `RolloutSettings.to_json`, as read from a file.
    """
    surplus = sorted(settings.keys() - _SETTINGS - CONDITIONS - {_LANGUAGE_MODELS})
    yield from (f"settings, {name}: is unknown, and nothing checks it" for name in surplus)
    name = str(settings[str(Role.CO_WIZARD)])
    if not name.isprintable() or not 0 < len(name.strip()) <= _MAX_NAME or name != name.strip():
        yield f"co_wizard is {short_repr(name)}; a name has up to {_MAX_NAME} printable characters"
        return
    try:
        player = shipped_player(name)
    except PolicyLoadError as error:
        yield str(error)
        return
    if player is not None:
        yield from _differences_of_shipped(settings, player)
        return
    yield from _faults_of_weights(settings)
    yield from _faults_of_language_model(settings, name)


def _differences_of_shipped(settings: Mapping[str, Any], player: Player) -> Iterator[str]:
    wanted = RolloutSettings(cast={**ALL_SCRIPTED, Role.CO_WIZARD: player}).to_json()
    for field in ("sha256", "training", _LANGUAGE_MODELS):
        if not same_json(settings.get(field), wanted.get(field)):
            yield f"settings, {field} is not that of {player.name}, as this version of the package has it"


def _faults_of_weights(settings: Mapping[str, Any]) -> Iterator[str]:
    found: dict[str, Mapping[str, Any]] = {}
    for field in ("sha256", "training"):
        value = settings.get(field)
        if not isinstance(value, Mapping) or value.keys() - {str(Role.CO_WIZARD)}:
            yield f"settings, {field} is {short_repr(value)}; it may have a field co_wizard, and no other"
            return
        found[field] = value
    hashes, training = found["sha256"], found["training"]
    given = hashes.get(str(Role.CO_WIZARD), "0" * 64)
    if not isinstance(given, str) or not _HASH.fullmatch(given):
        yield f"settings, sha256 is {short_repr(given)}; it must be a SHA-256 in hexadecimal digits"
    if surplus := sorted(training.get(str(Role.CO_WIZARD), {}).keys() - _COSTS):
        yield f"settings, training, {surplus[0]}: is unknown, and nothing checks it"


def _faults_of_language_model(settings: Mapping[str, Any], name: str) -> Iterator[str]:
    models = settings.get(_LANGUAGE_MODELS)
    if not name.startswith(LANGUAGE_MODEL):
        if models is not None:
            yield f"settings, {_LANGUAGE_MODELS}: {name} is no language model"
        return
    wanted = LanguageModelConfig(model="any", url="http://localhost/v1").record()
    page = models.get(str(Role.CO_WIZARD)) if isinstance(models, Mapping) else None
    if not isinstance(models, Mapping) or not isinstance(page, Mapping) or len(models) != 1:
        yield f"settings, {_LANGUAGE_MODELS} is {short_repr(models)}; it must have the settings of the co_wizard alone"
    elif page.keys() - _OPTIONAL != wanted.keys():
        yield f"settings, {_LANGUAGE_MODELS}, co_wizard: must have the fields {', '.join(wanted)}"
