"""Runner of planned sessions: worker processes or a Ray cluster, with resume and cost.

Corpora (`generate_corpus`) and closed-loop evaluation (`roll_out`) differ in their plans and in the result that they
take from each session. Replay checks write no sessions and use the pool below the runner (`processes.run_tasks`).
"""

from __future__ import annotations

import logging
import shutil
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from dorothie_gym.errors import EndpointError, InputFileError, OutputFolderError, ProcessError, SessionError
from dorothie_gym.evaluation.rollout.folder import PARTS_FOLDER, PlannedSession, locked_folder
from dorothie_gym.evaluation.rollout.on_ray import run_on_ray
from dorothie_gym.evaluation.rollout.play import SessionCast, play_as_they_end
from dorothie_gym.evaluation.rollout.processes import run_series
from dorothie_gym.evaluation.rollout.reference_drives import scenario_with_reference
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy import AnyPolicy, BatchPolicy
from dorothie_gym.policies.policy_loader import Player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.files import SessionState, to_page
from dorothie_gym.session.recording.session import Session, session_state
from dorothie_gym.session.scenario import ReferenceDrive, Scenario
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import MAX_SMALL_JSON, checked, read_json

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

COST_FILE: Final = "cost.json"
"""Wall time, processor time and number of workers of a rollout; not part of the result, which is reproducible."""

Plan = TypeVar("Plan", bound=PlannedSession)
Result = TypeVar("Result")

AT_ONCE: Final = 32
"""Largest number of sessions that are played at the same time, see `SessionJob.batches`."""

_LOG = logging.getLogger(__name__)


