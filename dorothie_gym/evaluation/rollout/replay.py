"""Replay of recorded sessions from their seed and actions, and comparison with the record."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from dorothie_gym._version import __version__
from dorothie_gym.archive.comparison import Difference, first_difference
from dorothie_gym.errors import SessionError, StoryboardError, TownError
from dorothie_gym.evaluation.rollout.play import PERSONAS, pitches_of
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.maps.catalogue import find_town, load_town
from dorothie_gym.session.config import ChannelKind, EnvConfig
from dorothie_gym.session.recorder import SessionRecorder, expand, idle_actions
from dorothie_gym.session.recording.events import EndReason, EventType
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.recording.writer import SessionWriter
from dorothie_gym.session.scenario import Scenario, draw_scenario, recorded_reference
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import ActionDict
from dorothie_gym.session.spaces.observations import Observation
from dorothie_gym.speech.synthesizer import HIGHEST_PITCH, LOWEST_PITCH
from dorothie_gym.support.input_files import checked, raising
from dorothie_gym.tasks.parsing import is_template_name, load_template

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import CorpusEntry
    from dorothie_gym.maps.town import Town
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.tasks.storyboard import StoryboardTemplate

Observations: TypeAlias = Mapping[str, Observation]
"""Observation of each agent."""

Actions: TypeAlias = Mapping[str, ActionDict]
"""Action of each agent."""


def resimulate(session: Session, town: Town, *, storyboard: StoryboardTemplate | None = None) -> Session:
    """Simulates a session again: the world from its seed, the roles from their recorded actions.

    Args:
        session: session that this package has recorded, complete or interrupted; it is simulated to its last frame.
        town: town of the session.
        storyboard: template of the storyboard, if it is not shipped.

    Returns:
        The new record; `first_difference` compares the two.

    Raises:
        SessionError: the session has no recorded actions, the seed gives another session in this town, or an action is
            malformed.
    """
    engine = begin_replay(session, town, storyboard=storyboard)
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
        # personas belong to the policies, which are not played
        header = replace(engine.session_header(), extra=session.header.extra)
        with SessionWriter(Path(folder) / "again", header) as writer:
            recorder = SessionRecorder(engine, writer)
            for actions in recorded_actions(engine, session):
                _step(engine, session, actions)
                recorder.record(actions)
            reason = _broken_off(session)
            if reason is not None and not engine.over:
                engine.break_off(reason)
                recorder.record_end()
            if engine.over:
                writer.finish(engine.summary())
        return _with_recordings(Session.load(Path(folder) / "again"), session)


def _with_recordings(again: Session, session: Session) -> Session:
    """Returns a replay whose dialogue moves name the recordings of people, who are not played, as the record does.

    Audio of the channel is recreated, with its names.
    """
    if config_of(session.header).channel is ChannelKind.SPEECH:
        return again
    audio = {index: event.data["audio"] for index, event in enumerate(session.events) if "audio" in event.data}
    events = list(again.events)
    for index, name in audio.items():
        if index < len(events) and events[index].type is EventType.DIALOGUE_MOVE:
            events[index] = replace(events[index], data={**events[index].data, "audio": name})
    return replace(again, events=tuple(events))


def watch_session(
    session: Session, town: Town, *, storyboard: StoryboardTemplate | None = None
) -> Iterator[tuple[Observations, Actions]]:
    """Simulates a session again, and yields the observations and the actions of the roles at each decision.

    Args:
        session: session that this package has recorded.
        town: town of the session.
        storyboard: template of the storyboard, if it is not shipped.

    Raises:
        SessionError: see `resimulate`.
    """
    engine = begin_replay(session, town, storyboard=storyboard)
    for actions in recorded_actions(engine, session):
        observations = engine.observations.of()
        _step(engine, session, actions)
        yield observations, actions


def begin_replay(session: Session, town: Town, *, storyboard: StoryboardTemplate | None = None) -> SessionEngine:
    """Returns an engine in the state in which a session began; `recorded_actions` then returns its actions.

    Args:
        session: session that this package has recorded, complete or interrupted.
        town: town of the session.
        storyboard: template of the storyboard, if it is not shipped.

    Raises:
        SessionError: see `resimulate`.
    """
    if session.decisions is None:
        raise SessionError(f"{session.name}: what the roles decided was not recorded; it cannot be played again")
    seed = session.header.seed
    if seed is None:
        raise SessionError(f"{session.name}: has no seed; it cannot be played again")
    config = config_of(session.header)
    engine = SessionEngine(town, config=config, max_cycles=_cycles(session, config))
    scenario = _scenario(session, seed, town, storyboard)
    engine.reset(scenario=replace(scenario, reference=recorded_reference(session.header)))
    engine.session.dialogue.give_voices(_voices(session))
    return engine


def _voices(session: Session) -> dict[Role, float]:
    """Returns the pitch of each voice; raises `SessionError` if the record has one that no voice can have."""
    pitches = pitches_of(session.header.extra.get(PERSONAS))
    for role, pitch in pitches.items():
        if not LOWEST_PITCH <= pitch <= HIGHEST_PITCH:
            raise SessionError(
                f"{session.name}: {PERSONAS}.{role}.pitch is {pitch}; it must be in {LOWEST_PITCH}..{HIGHEST_PITCH}"
            )
    return pitches


def recorded_actions(engine: SessionEngine, session: Session) -> Iterator[Actions]:
    """Yields the recorded actions at each decision, as long as there is a recorded frame after it."""
    decided = {decision.frame: decision for decision in session.decisions or ()}
    idle = idle_actions(engine.limits)
    last = int(session.trajectory["frame"][-1]) if len(session.trajectory) else 0
    world = engine.session.world
    while not engine.over and world.frame < last:
        decision = decided.get(world.frame)
        yield idle if decision is None else expand(decision, engine.limits)


def _step(engine: SessionEngine, session: Session, actions: Actions) -> None:
    frame = engine.session.world.frame
    try:
        engine.step(actions)
    except ValueError as error:
        raise SessionError(f"{session.name}: decision at frame {frame}: {error}") from None


def _broken_off(session: Session) -> EndReason | None:
    """Returns the reason for which people ended the session early; None if it ended by itself or has not ended."""
    given = (session.summary or {}).get("reason")
    return next((reason for reason in EndReason if reason.breaks_off and reason.value == given), None)


def _cycles(session: Session, config: EnvConfig) -> int | None:
    """Returns the number of decisions after which the session was truncated, where its configuration does not say."""
    summary = session.summary or {}
    if not session.complete or summary.get("reason") != EndReason.OUT_OF_TIME or not len(session.trajectory):
        return None
    return max(int(session.trajectory["frame"][-1]) // config.frames, 1)


def _scenario(session: Session, seed: int, town: Town, storyboard: StoryboardTemplate | None) -> Scenario:
    """Returns the scenario of the session, drawn again with a drawn storyboard or with a given one."""
    header = session.header
    templates: list[StoryboardTemplate | None] = [storyboard]
    if storyboard is None and is_template_name(header.storyboard):
        templates.append(load_template(header.storyboard))
    config = config_of(header)
    drawn = [
        draw_scenario(town, template, seed, config.stops, config.talk, config.storyboards) for template in templates
    ]
    for scenario in drawn:
        if _fits(scenario, header):
            return scenario
    if storyboard is None and not is_template_name(header.storyboard):
        raise SessionError(f"{session.name}: the storyboard {header.storyboard!r} is not shipped; give its file")
    return drawn[-1]  # the comparison reports the difference of the headers


def _fits(scenario: Scenario, header: SessionHeader) -> bool:
    board = scenario.storyboard
    return (
        board.name == header.storyboard
        and tuple(name.label for name in scenario.street_names) == tuple(header.street_names)
        and tuple(scenario.departure) == tuple(header.departure)
        and [(mark.lane, mark.station) for mark in board.landmarks]
        == [(row["lane"], row["station"]) for row in header.landmarks]
        and [goal.description for goal in board.subgoals] == [row["description"] for row in header.subgoals]
    )


def config_of(header: SessionHeader) -> EnvConfig:
    """Returns the configuration in a header."""
    with raising(SessionError):
        return checked(dict(header.config), EnvConfig, "header, config")


# --- Checks ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class ReplaySources:
    """Maps and storyboard for sessions whose maps and storyboard are not shipped.

    Attributes:
        town: name or file of the town of all sessions; None takes the town that each session names.
        maps: folder with maps of towns that are not shipped.
        storyboard: file of the storyboard; None takes the one that each session names.
    """

    town: str | None = None
    maps: Path | None = None
    storyboard: Path | None = None

    def town_of(self, session: Session) -> Town:
        """Returns the town of a session.

        Raises:
            SessionError: the town is neither shipped nor given.
            TownError: a given town cannot be read.
        """
        if self.town is not None:
            return load_town(self.town)
        found = find_town(session.header.town, self.maps)
        if found is None:
            raise SessionError(
                f"{session.name}: its town {session.header.town!r} is not shipped; give --town FILE, or --maps DIR"
            )
        return found


@dataclass(frozen=True, kw_only=True)
class ReplayCheck:
    """Comparison of a session with its replay.

    Attributes:
        session: name of the session.
        complete: whether the session was recorded to its end.
        frames: number of recorded frames.
        decisions: number of recorded decisions.
        recorded_by: version of the package that recorded the session.
        difference: first difference; None if the replay is equal.
        wall_seconds: time that the replay took [s].
    """

    session: str
    complete: bool
    frames: int
    decisions: int
    recorded_by: str
    difference: Difference | None
    wall_seconds: float

    @property
    def equal(self) -> bool:
        """Whether the replay equals the record."""
        return self.difference is None

    def to_json(self) -> dict[str, object]:
        """Returns the fields in JSON types, with `equal` and the version that replayed the session."""
        return {
            "session": self.session,
            "equal": self.equal,
            "complete": self.complete,
            "frames": self.frames,
            "decisions": self.decisions,
            "recorded_by": self.recorded_by,
            "replayed_by": __version__,
            "difference": None if self.difference is None else asdict(self.difference),
            "wall_seconds": self.wall_seconds,
        }


def check_replays(
    entries: Sequence[CorpusEntry], sources: ReplaySources | None = None, *, workers: int = 1
) -> Iterator[ReplayCheck]:
    """Yields the check of each session, in their order.

    Args:
        entries: sessions of a corpus.
        sources: maps and storyboard that are not shipped.
        workers: number of processes; more than one needs an importable main module of the caller.

    Raises:
        SessionError: a session cannot be read or replayed, or its town is unknown.
        TownError: a given town cannot be read.
        StoryboardError: the given storyboard cannot be read.
        ProcessError: a process died.
    """
    prepare = partial(_ReplayTask, sources or ReplaySources())
    early: dict[int, ReplayCheck] = {}
    following = 0
    for number, found in run_tasks(prepare, enumerate(entries), workers=min(workers, max(len(entries), 1))):
        if isinstance(found, Exception):
            raise found
        early[number] = found
        while following in early:
            yield early.pop(following)
            following += 1


class _ReplayTask:
    """Checks sessions in one process."""

    def __init__(self, sources: ReplaySources) -> None:
        self._sources = sources
        self._storyboard: StoryboardTemplate | None = None

    def __call__(self, task: tuple[int, CorpusEntry]) -> tuple[int, ReplayCheck | Exception]:
        number, entry = task
        try:
            if self._sources.storyboard is not None and self._storyboard is None:
                self._storyboard = load_template(self._sources.storyboard)
            session = entry.load()
            return number, _check(session, self._sources.town_of(session), self._storyboard)
        except (SessionError, TownError, StoryboardError) as error:
            return number, error  # raised in the calling process: a mistake of the user, not of the worker


def _check(session: Session, town: Town, storyboard: StoryboardTemplate | None) -> ReplayCheck:
    begun = time.perf_counter()
    difference = first_difference(session, resimulate(session, town, storyboard=storyboard))
    return ReplayCheck(
        session=session.name,
        complete=session.complete,
        frames=len(session.trajectory),
        decisions=len(session.decisions or ()),
        recorded_by=session.header.package_version,
        difference=difference,
        wall_seconds=round(time.perf_counter() - begun, 3),
    )
