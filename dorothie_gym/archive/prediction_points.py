"""Prediction points of the three tasks, and the view at a point, by the rule of `dorothie_gym.archive.visibility`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Moments, RecordTimes, Task, earlier_spans, visible_rows
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, U_TURN_ANGLE, ArgumentKind, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.recording.events import ActionRecord, Event, EventType, MoveRecord, UtteranceRecord
from dorothie_gym.session.recording.header import LandmarkRow
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.copying import shared
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

ANGLE_TOLERANCE: Final = 15.0
"""Largest error of a navigation action's angle that counts as right [degrees] (paper, section 5, Evaluation)."""

WAY_LENGTH: Final = 25
"""Maximum number of states of the car in a view: every fourth of 100 at 10 Hz (working memory, paper, section 6)."""

WAY_STEP: Final = 12
"""Frames (30 Hz) between two states of the car in a view."""

SPEAKERS: Final = (Role.PARTICIPANT, Role.CO_WIZARD)
"""Roles whose utterances are visible."""


def is_decision(record: ActionRecord) -> bool:
    """Returns whether a physical action is a point of NfD."""
    return record.flagged and record.source is Role.CO_WIZARD and record.action in NAVIGATION_ACTIONS


def is_inference(move: MoveRecord, task: Task) -> bool:
    """Returns whether a dialogue move is a point of UfN or RfN."""
    return move.flagged and move.speaker is (Role.PARTICIPANT if task is Task.UFN else Role.CO_WIZARD)


# --- Views ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class CarState:
    """State of the car at a frame: position [m], heading [rad, clockwise], speed [m/s]."""

    frame: int
    x: float
    y: float
    heading: float
    speed: float


@dataclass(frozen=True, kw_only=True)
class PointView:
    """Everything that is visible at a point: the whole input of a model.

    Attributes:
        task: the task.
        session: name of the session.
        frame: frame of the point.
        time: the same in seconds.
        moves: past dialogue moves of both speakers, oldest first; spans of an utterance in progress (RfN) have the
            words up to their end as `text`.
        actions: past physical actions, oldest first.
        car: the last recorded state of the car; None before the first.
        way: past states of the car, oldest first, every `WAY_STEP` frames back from `car`, which is the last; at most
            `WAY_LENGTH` states.
        utterance: words of the current utterance at a UfN point, else empty.
        street_names: label of each street's name.
        landmarks: those that are not hidden.
    """

    task: Task
    session: str
    frame: int
    time: float
    moves: tuple[MoveRecord, ...]
    actions: tuple[ActionRecord, ...]
    car: CarState | None
    way: tuple[CarState, ...]
    utterance: str
    street_names: tuple[str, ...]
    landmarks: tuple[LandmarkRow, ...]