@dataclass
class SessionMaker:
    """Plays planned sessions; they appear in their folders when they are finished.

    Attributes:
        root: folder of all sessions, locked by `locked_folder`.
        config: settings of the sessions.
        cast: player of each role.
        references: whether scenarios get their reference drives (`reference_drives`).
        extra: further fields of `SessionHeader.extra`.
        drives: references that were measured before, by `reference_drives.drive_key`.
    """

    root: Path
    config: EnvConfig
    cast: Mapping[Role, Player]
    references: bool = False
    extra: Mapping[str, object] = field(default_factory=dict)
    drives: Mapping[str, ReferenceDrive] = field(default_factory=dict)
    _engines: dict[str, list[SessionEngine]] = field(default_factory=dict)
    _shared: dict[tuple[str, Role, SpaceLimits], AnyPolicy] = field(default_factory=dict)
    _scenarios: dict[tuple[str, int], Scenario] = field(default_factory=dict)

    def play(self, plans: Sequence[Plan]) -> Iterator[tuple[Plan, bool]]:
        """Plays sessions at the same time, unless their folders are finished; each is in its folder when it is yielded.

        Args:
            plans: the sessions.

        Yields:
            A session, and whether it is new: first those found finished, then the others as they end.

        Raises:
            SessionError: a folder contains other files.
            OSError: a folder cannot be written, or was deleted.
            ValueError: a policy cannot be made, or its action is malformed; policies may raise other errors.
        """
        new = []
        for plan in plans:
            if self._is_finished(plan):
                yield plan, False
            else:
                new.append(plan)
        seats: Counter[str] = Counter()
        casts = []
        for plan in new:
            casts.append(self._cast(plan, self._engine(plan.town, seats[plan.town])))
            seats[plan.town] += 1
        try:
            for number, _ in play_as_they_end(casts):
                self._publish(new[number])
                yield new[number], True
        except Exception:
            for plan in new:
                shutil.rmtree(self._part(plan), ignore_errors=True)  # a session may be played again by itself
            raise

    def _is_finished(self, plan: PlannedSession) -> bool:
        """Returns whether a session is in its folder; raises `SessionError` if another one or other files are."""
        folder = self.root / plan.path
        if session_state(folder) is SessionState.FINISHED:
            header = Session.load(folder).header
            same_town = header.town in (plan.town, self.engine(plan.town).town_of(plan.seed).name)
            if header.seed != plan.seed or not same_town:
                raise SessionError(f"{folder}: is another session than belongs here; remove it")
            return True
        if folder.is_dir() and any(folder.iterdir()):
            raise SessionError(f"{folder}: is in the way, and no finished session; remove it")
        return False

    def _part(self, plan: PlannedSession) -> Path:
        """Returns the folder of a session in progress."""
        return self.root / PARTS_FOLDER / Path(plan.path).name

    def _publish(self, plan: PlannedSession) -> None:
        """Moves a finished session to its folder."""
        for parent in reversed(Path(plan.path).parents[:-1]):
            (self.root / parent).mkdir(exist_ok=True)
        self._part(plan).rename(self.root / plan.path)

    def _cast(self, plan: PlannedSession, engine: SessionEngine) -> SessionCast:
        """Returns a session to be played by an engine, with an empty folder."""
        players = {**self.cast, **plan.partners}
        policies = {role: self._policy(players[role], role, engine.limits) for role in AGENT_ROLES}
        part = self._part(plan)
        part.mkdir(exist_ok=True)  # without its parents: a series that was deleted during the run is not recreated
        scenario = self._scenario(plan, engine) if self.references else None
        return SessionCast(
            host=engine,
            policies=policies,
            seed=plan.seed,
            folder=part,
            create=False,
            scenario=scenario,
            trial=plan.trial,
            extra=self.extra,
        )

    def _policy(self, player: Player, role: Role, limits: SpaceLimits) -> AnyPolicy:
        """Returns the policy of a role: a `BatchPolicy` is made once for all sessions, another policy once for each."""
        key = player.name, role, limits
        if key in self._shared:
            return self._shared[key]
        policy = player.make(role, limits)
        if isinstance(policy, BatchPolicy):
            self._shared[key] = policy
        return policy

    def _scenario(self, plan: PlannedSession, engine: SessionEngine) -> Scenario:
        """Returns the scenario of a session with its reference, which is measured once for all trials."""
        key = plan.town, plan.seed
        if key not in self._scenarios:
            self._scenarios[key] = scenario_with_reference(engine, plan.seed, self.drives)
        return self._scenarios[key]

    def engine(self, town: str) -> SessionEngine:
        """Returns an engine of a town, which is created once."""
        return self._engine(town, 0)

    def _engine(self, town: str, number: int) -> SessionEngine:
        """Returns the engine of the session of a number among those of a town that are played at the same time."""
        engines = self._engines.setdefault(town, [])
        while len(engines) <= number:
            engines.append(SessionEngine(town, config=self.config))
        return engines[number]


@dataclass(frozen=True, kw_only=True)
class PlayedSession:
    """Finished session of a series.

    Attributes:
        session: the record.
        folder: folder of the session.
        root: folder of the series.
        maker: maker of the session, which keeps towns.
        plan: its plan.
    """

    session: Session
    folder: Path
    root: Path
    maker: SessionMaker
    plan: PlannedSession

    @property
    def town(self) -> Town:
        """Town of the session."""
        return self.maker.engine(self.plan.town).town_of(self.plan.seed)


@dataclass(frozen=True, kw_only=True)
class SessionOutcome(Generic[Plan, Result]):
    """Outcome of one planned session.

    Attributes:
        plan: the plan.
        result: value that the job takes from the session; None after an error.
        error: error of the session, if the job keeps errors.
        played: whether the session was played in this run; False if it was found finished.
        cpu_seconds: processor time of playing and evaluation [s].
    """

    plan: Plan
    result: Result | None = None
    error: str | None = None
    played: bool
    cpu_seconds: float

    @property
    def success(self) -> Result:
        """The result; raises `ProcessError` after an error."""
        if self.result is None:
            raise ProcessError(f"{self.plan}: {self.error or 'the job has taken no result from the session'}")
        return self.result


