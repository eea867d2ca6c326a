"""Check of one session of a rollout: its files, header, end and measures, and the session played again from its seed.

A session follows from town, seed, settings and players. Town, seed and settings are those of the protocol, not those
that the session states, and the players of the protocol choose their actions again. The recordings must be equal.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.archive.comparison import first_difference
from dorothie_gym.errors import DorothieGymError, SessionError, one_line, short_repr
from dorothie_gym.evaluation.closed_loop.results import RolloutRow
from dorothie_gym.evaluation.closed_loop.running import RolloutPlan
from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord, measure
from dorothie_gym.evaluation.closed_loop.task_progress import task_at_end
from dorothie_gym.evaluation.closed_loop.usage import read_usage
from dorothie_gym.evaluation.rollout.play import USAGE_FILE, play_session, with_extra, with_personas
from dorothie_gym.evaluation.rollout.recorded_policy import RecordedPolicy, recorded_persona
from dorothie_gym.evaluation.rollout.reference_drives import scenario_with_reference
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy
from dorothie_gym.session.config import ChannelKind
from dorothie_gym.session.recording.events import EndReason, EventType
from dorothie_gym.session.recording.files import (
    ACTIONS_FILE,
    AUDIO_FOLDER,
    EVENTS_FILE,
    FRAMES_FILE,
    HEADER_FILE,
    SessionState,
    same_json,
)
from dorothie_gym.session.recording.session import Session, session_state
from dorothie_gym.session.session_engine import SessionEngine

if TYPE_CHECKING:
    from dorothie_gym.evaluation.closed_loop.running import RolloutSettings
    from dorothie_gym.policies.policy_loader import Player
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.scenario import ReferenceDrive, Scenario

_FILES: Final = frozenset({HEADER_FILE, EVENTS_FILE, ACTIONS_FILE, FRAMES_FILE})
"""Files of every session of a rollout."""


@dataclass(frozen=True, kw_only=True)
class SessionTask:
    """Session to be checked.

    Attributes:
        plan: session of the protocol.
        row: its row in the result; None if it has none.
        simulated: whether the session is simulated again.
    """

    plan: RolloutPlan
    row: RolloutRow | None
    simulated: bool

    def __str__(self) -> str:
        return str(self.plan)


@dataclass(frozen=True, kw_only=True)
class SessionFindings:
    """Findings about a session.

    Attributes:
        number: number of the session in the rollout.
        faults: faults, one line each.
        digest: SHA-256 of its content; None if it could not be read.
        simulated: whether it was played again and found equal.
        has_persona: whether its header has a persona of a role whose policy cannot be played again.
    """

    number: int
    faults: tuple[str, ...]
    digest: str | None = None
    simulated: bool = False
    has_persona: bool = False


class SessionChecker:
    """Checks the sessions of a rollout, one after the other.

    Args:
        root: folder of the rollout.
        settings: settings of the protocol.
        cast: players that are played again, beside those of the pool. The other roles take their recorded actions.
        drives: references that the receiver has measured, by `reference_drives.drive_key`; others are measured now.
    """

    def __init__(
        self,
        root: Path,
        settings: RolloutSettings,
        cast: Mapping[Role, Player],
        drives: Mapping[str, ReferenceDrive],
    ) -> None:
        self._root, self._config, self._cast = root, settings.config, dict(cast)
        self._references, self._extra, self._drives = settings.references, settings.header_extra, drives
        self._engines: dict[str, SessionEngine] = {}
        self._policies: dict[tuple[str, Role, str], AnyPolicy] = {}
        self._scenarios: dict[tuple[str, int], Scenario] = {}

    def __call__(self, task: SessionTask) -> SessionFindings:
        """Returns the findings about a session; the first kind of fault ends its check."""
        plan = task.plan
        found = SessionFindings(number=plan.number, faults=())
        try:
            row, record = self._row(task)
            session = self._load(plan, row)
            found = replace(
                found,
                digest=session.digest,
                has_persona=any(recorded_persona(session, role) for role in AGENT_ROLES if role not in self._cast),
            )
            self._check_header(plan, session)
            _check_end(session, self._engine(plan.town).session.seconds_allowed)
            if task.simulated:
                self._play_again(plan, session)
                found = replace(found, simulated=True)
            faults = tuple(f"{plan}: {fault}" for fault in self._differences(plan, session, row, record))
        except DorothieGymError as error:
            faults = (f"{plan}: {error}",)
        return replace(found, faults=faults)

    # --- Row and files ------------------------------------------------------------------------------------------------

    def _row(self, task: SessionTask) -> tuple[RolloutRow, SessionRecord]:
        plan, row = task.plan, task.row
        if row is None:
            raise SessionError("has no row")
        if (row.town, row.seed) != (plan.town, plan.seed):
            raise SessionError(f"its row is of {one_line(row.town)}, seed {row.seed}")
        if row.trial != plan.trial:
            raise SessionError(f"its row is of trial {row.trial}, not of {plan.trial}")
        partner = None if plan.participant is None else plan.participant.name
        if row.participant != partner:
            raise SessionError(f"its row has the participant {short_repr(row.participant)}, not {partner}")
        if row.record is None:
            if session_state(self._root / plan.path) is SessionState.FINISHED:
                raise SessionError("its row has an error, but the session is finished")
            raise SessionError(
                f"ended in an error ({one_line(row.error, 120)}); a submission has complete sessions only: mend the "
                "policy and run the rollout again, which plays this session again"
            )
        if surplus := sorted(row.usage.keys() - {str(Role.CO_WIZARD)}):
            raise SessionError(f"its row has a usage of {surplus[0]}, whose policy has none")
        return row, row.record

    def _load(self, plan: RolloutPlan, row: RolloutRow) -> Session:
        folder = self._root / plan.path
        if session_state(folder) is not SessionState.FINISHED:
            raise SessionError(f"{folder}: holds no finished session")
        session = Session.load(folder)
        if not session.complete:
            raise SessionError("is not complete: its header counts other events or frames than there are")
        if session.decisions is None:
            raise SessionError(f"has no {ACTIONS_FILE}; it cannot be played again")
        self._check_files(folder, session, row)
        return session

    def _check_files(self, folder: Path, session: Session, row: RolloutRow) -> None:
        known = set(_FILES)
        if row.usage and Role.CO_WIZARD not in self._cast:
            known.add(USAGE_FILE)
        if self._config.channel is ChannelKind.SPEECH:
            named = {str(event.data["audio"]) for event in session.events if "audio" in event.data}
            _check_names(folder / AUDIO_FOLDER, named)
            known |= {AUDIO_FOLDER} if named else set()
        _check_names(folder, known)

    # --- What follows from town, seed and settings --------------------------------------------------------------------

    def _engine(self, town: str) -> SessionEngine:
        if town not in self._engines:
            self._engines[town] = SessionEngine(town, config=self._config)
        return self._engines[town]

    def _policies_of(self, plan: RolloutPlan, session: Session) -> dict[Role, AnyPolicy]:
        engine, policies = self._engine(plan.town), dict[Role, AnyPolicy]()
        cast = {**self._cast, **plan.partners}
        for role in AGENT_ROLES:
            if role not in cast:
                policies[role] = RecordedPolicy(session, role, frames=self._config.frames, limits=engine.limits)
                continue
            key = (plan.town, role, cast[role].name)
            if key not in self._policies:
                self._policies[key] = cast[role].make(role, engine.limits)
            policies[role] = self._policies[key]
        return policies

    def _scenario(self, plan: RolloutPlan) -> Scenario | None:
        """Returns the scenario of a session with its reference, which is measured again; None without references."""
        if not self._references:
            return None
        key = plan.town, plan.seed
        if key not in self._scenarios:
            self._scenarios[key] = scenario_with_reference(self._engine(plan.town), plan.seed, self._drives)
        return self._scenarios[key]

    def _check_header(self, plan: RolloutPlan, session: Session) -> None:
        engine, header = self._engine(plan.town), session.header
        if (header.town, header.seed) != (engine.town_of(plan.seed).name, plan.seed):
            raise SessionError(f"the session is of {header.town}, seed {header.seed}")
        if not same_json(header.config, self._config.record()):
            raise SessionError("the session has other settings than the rollout")
        policies, scenario = self._policies_of(plan, session), self._scenario(plan)
        if scenario is None:
            engine.reset(seed=plan.seed)
        else:
            engine.reset(scenario=scenario)
        states = {
            role: policies[role].initial_state(policy_seed(plan.seed, role, plan.trial), engine.town)
            for role in AGENT_ROLES
        }
        drawn = with_personas(with_extra(engine.session_header(), self._extra), policies, states)
        difference = first_difference(_only_header(session, header), _only_header(session, drawn))
        if difference is not None:
            raise SessionError(f"its header is not what its seed gives: {difference}")
        if not same_json(header.to_json(), drawn.to_json()):
            raise SessionError(f"was recorded by version {header.package_version}, format {header.format_version}")

    def _play_again(self, plan: RolloutPlan, session: Session) -> None:
        """Raises `SessionError` if the session, played again, is not the recorded one."""
        with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
            try:
                play_session(
                    self._engine(plan.town),
                    self._policies_of(plan, session),
                    seed=plan.seed,
                    folder=Path(folder) / "s",
                    scenario=self._scenario(plan),
                    trial=plan.trial,
                    extra=self._extra,
                )
            except OSError:
                raise  # of the temporary folder
            except Exception as error:  # recorded actions are the submitter's, and so are the failures they cause
                raise SessionError(f"cannot be played again: {type(error).__name__}: {one_line(error)}") from error
            again = Session.load(Path(folder) / "s")
            difference = first_difference(session, again, strict=True)
            if difference is not None:
                raise SessionError(f"simulated again, it differs at {difference}")
            if session.digest != again.digest:
                raise SessionError("simulated again, its content has another hash")
            if session.report.to_json() != again.report.to_json():
                raise SessionError("its files have parts that no session has; `dorothie-gym show` names them")
            for name, audio in again.audio.items():
                if session.audio[name].read_bytes() != audio.read_bytes():
                    raise SessionError(f"simulated again, {AUDIO_FOLDER}/{name} differs")

    # --- Measures -----------------------------------------------------------------------------------------------------

    def _differences(
        self, plan: RolloutPlan, session: Session, row: RolloutRow, record: SessionRecord
    ) -> Iterator[str]:
        """Yields differences between the row and the measures of the session."""
        try:
            measured = measure(session, self._engine(plan.town).town_of(plan.seed)).to_json()
        except Exception as error:  # a session that was not simulated again may contain anything
            raise SessionError(f"cannot be measured: {type(error).__name__}: {one_line(error)}") from error
        given: Mapping[str, object] = record.to_json()
        wanted: Mapping[str, object] = measured
        for name in {**wanted, **given}:
            if not same_json(wanted.get(name), given.get(name)):
                yield f"{name} is {given.get(name)!r}; the session has {wanted.get(name)!r}"
        if read_usage(self._root / plan.path) != dict(row.usage):
            yield "the usage of language models is not that recorded beside the session"


def _check_names(folder: Path, known: set[str]) -> None:
    """Raises `SessionError` if a folder has other files than the known ones."""
    found = {path.name for path in folder.iterdir()} if folder.is_dir() else set[str]()
    if surplus := sorted(found - known):
        raise SessionError(f"{folder / surplus[0]}: is no part of a session, and nothing checks it; remove it")
    if missing := sorted(known - found):
        raise SessionError(f"{folder / missing[0]}: is missing")


def _check_end(session: Session, seconds: float) -> None:
    """Raises `SessionError` unless a session arrived or ran out of time, which is at least a number of seconds."""
    ends = session.of_type(EventType.END)
    if len(ends) != 1 or session.events[-1] is not ends[0]:
        raise SessionError(f"has {len(ends)} events of type {EventType.END}; a session has one, which is its last")
    reason, last = ends[0].data.get("reason"), session.duration
    frames = session.trajectory["frame"]
    if not len(frames) or frames[-1] != ends[0].frame or frames[-1] - frames[0] + 1 != len(frames):
        raise SessionError(f"its {len(frames)} frames do not run to its end at {last:g} s")
    if (session.summary or {}).get("reason") != reason:
        raise SessionError(f"its last event has the reason {short_repr(reason)}, its outcome another one")
    if reason == EndReason.OUT_OF_TIME:
        if last < seconds - 1e-9:
            raise SessionError(f"ran out of time after {last:g} s; the time of the protocol is {seconds:g} s")
    elif reason != EndReason.ARRIVED:
        raise SessionError(
            f"ended for the reason {short_repr(reason)}; a session of a submission ends when the car has arrived, or "
            f"after {seconds:g} s"
        )
    elif not task_at_end(session).done:
        raise SessionError("ended by arrival, but not all subgoals were reached")


def _only_header(session: Session, header: SessionHeader) -> Session:
    return Session(header=header, events=(), trajectory=session.trajectory[:0], name=session.name)
