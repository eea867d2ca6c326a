"""Runner of planned sessions: worker processes or a Ray cluster, with resume and cost.

Corpora (`generate_corpus`) and closed-loop evaluation (`roll_out`) differ in their plans and in the result that they
take from each session. Replay checks write no sessions and use the pool below the runner (`processes.run_tasks`).
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from dorothie_gym.errors import EndpointError, InputFileError, OutputFolderError, ProcessError, SessionError
from dorothie_gym.evaluation.rollout.folder import PARTS_FOLDER, PlannedSession, locked_folder
from dorothie_gym.evaluation.rollout.on_ray import run_on_ray
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.evaluation.rollout.reference_drives import reference_of
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy_loader import Player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.files import SessionState, to_page
from dorothie_gym.session.recording.session import Session, session_state
from dorothie_gym.session.scenario import Scenario, draw_scenario
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import MAX_SMALL_JSON, checked, read_json

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

COST_FILE: Final = "cost.json"
"""Wall time, processor time and number of workers of a rollout; not part of the result, which is reproducible."""

Plan = TypeVar("Plan", bound=PlannedSession)
Result = TypeVar("Result")

_LOG = logging.getLogger(__name__)


@dataclass
class SessionMaker:
    """Plays planned sessions one after the other; each appears in its folder when it is finished.

    Attributes:
        root: folder of all sessions, locked by `locked_folder`.
        config: settings of the sessions.
        cast: player of each role.
        references: whether scenarios get their reference drives (`reference_drives`).
    """

    root: Path
    config: EnvConfig
    cast: Mapping[Role, Player]
    references: bool = False
    _engines: dict[str, SessionEngine] = field(default_factory=dict)
    _scenarios: dict[tuple[str, int], Scenario] = field(default_factory=dict)

    def __call__(self, plan: PlannedSession) -> tuple[Session, Path, bool]:
        """Plays a session unless its folder is finished; returns the session, its folder, and whether it is new.

        Raises:
            SessionError: the folder contains other files.
            OSError: the folder cannot be written, or was deleted.
            ValueError: a policy cannot be made, or its action is malformed; policies may raise other errors.
        """
        folder = self.root / plan.path
        if session_state(folder) is SessionState.FINISHED:
            session = Session.load(folder)
            there = session.header.town
            same_town = there == plan.town or there == self.engine(plan.town).town_of(plan.seed).name
            if session.header.seed != plan.seed or not same_town:
                raise SessionError(f"{folder}: is another session than belongs here; remove it")
            return session, folder, False
        if folder.is_dir() and any(folder.iterdir()):
            raise SessionError(f"{folder}: is in the way, and no finished session; remove it")
        part = self.root / PARTS_FOLDER / folder.name
        engine = self.engine(plan.town)
        cast = {**self.cast, **plan.partners}
        policies = {role: cast[role].make(role, engine.limits) for role in AGENT_ROLES}
        part.mkdir(exist_ok=True)  # without its parents: a series that was deleted during the run is not recreated
        scenario = self._scenario(plan, engine) if self.references else None
        play_session(engine, policies, seed=plan.seed, folder=part, create=False, scenario=scenario, trial=plan.trial)
        session = Session.load(part)
        for parent in reversed(Path(plan.path).parents[:-1]):
            (self.root / parent).mkdir(exist_ok=True)
        part.rename(folder)
        return session, folder, True

    def _scenario(self, plan: PlannedSession, engine: SessionEngine) -> Scenario:
        """Returns the scenario of a session with its reference, which is measured once for all trials."""
        key = plan.town, plan.seed
        if key not in self._scenarios:
            town = engine.town_of(plan.seed)
            drawn = draw_scenario(town, engine.template, plan.seed, self.config.stops, self.config.talk)
            self._scenarios[key] = replace(drawn, reference=reference_of(town, drawn))
        return self._scenarios[key]

    def engine(self, town: str) -> SessionEngine:
        """Returns the engine of a town, which is created once."""
        if town not in self._engines:
            self._engines[town] = SessionEngine(town, config=self.config)
        return self._engines[town]


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
    """

    settings_file: str
    settings: Mapping[str, object]
    config: EnvConfig
    cast: Mapping[Role, Player]
    evaluate: Callable[[PlayedSession], Result]
    keep_errors: bool = False
    writes_cost: bool = False
    references: bool = False


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

    def outcomes() -> Generator[SessionOutcome[Plan, Result], None, None]:
        nonlocal spent
        report(0, len(plans))
        played = (
            run_tasks(partial(prepare, root), plans, workers=workers)
            if ray is None
            else run_on_ray(prepare, plans, root, address=ray)
        )
        for number, outcome in enumerate(played, start=1):
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
        self._maker = SessionMaker(root, job.config, job.cast, job.references)

    def __call__(self, plan: Plan) -> SessionOutcome[Plan, Result]:
        begun = time.process_time()
        try:
            session, folder, played = self._maker(plan)
        except (SessionError, OutputFolderError, EndpointError, OSError):
            raise  # errors of the folder or of the endpoint, not of the session
        except Exception as error:
            if not self._job.keep_errors:
                raise
            text = f"{type(error).__name__}: {error}"
            return SessionOutcome(plan=plan, error=text, played=True, cpu_seconds=time.process_time() - begun)
        found = PlayedSession(session=session, folder=folder, root=self._root, maker=self._maker, plan=plan)
        result = self._job.evaluate(found)
        return SessionOutcome(plan=plan, result=result, played=played, cpu_seconds=time.process_time() - begun)


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