@dataclass(frozen=True, kw_only=True)
class SessionJob(Generic[Result]):
    """Series of sessions in one folder.

    Attributes:
        settings_file: name of the file with the settings that determine the sessions.
        settings: content of that file, in JSON types; a folder with other settings is refused.
        config: settings of the engine.
        cast: player of each role.
        evaluate: takes the result from a finished session; must be picklable.
        keep_errors: whether an error of a session becomes its outcome; otherwise it ends the run.
        writes_cost: whether time and workers are added up in `COST_FILE`.
        references: whether scenarios get their reference drives.
        extra: further fields of `SessionHeader.extra`.
        drives: references that were measured before, by `reference_drives.drive_key`.
    """

    settings_file: str
    settings: Mapping[str, object]
    config: EnvConfig
    cast: Mapping[Role, Player]
    evaluate: Callable[[PlayedSession], Result]
    keep_errors: bool = False
    writes_cost: bool = False
    references: bool = False
    extra: Mapping[str, object] = field(default_factory=dict)
    drives: Mapping[str, ReferenceDrive] = field(default_factory=dict)

    def batches(self, plans: Sequence[Plan], workers: int) -> list[PlanBatch[Plan]]:
        """Returns the sessions that are played at the same time: several where a policy may decide for all.

        Those of a language model are played one by one, so that an error or Ctrl-C loses the calls of one session only.

        Args:
            plans: the sessions.
            workers: number of processes among which they are divided.
        """
        players = [*self.cast.values(), *(player for plan in plans for player in plan.partners.values())]
        paid = any(player.language_model is not None for player in players)
        most = AT_ONCE if not paid and any(player.may_batch for player in players) else 1
        size = min(most, max(1, len(plans) // workers))
        return [PlanBatch(plans[first : first + size]) for first in range(0, len(plans), size)]


@contextmanager
def run_sessions(
    job: SessionJob[Result],
    plans: Sequence[Plan],
    root: Path,
    *,
    workers: int = 1,
    ray: str | None = None,
    on_session: Callable[[int, int], None] | None = None,
) -> Iterator[Iterator[SessionOutcome[Plan, Result]]]:
    """Yields an iterator over the outcomes of planned sessions, which plays them as it is read.

    The folder is locked as long as the block lasts. A session appears in the folder when it is finished; a finished
    session is evaluated but not played again. The outcomes arrive in any order and depend neither on the number of
    workers nor on earlier interruptions. When the block is left early, the workers are killed.

    Args:
        job: the series.
        plans: its sessions.
        root: folder of the series, created if missing.
        workers: number of processes; more than one needs an importable main module of the caller.
        ray: address of a Ray cluster that replaces the workers; see `on_ray`.
        on_session: called with the numbers of finished and of planned sessions, first with 0 and after each session.

    Raises:
        ValueError: there are no workers.
        SessionError: the folder contains other files, or another process holds its lock.
        EndpointError: the endpoint of a language model rejects all calls.
        ProcessError: a session failed in another process, a process died, or the cluster cannot be reached.
        OutputFolderError: the folder was deleted or replaced during the run.
        OSError: the folder cannot be written.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; it must be at least 1")
    report = on_session or _no_report
    begun, spent = time.perf_counter(), 0.0
    prepare = partial(_SessionTask, job=replace(job, cast=dict(job.cast)))  # constants are proxies: not picklable

    def played() -> Iterator[SessionOutcome[Plan, Result]]:
        if ray is not None:
            yield from run_on_ray(prepare, plans, root, address=ray)
            return
        yield from run_series(partial(_BatchTask, root, prepare), job.batches(plans, workers), workers=workers)

    def outcomes() -> Generator[SessionOutcome[Plan, Result], None, None]:
        nonlocal spent
        report(0, len(plans))
        for number, outcome in enumerate(played(), start=1):
            spent += outcome.cpu_seconds
            yield outcome
            report(number, len(plans))

    with locked_folder(root, job.settings_file, job.settings), closing(outcomes()) as iterator:
        try:
            yield iterator
        finally:
            if job.writes_cost:
                _add_cost(root / COST_FILE, time.perf_counter() - begun, spent, workers)


class _SessionTask(Generic[Result]):
    """Plays and evaluates sessions in one process."""

    def __init__(self, root: Path, *, job: SessionJob[Result]) -> None:
        self._root, self._job = root, job
        self._maker = SessionMaker(root, job.config, job.cast, job.references, job.extra, job.drives)

    def __call__(self, plan: Plan) -> SessionOutcome[Plan, Result]:
        begun = time.process_time()
        try:
            ((_, played),) = self._maker.play([plan])
        except _ERRORS_OF_RUN:
            raise
        except Exception as error:
            if not self._job.keep_errors:
                raise
            text = f"{type(error).__name__}: {error}"
            return SessionOutcome(plan=plan, error=text, played=True, cpu_seconds=time.process_time() - begun)
        return self._outcome(plan, played, time.process_time() - begun)

    def together(self, plans: Sequence[Plan]) -> Iterator[SessionOutcome[Plan, Result]]:
        """Plays sessions at the same time; where one of them fails, those that have not ended are played one by one.

        The processor time of a session is that since the one that ended before it.
        """
        left, begun, sessions = list(plans), time.process_time(), self._maker.play(plans)
        while left:
            try:
                plan, new = next(sessions)
            except _ERRORS_OF_RUN:
                raise
            except Exception:
                _LOG.debug("one of %d sessions failed; they are played one by one", len(left), exc_info=True)
                yield from map(self, left)
                return
            left.remove(plan)
            yield self._outcome(plan, new, time.process_time() - begun)
            begun = time.process_time()

    def _outcome(self, plan: Plan, played: bool, seconds: float) -> SessionOutcome[Plan, Result]:
        """Evaluates a finished session; playing it took a processor time [s], if it is new."""
        begun, folder = time.process_time(), self._root / plan.path
        session = Session.load(folder)
        found = PlayedSession(session=session, folder=folder, root=self._root, maker=self._maker, plan=plan)
        result = self._job.evaluate(found)
        cost = seconds + time.process_time() - begun
        return SessionOutcome(plan=plan, result=result, played=played, cpu_seconds=cost)


class _BatchTask(Generic[Result]):
    """Plays and evaluates batches of sessions in one process."""

    def __init__(self, root: Path, prepare: Callable[[Path], _SessionTask[Result]]) -> None:
        self._task = prepare(root)

    def __call__(self, plans: PlanBatch[Plan]) -> Iterator[SessionOutcome[Plan, Result]]:
        return iter((self._task(plans[0]),)) if len(plans) == 1 else self._task.together(plans)


class PlanBatch(tuple[Plan, ...]):
    """Sessions that are played at the same time."""

    __slots__ = ()

    def __str__(self) -> str:
        return ", ".join(map(str, self))


_ERRORS_OF_RUN: Final = (SessionError, OutputFolderError, EndpointError, OSError)
"""Errors of the folder or of an endpoint, not of a session."""


def _no_report(finished: int, planned: int) -> None:
    """Reports nothing."""


def _add_cost(file: Path, wall: float, processor: float, workers: int) -> None:
    """Adds the cost of a run to that of the runs before; a file that cannot be read counts as none."""
    try:
        before = checked(read_json(file, MAX_SMALL_JSON), dict[str, float], file)
        wall, processor = wall + before["wall_seconds"], processor + before["cpu_seconds"]
    except (FileNotFoundError, InputFileError, KeyError):
        _LOG.debug("%s: no earlier cost; a new file is written", file)
    cost = {"wall_seconds": round(wall, 3), "cpu_seconds": round(processor, 3), "workers": workers}
    write_atomically(file, to_page(cost))