class SessionHistory:
    """Record of a session in the order in which it becomes visible.

    Attributes:
        session: the session.
        strict: whether RfN points hide the earlier spans of the Co-Wizard's own utterance.
        utterances: utterances of `SPEAKERS`, by the frame of their last move, then by their first event.
        moves: their moves, utterance by utterance.
        actions: the physical actions.
        landmarks: landmarks that are not hidden.
        times: times of these rows in frames of the session.
    """

    def __init__(self, session: Session, *, strict: bool = False) -> None:
        self.session, self.strict = session, strict
        said: Sequence[UtteranceRecord] = [said for said in session.utterances() if said.speaker in SPEAKERS]
        self.utterances = tuple(sorted(said, key=lambda said: (said.frame, said.moves[0].index)))
        self.moves = tuple(move for said in self.utterances for move in said.moves)
        self.actions = session.physical_actions
        self.landmarks = tuple(row for row in session.header.landmarks if not row["hidden"])
        self.times = RecordTimes(
            utterances=Moments.of_one_session([said.frame for said in self.utterances]),
            last_events=np.array([said.moves[-1].index for said in self.utterances], dtype=np.int64),
            first_moves=np.cumsum([0, *(len(said.moves) for said in self.utterances)]),
            actions=Moments.of_one_session([action.frame for action in self.actions]),
            frames=Moments.of_one_session(session.trajectory["frame"]),
        )

    def view(self, task: Task, frame: int, event: int = -1) -> PointView:
        """Returns the view at a point.

        Args:
            task: the task.
            frame: frame of the point.
            event: number of the point's event; -1 if nothing is predicted.
        """
        seen = visible_rows(self.times, task, Moments.of_one_session(frame), [event])
        moves, utterance = self.moves[: int(seen.moves.stop[0])], ""
        row = self._row_of_event.get(event)
        if row is not None and task is not Task.NFD and not (task is Task.RFN and self.strict):
            spans = earlier_spans(self._utterance_of_move, row)
            earlier = self.moves[int(spans.start[0]) : row]
            moves += earlier if task is Task.UFN else tuple(_as_far_as_said(earlier, frame))
        if row is not None and task is Task.UFN:
            utterance = self.moves[row].text
        way = self._way(int(seen.frames.stop[0]))
        return PointView(
            task=task,
            session=self.session.name,
            frame=frame,
            time=frame / FRAME_RATE,
            moves=moves,
            actions=self.actions[: int(seen.actions.stop[0])],
            car=way[-1] if way else None,
            way=way,
            utterance=utterance,
            street_names=tuple(self.session.header.street_names),
            landmarks=self.landmarks,
        )

    @cached_property
    def _row_of_event(self) -> dict[int, int]:
        return {move.index: row for row, move in enumerate(self.moves)}

    @cached_property
    def _utterance_of_move(self) -> NDArray[np.int64]:
        return np.repeat(np.arange(len(self.utterances)), np.diff(self.times.first_moves))

    def _way(self, stop: int) -> tuple[CarState, ...]:
        """Returns the states of the car up to row `stop` of the trajectory."""
        if stop == 0:
            return ()
        trajectory = self.session.trajectory
        wanted = int(trajectory["frame"][stop - 1]) - WAY_STEP * np.arange(WAY_LENGTH)[::-1]
        rows = np.searchsorted(trajectory["frame"], wanted[wanted >= trajectory["frame"][0]])
        states = trajectory[list(_STATE)][rows].tolist()
        return tuple(CarState(**dict(zip(_STATE, state, strict=True))) for state in states)


def _as_far_as_said(spans: Sequence[MoveRecord], frame: int) -> Iterator[MoveRecord]:
    """Yields the earlier spans of an utterance in progress, each with the words up to its end."""
    words = ""
    for span in spans:
        words = f"{words} {span.span}".strip()
        yield replace(span, text=words, recognised=None, end=min(span.end, frame / FRAME_RATE))


_STATE: Final = ("frame", "x", "y", "heading", "speed")


def final_view(session: Session, task: Task) -> PointView:
    """Returns the view after the end of a session: the whole record, and no current utterance."""
    last_frame = round(session.duration * FRAME_RATE)
    return SessionHistory(session).view(task, last_frame + 1)


# --- Points -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class _TaskPoint:
    """Place of a point; the view is made when it is first read."""

    task: Task
    index: int
    frame: int
    history: SessionHistory = field(repr=False, compare=False)

    @cached_property
    def view(self) -> PointView:
        """View at the point."""
        return self.history.view(self.task, self.frame, self.index)


@shared
@dataclass(frozen=True, kw_only=True)
class InferencePoint(_TaskPoint):
    """Prediction point of a dialogue move (UfN, RfN).

    Attributes:
        task: the task.
        index: number of the event in the session.
        frame: frame of the event.
        history: record of the session.
        act: the label.
    """

    act: DialogueAct


@shared
@dataclass(frozen=True, kw_only=True)
class DecisionPoint(_TaskPoint):
    """Prediction point of a navigation action (NfD).

    Attributes:
        task: the task.
        index: number of the event in the session.
        frame: frame of the event.
        history: record of the session.
        action: the label.
        angle: its argument [degrees, positive left, in [-180, 180)]: 0 for actions without one, NaN where the recording
            does not hold it.
    """

    action: PhysicalAction
    angle: float


Point: TypeAlias = InferencePoint | DecisionPoint


def ufn_points(session: Session, *, since: int = 0) -> Iterator[InferencePoint]:
    """Yields a point for each flagged dialogue move of the participant, starting with event number `since`."""
    yield from _inference_points(SessionHistory(session), Task.UFN, since)


