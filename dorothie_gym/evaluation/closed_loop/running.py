"""Rollouts: sessions of given players in given towns, played and measured."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dorothie_gym.evaluation.closed_loop.beacon import BEACON, Beacon, sealed_config
from dorothie_gym.evaluation.closed_loop.results import RESULT_FILE, RolloutResult, RolloutRow
from dorothie_gym.evaluation.closed_loop.seal import Seal, faults_of_seal
from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord, measure
from dorothie_gym.evaluation.closed_loop.usage import SessionUsage, read_usage
from dorothie_gym.evaluation.rollout.runner import PlayedSession, SessionJob, run_sessions
from dorothie_gym.evaluation.tiers import POOL_SEPARATOR, TIERS
from dorothie_gym.maps.catalogue import load_town
from dorothie_gym.maps.folds import FOLD_TOWNS, VALIDATION_TOWNS, TownFold
from dorothie_gym.maps.generated.specification import parse_series, split_names
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.language_model.config import LanguageModelConfig
from dorothie_gym.policies.policy_loader import ALL_SCRIPTED, AnyPlayer, Player, player_of
from dorothie_gym.session.config import ChannelKind, EnvConfig
from dorothie_gym.session.recording.files import safe_name, to_page
from dorothie_gym.support.files import write_atomically

if TYPE_CHECKING:
    from dorothie_gym.session.scenario import ReferenceDrive

SESSIONS_FOLDER: Final = "sessions"
"""Folder of the sessions within the folder of a rollout, for replay."""

_ROLLOUTS: Final = 7
"""Branch of the seed; corpora draw from another, so that no policy is tested on a session that it was trained on."""

CONDITIONS: Final = frozenset({"tier", "oracle", "references", "trials", "pool_sha256", "beacon", "seal"})
"""Settings of rollouts in tiers and of sealed ones, which other rollouts do not have (`RolloutSettings.to_json`)."""

_GROUPS: Final[Mapping[str, tuple[str, ...]]] = {
    **{str(fold): towns for fold, towns in FOLD_TOWNS.items()},
    "all": tuple(town for fold in (TownFold.SEEN, TownFold.DEVELOPMENT, TownFold.UNSEEN) for town in FOLD_TOWNS[fold]),
}


@dataclass(frozen=True, kw_only=True)
class RolloutPlan:
    """A session of a rollout.

    Attributes:
        number: number of the session in the rollout, from 0.
        town: name or file of the town.
        seed: seed of the session, which determines it together with the players and the trial.
        trial: number of the trial, of several of one scenario, in which the players have other seeds.
        participant: player of the participant, if several take turns.
    """

    number: int
    town: str
    seed: int
    trial: int = 0
    participant: Player | None = None

    @property
    def partners(self) -> Mapping[Role, Player]:
        """Players of this session that replace those of the rollout."""
        return {} if self.participant is None else {Role.PARTICIPANT: self.participant}

    @property
    def path(self) -> str:
        """Folder of the session within the folder of the rollout."""
        return f"{SESSIONS_FOLDER}/{self.number:04d}-{safe_name(Path(self.town).stem)}"

    def __str__(self) -> str:
        return f"session {self.number} ({self.town}, seed {self.seed})"


@dataclass(frozen=True, kw_only=True)
class RolloutSettings:
    """Settings of a rollout, which determine its result.

    Attributes:
        cast: policy of each of the three roles: a `Player`, a name, an object or a class (`player_of`).
        towns: names or files of towns, which take turns.
        sessions: number of sessions in all towns.
        seed: seed of the rollout; with the number of a session it gives the seed of the session, for any players.
        config: settings of the engine.
        pool: players of the participant who take turns in place of that of the cast; empty for that of the cast.
        trials: number of sessions of each scenario, in which the players have different seeds.
        tier: name of the tier that gave the settings, for tables; None for other settings.
        oracle: whether they are those of the oracle of the tier, for tables.
        references: whether sessions get the reference of their scenario, see `ReferenceDrive`.
        beacon: beacon of a sealed test, from which seed, towns and the order of the pool are drawn.
        seal: seal of the Co-Wizard, which must be older than the beacon.
    """

    cast: Mapping[Role, AnyPlayer] = field(default_factory=lambda: ALL_SCRIPTED)
    towns: tuple[str, ...] = VALIDATION_TOWNS
    sessions: int = 20
    seed: int = 0
    config: EnvConfig = field(default_factory=EnvConfig)
    pool: tuple[Player, ...] = ()
    trials: int = 1
    tier: str | None = None
    oracle: bool = False
    references: bool = False
    beacon: Beacon | None = None
    seal: Seal | None = None

    def __post_init__(self) -> None:
        """Checks the fields."""
        if self.sessions < 1:
            raise ValueError(f"sessions is {self.sessions}; it must be at least 1")
        if self.trials < 1 or self.sessions % self.trials:
            raise ValueError(
                f"trials is {self.trials}; it must be at least 1 and divide the number of sessions, {self.sessions}"
            )
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}; it must be at least 0")
        if not self.towns:
            raise ValueError("towns is empty; give at least one")
        missing = [str(role) for role in AGENT_ROLES if role not in self.cast]
        if missing:
            raise ValueError(f"cast has no player for {', '.join(missing)}; each of the three roles needs a player")
        object.__setattr__(self, "cast", {role: player_of(given, role) for role, given in self.cast.items()})
        self._check_seal()

    def _check_seal(self) -> None:
        """Raises `ValueError` if beacon, seal and the other fields do not belong together."""
        if self.beacon is None:
            if self.seal is not None:
                raise ValueError("seal is given without a beacon; the scenarios of a sealed test come from a beacon")
            return
        if (self.towns, self.seed) != (self.beacon.towns, self.beacon.seed):
            raise ValueError("towns and seed are not those of the beacon; take Beacon.towns and Beacon.seed")
        if self.config != sealed_config(self.config):
            raise ValueError("config draws shipped storyboards, which are known; take sealed_config(config)")
        if self.seal is not None:
            fault = next(faults_of_seal(self.seal, self.beacon, self.to_json()), None)
            if fault is not None:
                raise ValueError(fault)

    @property
    def players(self) -> dict[Role, Player]:
        """Player of each role."""
        return {role: player_of(given, role) for role, given in self.cast.items()}

    @property
    def header_extra(self) -> dict[str, object]:
        """Fields of `SessionHeader.extra` of every session: the beacon, if there is one."""
        return {} if self.beacon is None else {BEACON: self.beacon.to_json()}

    def plans(self) -> tuple[RolloutPlan, ...]:
        """Returns the plans of the sessions, in order: all trials of a scenario, then those of the next one."""
        return tuple(
            RolloutPlan(
                number=number,
                town=self.towns[scenario % len(self.towns)],
                seed=_seed(self.seed, scenario),
                trial=trial,
                participant=self._participant_of(scenario),
            )
            for number in range(self.sessions)
            for scenario, trial in [divmod(number, self.trials)]
        )

    def _participant_of(self, scenario: int) -> Player | None:
        """Returns the participant of a scenario; in each town, all of the pool take turns, or as the beacon draws."""
        if self.pool and self.beacon is not None:
            return self.pool[self.beacon.turn(scenario, len(self.pool))]
        return self.pool[(scenario + scenario // len(self.towns)) % len(self.pool)] if self.pool else None

    def to_json(self) -> dict[str, object]:
        """Returns the settings in JSON types, with SHA-256 and training cost of learned players.

        Fields of tiers are left out where they have their defaults.
        """
        cast = self.players
        players = [*cast.items(), *((Role.PARTICIPANT, player) for player in self.pool)]
        models = {
            str(role): player.language_model.record() for role, player in players if player.language_model is not None
        }
        names = {str(role): cast[role].name for role in AGENT_ROLES}
        if self.pool:
            names[str(Role.PARTICIPANT)] = POOL_SEPARATOR.join(player.name for player in self.pool)
        tier: dict[str, object] = {
            "tier": self.tier,
            "oracle": self.oracle,
            "references": self.references,
            "trials": self.trials if self.trials > 1 else None,
            "pool_sha256": [player.sha256 for player in self.pool],
            "beacon": None if self.beacon is None else self.beacon.to_json(),
            "seal": None if self.seal is None else self.seal.to_json(),
        }
        return {
            **names,
            "sha256": {str(role): cast[role].sha256 for role in AGENT_ROLES if cast[role].sha256},
            "training": {str(role): dict(cast[role].training) for role in AGENT_ROLES if cast[role].training},
            **({"language_models": models} if models else {}),
            **{name: value for name, value in tier.items() if value},
            "towns": list(self.towns),
            "sessions_planned": self.sessions,
            "seed": self.seed,
            "config": self.config.record(),
        }


def command_of(settings: Mapping[str, Any], seal: Path | str = "FILE") -> str:
    """Returns the command that reproduces a rollout; settings of the engine without an option are left out.

    Args:
        settings: output of `RolloutSettings.to_json`.
        seal: file of the seal, if the rollout has one.
    """
    config, usual = settings["config"], usual_settings(settings)["config"]
    words = ["dorothie-gym", "rollout"]
    if tier := settings.get("tier"):
        words += ["--tier", str(tier), *(["--oracle"] if settings.get("oracle") else [])]
    if trials := settings.get("trials"):
        words += ["--trials", str(trials)]
    for role in (Role.CO_WIZARD, Role.PARTICIPANT, Role.AD_WIZARD):
        if role is Role.CO_WIZARD and settings.get("oracle"):
            continue  # the oracle of the tier
        words += [f"--{str(role).replace('_', '-')}", str(settings[str(role)])]
    beacon, sessions = settings.get("beacon"), ["--sessions", str(settings["sessions_planned"])]
    if beacon:
        words += ["--beacon", str(beacon["text"]), "--beacon-date", str(beacon["date"])]
        words += [*(["--seal", str(seal)] if settings.get("seal") else []), *sessions]
    else:
        words += ["--towns", towns_text(settings["towns"]), *sessions, "--seed", str(settings["seed"])]
    for option, name in (("--max-seconds", "max_seconds"), ("--word-errors", "word_error_rate")):
        if is_given(config, usual, name):
            words += [option, f"{config[name]:g}"]
    if perception := config.get("perception"):
        words += ["--perception", perception]
    if config.get("channel") == ChannelKind.SPEECH != usual.get("channel"):
        words += ["--speech"]
    words += _language_model_options(settings.get("language_models", {}))
    return shlex.join(words)


def usual_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the settings that a rollout has without options for them: those of its tier, or the default ones.

    Those of a tier have its name in the field `tier`, and its towns; no other settings have these fields.
    """
    tier = TIERS.get(str(settings.get("tier")))
    if tier is None:
        return {**{str(role): player.name for role, player in ALL_SCRIPTED.items()}, "config": EnvConfig().record()}
    return {
        str(Role.PARTICIPANT): POOL_SEPARATOR.join(tier.participants),
        str(Role.CO_WIZARD): tier.oracle_player if settings.get("oracle") else ALL_SCRIPTED[Role.CO_WIZARD].name,
        str(Role.AD_WIZARD): tier.ad_wizard,
        "config": (tier.oracle if settings.get("oracle") else tier.config).record(),
        "tier": tier.name,
        "towns": list(tier.towns),
    }


