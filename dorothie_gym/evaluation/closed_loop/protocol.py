"""Protocol of submissions: which rollouts can be rows of the leaderboard, in usual conditions, in tiers, and sealed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from dorothie_gym.errors import one_line, short_repr
from dorothie_gym.evaluation.closed_loop.beacon import Beacon, sealed_config
from dorothie_gym.evaluation.closed_loop.running import (
    CONDITIONS,
    RolloutSettings,
    fold_of_towns,
    parse_towns,
    towns_text,
)
from dorothie_gym.evaluation.closed_loop.seal import Seal, faults_of_seal
from dorothie_gym.evaluation.tiers import TIERS, Tier
from dorothie_gym.maps.folds import TownFold
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.policy_loader import ALL_SCRIPTED, find_player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.files import same_json

SESSIONS: Final = 100
"""Number of sessions of a row; with several trials, the largest multiple of them up to it."""

TRIALS: Final = (1, 3)
"""Numbers of trials of each scenario: one, or the three of Pass^3 in a tier."""


def usual_sessions(trials: int = 1, sessions: int = SESSIONS) -> int:
    """Returns the number of sessions of a submission with a number of trials of each scenario."""
    return max(sessions - sessions % trials, trials)


def part_of(settings: Mapping[str, Any]) -> str | None:
    """Returns the part of the board to which a rollout belongs; None for one in towns of several folds, or of none.

    It is the fold of its towns, or its tier. Sealed rollouts, and the oracle in the scenarios of a beacon, are parts of
    their own.

    Args:
        settings: settings of the rollout (`RolloutSettings.to_json`).
    """
    if tier := settings.get("tier"):
        is_sealed = "seal" in settings or (bool(settings.get("oracle")) and "beacon" in settings)
        return sealed_part(str(tier)) if is_sealed else str(tier)
    return fold_of_towns(settings["towns"])


def sealed_part(tier: str) -> str:
    """Returns the part of the board with the sealed tests of a tier."""
    return f"sealed {tier}"


@dataclass(frozen=True, kw_only=True)
class LeaderboardProtocol:
    """Common protocol of the rows of a leaderboard.

    A rollout without a tier has the conditions below, and a scripted participant and Ad-Wizard; one in a tier has those
    of the tier. The scenarios of a sealed one are those of its beacon.

    Attributes:
        folds: folds whose towns a rollout may be played in; it covers one of them as a whole, in the usual order.
        sessions: number of sessions; if more were allowed, a submitter could stop at the best moment.
        seed: seed of the rollout.
        config: settings of the engine.
        tiers: tiers by name.
    """

    folds: tuple[str, ...] = (TownFold.SEEN, TownFold.DEVELOPMENT, TownFold.UNSEEN)
    sessions: int = SESSIONS
    seed: int = 0
    config: EnvConfig = EnvConfig()
    tiers: Mapping[str, Tier] = field(default_factory=lambda: TIERS)

    def __post_init__(self) -> None:
        if self.sessions < 1:
            raise ValueError(f"sessions is {self.sessions}; it must be at least 1")

    def faults(self, settings: Mapping[str, Any]) -> Iterator[str]:
        """Yields the parts of a rollout's settings (`RolloutSettings.to_json`) that the protocol does not allow."""
        found = [*self.faults_of_conditions(settings)]
        if found:
            yield from found
            return
        wanted = self.settings(settings)
        yield from self._faults_of_towns(settings, wanted)
        if settings["sessions_planned"] != wanted.sessions:
            yield f"{settings['sessions_planned']} sessions; the protocol has {wanted.sessions}"
        if settings["seed"] != wanted.seed:
            yield f"seed is {settings['seed']}; that of the protocol is {wanted.seed}"
        page = wanted.to_json()
        for role in (Role.PARTICIPANT, Role.AD_WIZARD):
            if settings[str(role)] != page[str(role)]:
                yield f"{role} is {one_line(settings[str(role)])}; that of the protocol is {page[str(role)]}"
        for name in ("pool_sha256", "references"):
            if not same_json(settings.get(name), page.get(name)):
                yield f"{name} is {short_repr(settings.get(name))}; the protocol has {short_repr(page.get(name))}"
        given, usual = settings["config"], wanted.config.record()
        for name in sorted({*given, *usual}):
            if not same_json(given.get(name), usual.get(name)):
                yield (
                    f"config, {name} is {short_repr(given.get(name))}; that of the protocol is "
                    f"{short_repr(usual.get(name))}"
                )

    def faults_of_conditions(self, settings: Mapping[str, Any]) -> Iterator[str]:
        """Yields faults of tier, trials, beacon and seal, from which most others would follow."""
        name, trials = settings.get("tier"), settings.get("trials", 1)
        if name is None:
            if surplus := sorted(CONDITIONS & settings.keys()):
                yield (
                    f"{', '.join(surplus)}: rollouts in a tier have such settings; run it with --tier, or without "
                    "--trials and --oracle"
                )
            return
        if name not in self.tiers:
            yield f"tier is {short_repr(name)}; the tiers are {', '.join(self.tiers)}"
            return
        if trials not in TRIALS:
            yield f"{short_repr(trials)} trials of each scenario; a submission has {' or '.join(map(str, TRIALS))}"
        oracle = self.tiers[name].oracle_player
        if settings.get("oracle") and settings[str(Role.CO_WIZARD)] != oracle:
            yield f"co_wizard is {one_line(settings[str(Role.CO_WIZARD)])}; the oracle of the tier is {oracle}"
        yield from _faults_of_beacon(settings)

    def settings(self, settings: Mapping[str, Any]) -> RolloutSettings:
        """Returns the settings that the protocol has for a rollout of such conditions, with a scripted Co-Wizard.

        Args:
            settings: settings of the rollout, without `faults_of_conditions`.
        """
        name, page = settings.get("tier"), settings.get("beacon")
        if name is None:
            towns = tuple(str(town) for town in settings["towns"])
            return RolloutSettings(towns=towns, sessions=self.sessions, seed=self.seed, config=self.config)
        tier, trials = self.tiers[name], int(settings.get("trials", 1))
        beacon = None if page is None else Beacon.from_json(page)
        pool = tuple(find_player(each, Role.PARTICIPANT) for each in tier.participants)
        cast = {**ALL_SCRIPTED, Role.PARTICIPANT: pool[0], Role.AD_WIZARD: find_player(tier.ad_wizard, Role.AD_WIZARD)}
        oracle = bool(settings.get("oracle"))
        config = tier.oracle if oracle else tier.config
        return RolloutSettings(
            cast=cast,
            towns=tier.towns if beacon is None else beacon.towns,
            sessions=usual_sessions(trials, self.sessions),
            seed=self.seed if beacon is None else beacon.seed,
            config=config if beacon is None else sealed_config(config),
            pool=pool if len(pool) > 1 else (),
            trials=trials,
            tier=tier.name,
            oracle=oracle,
            references=tier.config.talk is None,
            beacon=beacon,
        )

    def _faults_of_towns(self, settings: Mapping[str, Any], wanted: RolloutSettings) -> Iterator[str]:
        towns = [str(town) for town in settings["towns"]]
        if wanted.tier is not None:
            if towns != list(wanted.towns):
                yield (
                    f"towns are {one_line(towns_text(towns, ', '))}; the protocol has {towns_text(wanted.towns, ', ')}"
                )
            return
        whole = {fold: list(parse_towns(fold)) for fold in self.folds}
        if fold_of_towns(towns) not in self.folds or towns not in whole.values():
            choices = " or ".join(towns_text(there, ", ") for there in whole.values())
            yield f"towns are {one_line(towns_text(towns, ', '))}; the protocol has {choices}, in this order"


def _faults_of_beacon(settings: Mapping[str, Any]) -> Iterator[str]:
    """Yields faults of beacon and seal: one without the other, malformed ones, and a seal that is not of the run."""
    if "beacon" not in settings:
        if "seal" in settings:
            yield "there is a seal, but no beacon; run the rollout with --beacon"
        return
    try:
        beacon = Beacon.from_json(settings["beacon"])
    except ValueError as error:
        yield str(error)
        return
    if settings.get("oracle"):
        if "seal" in settings:
            yield "the oracle is no model that could be sealed; run the rollout without --seal"
        return
    if "seal" not in settings:
        yield "there is a beacon, but no seal: nothing shows that the model was finished before; use --seal"
        return
    try:
        seal = Seal.from_json(settings["seal"])
    except ValueError as error:
        yield f"seal: {error}"
        return
    yield from faults_of_seal(seal, beacon, settings)


PROTOCOL: Final = LeaderboardProtocol()
"""Protocol of the leaderboard."""