def rfn_points(session: Session, *, since: int = 0, strict: bool = False) -> Iterator[InferencePoint]:
    """Yields a point for each flagged dialogue move of the Co-Wizard, starting with event number `since`.

    Args:
        session: the session.
        since: number of the first event.
        strict: whether the earlier spans of the Co-Wizard's own utterance are hidden.
    """
    yield from _inference_points(SessionHistory(session, strict=strict), Task.RFN, since)


def nfd_points(session: Session, *, since: int = 0) -> Iterator[DecisionPoint]:
    """Yields a point for each flagged navigation action of the Co-Wizard, starting with event number `since`."""
    history = SessionHistory(session)
    for record in history.actions:
        if record.index >= since and is_decision(record):
            yield DecisionPoint(
                task=Task.NFD,
                index=record.index,
                frame=record.frame,
                history=history,
                action=record.action,
                angle=label_angle(record),
            )


def _inference_points(history: SessionHistory, task: Task, since: int) -> Iterator[InferencePoint]:
    for move in history.session.all_moves:
        if move.index >= since and is_inference(move, task):
            yield InferencePoint(task=task, index=move.index, frame=move.frame, history=history, act=move.act)


def task_points(session: Session, task: Task, *, since: int = 0, strict: bool = False) -> tuple[Point, ...]:
    """Returns the points of a task in a session, starting with event number `since`; `strict` as in `rfn_points`."""
    match task:
        case Task.UFN:
            return tuple(ufn_points(session, since=since))
        case Task.RFN:
            return tuple(rfn_points(session, since=since, strict=strict))
        case Task.NFD:
            return tuple(nfd_points(session, since=since))


def corpus_points(sessions: Iterable[Session], task: Task) -> Iterator[Point]:
    """Yields the points of a task in sessions, such as a `Corpus`; reads one session at a time.

    Raises:
        SessionError: a session cannot be read.
    """
    for session in sessions:
        yield from task_points(session, task)


def unpointed_events(session: Session) -> tuple[tuple[int, str], ...]:
    """Returns number and reason of each flagged event that is a point of no task.

    Together with the points of the three tasks they are all flagged events, each once.
    """
    actions = {action.index: action for action in session.physical_actions}
    return tuple(
        (index, reason)
        for index, event in enumerate(session.events)
        if event.flagged and (reason := _why_no_point(event, actions.get(index)))
    )


def _why_no_point(event: Event, action: ActionRecord | None) -> str:
    """Returns why a flagged event is not a point; empty if it is one."""
    if action is not None:
        if action.action not in NAVIGATION_ACTIONS:
            return f"{action.action.label} is no navigation action"
        return "" if is_decision(action) else f"{action.action.label} of {action.source.value}, not of the Co-Wizard"
    if event.type is not EventType.DIALOGUE_MOVE:
        return f"an event of type {event.type_name}: neither a dialogue move nor a physical action"
    if event.source in SPEAKERS:
        return ""
    return f"a move of {event.source.value}, neither the participant nor the Co-Wizard"


def at_tenths(session: Session) -> Session:
    """Returns a session as if recorded at 10 Hz: events move to the start of their interval, other frames are dropped.

    Points and views of the result do not depend on the layout that the session was read from.
    """
    trajectory = session.trajectory[session.trajectory["frame"] % FRAMES_PER_TENTH == 0]
    return replace(
        session,
        events=tuple(replace(event, frame=event.frame - event.frame % FRAMES_PER_TENTH) for event in session.events),
        trajectory=trajectory,
        scene=session.scene.at_frames(trajectory["frame"]),
    )


# --- Angles -----------------------------------------------------------------------------------------------------------


def history_angle(record: ActionRecord) -> float:
    """Returns the angle of a past action [degrees]: -180 for a U-turn (as in SDN), 0 if unknown."""
    if record.action is PhysicalAction.U_TURN:
        return U_TURN_ANGLE
    return wrap_degrees(record.angle or 0.0)


def label_angle(record: ActionRecord) -> float:
    """Returns the angle that NfD predicts [degrees]: 0 for actions without one, NaN if unknown."""
    if record.action.argument not in (ArgumentKind.ANGLE, ArgumentKind.SIDE):
        return 0.0
    return math.nan if record.angle is None else wrap_degrees(record.angle)


def angle_error(predicted: float, label: float) -> float:
    """Returns the error of an angle on the circle [degrees], in [0, 180]: 179 and -179 differ by 2."""
    return abs(wrap_degrees(predicted - label))