def is_given(config: Mapping[str, Any], usual: Mapping[str, Any], name: str) -> bool:
    """Returns whether time or word errors were given as an option, which replaces the factor or the channel of a tier.

    Args:
        config: settings of the engine of a rollout (`EnvConfig.record`).
        usual: those without options (`usual_settings`).
        name: `max_seconds` or `word_error_rate`.
    """
    replaced = {"max_seconds": "time_factor", "word_error_rate": "channel"}[name]
    return bool(config[name] != usual[name]) or (replaced in usual and replaced not in config)


def _language_model_options(models: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Returns the options of the language models of a rollout, whose settings are the same for all roles."""
    if not models:
        return []
    usual, found = LanguageModelConfig(model="usual", url="http://localhost/v1").record(), next(iter(models.values()))
    words = ["--llm-url", "URL"]
    for option, name in (("--llm-time", "time"), ("--llm-timeout", "timeout"), ("--llm-tokens", "max_tokens")):
        if found[name] != usual[name]:
            words += [option, f"{found[name]}"]
    if found["pictures"]:
        words += ["--llm-pictures"]
    if parameters := found.get("parameters"):
        words += ["--llm-parameters", json.dumps(parameters, sort_keys=True)]
    return words


def parse_towns(text: str) -> tuple[str, ...]:
    """Parses a list of towns: "seen", "development", "validation", "unseen", "all", names or files, with commas.

    "generated" is another town for each session.

    Raises:
        TownError: there is no such town.
        ValueError: the list is empty.
    """
    found: list[str] = []
    for name in split_names(text):
        if name not in _GROUPS and parse_series(name) is None:
            load_town(name)
        found += [town for town in _GROUPS.get(name, (name,)) if town not in found]
    if not found:
        groups = ", ".join(_GROUPS)
        raise ValueError(f"towns is {text!r}; give {groups}, or names separated by commas")
    return tuple(found)


def fold_of_towns(towns: Sequence[str]) -> TownFold | None:
    """Returns the fold to whose list all towns belong, or None."""
    return next((fold for fold, there in FOLD_TOWNS.items() if towns and set(towns) <= set(there)), None)


def towns_text(towns: Sequence[str], separator: str = ",") -> str:
    """Returns towns as `parse_towns` reads them; a fold of generated towns by its name."""
    whole = (TownFold.VALIDATION, TownFold.UNSEEN)
    return next((str(fold) for fold in whole if tuple(towns) == FOLD_TOWNS[fold]), separator.join(towns))


def _seed(seed: int, number: int) -> int:
    return int(np.random.SeedSequence([seed, number, _ROLLOUTS]).generate_state(1)[0] >> 1)


# --- playing --------------------------------------------------------------------------------------------------------

SETTINGS_FILE: Final = "settings.json"
"""Settings of a rollout; a folder with other settings is refused."""


def roll_out(
    settings: RolloutSettings,
    folder: Path | str,
    *,
    workers: int = 1,
    ray: str | None = None,
    on_session: Callable[[int, int], None] | None = None,
    drives: Mapping[str, ReferenceDrive] | None = None,
) -> RolloutResult:
    """Plays the sessions of a rollout, measures them, and writes the result into the folder.

    The result depends neither on the number of workers nor on interruptions: a finished session is measured but not
    played again. An interrupted run writes the result of the sessions finished so far. A session whose policy fails
    becomes a row with an error; the next run plays it again. An endpoint that rejects all calls ends the run.

    Args:
        settings: settings of the rollout.
        folder: folder of sessions and result, created if missing.
        workers: number of processes; more than one needs an importable main module of the caller.
        ray: address of a Ray cluster that replaces the workers; see `dorothie_gym.evaluation.rollout.on_ray`.
        on_session: called with the numbers of finished and of planned sessions, first with 0 and after each session.
        drives: references that were measured before, by `reference_drives.drive_key`; others are measured now.

    Raises:
        ValueError: there are no workers.
        SessionError: the folder contains other files, or another process holds its lock.
        EndpointError: the endpoint of a language model rejects all calls.
        ProcessError: a process died, or there is no such cluster.
        OutputFolderError: the folder was deleted or replaced during the run.
        OSError: the folder cannot be written.
    """
    root, rows = Path(folder), list[RolloutRow]()
    job = SessionJob(
        settings_file=SETTINGS_FILE,
        settings=settings.to_json(),
        config=settings.config,
        cast=settings.players,
        evaluate=_measure,
        keep_errors=True,
        writes_cost=True,
        references=settings.references,
        extra=settings.header_extra,
        drives=drives or {},
    )
    with run_sessions(job, settings.plans(), root, workers=workers, ray=ray, on_session=on_session) as outcomes:
        try:
            for outcome in outcomes:
                plan = outcome.plan
                record, usage = outcome.result or (None, {})
                rows.append(
                    RolloutRow(
                        number=plan.number,
                        town=plan.town,
                        seed=plan.seed,
                        record=record,
                        error=outcome.error,
                        usage=usage,
                        trial=plan.trial,
                        participant=None if plan.participant is None else plan.participant.name,
                    )
                )
        finally:
            result = RolloutResult(settings=settings.to_json(), rows=tuple(sorted(rows, key=lambda row: row.number)))
            write_atomically(root / RESULT_FILE, to_page(result.to_json()))
    return result


def _measure(played: PlayedSession) -> tuple[SessionRecord, SessionUsage]:
    return measure(played.session, played.town), read_usage(played.folder)
