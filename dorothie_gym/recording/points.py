"""The points of the three tasks, each with exactly what may be seen there (teacher forcing).

Visible is what was recorded on frames strictly before the point. At a UfN point, in addition, the words of the
utterance and the acts of its earlier spans; at an NfD point the utterances that were over in its own frame and stand
before it in the record: who obeys at once has heard them. At an RfN point no act of the point's own utterance, which
would give its words away. Hidden landmarks, which the car does not know, are never visible.
"""

from __future__ import annotations

import bisect
import enum
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from dorothie_gym.ontology import NAVIGATION_ACTIONS, U_TURN_ANGLE, ArgumentKind, DialogueAct, PhysicalAction, Role
from dorothie_gym.recording.events import ActionRecord, Event, EventType, MoveRecord
from dorothie_gym.recording.header import LandmarkRow
from dorothie_gym.recording.session import Session
from dorothie_gym.sim.config import FRAME_RATE

ANGLE_TOLERANCE: Final = 15.0
"""The angle of a navigation action is right below this error [degrees] (paper, section 5, Evaluation)."""


WAY_LENGTH: Final = 25
WAY_STEP: Final = 12
"""States of the car in a view, and frames (30 Hz) from one to the next: 100 frames of 10 Hz, every fourth."""


class Task(enum.StrEnum):
    """What is to be predicted (paper, section 5)."""

    UFN = "ufn"
    """Understanding from navigation: the act of what the participant says."""
    RFN = "rfn"
    """Response from navigation: the act of what the Co-Wizard says next."""
    NFD = "nfd"
    """Navigation from dialogue: the next navigation action and its angle."""


@dataclass(frozen=True, kw_only=True)
class CarState:
    """The car in one frame: place [m], heading [rad, clockwise], speed [m/s]."""

    frame: int
    x: float
    y: float
    heading: float
    speed: float


@dataclass(frozen=True, kw_only=True)
class View:
    """What may be seen at a point: all that a model is given.

    Attributes:
        task: what is to be predicted.
        session: name of the session.
        frame: frame of the point.
        time: the same in seconds.
        moves: past dialogue moves of both speakers, oldest first.
        actions: past physical actions, oldest first.
        car: the last recorded state of the car; None before the first.
        way: where it was before, every `WAY_STEP` frames of the recording back from `car`, which is the last; at most
            `WAY_LENGTH` states (the working memory of the paper, section 6: 10 s).
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


@dataclass(frozen=True, kw_only=True)
class InferencePoint:
    """A dialogue move to be predicted (UfN, RfN): `index` of its event, what may be seen, and the label."""

    index: int
    view: View
    act: DialogueAct


@dataclass(frozen=True, kw_only=True)
class DecisionPoint:
    """A navigation action to be predicted (NfD).

    Attributes:
        index: number of its event.
        view: what may be seen.
        action: the label.
        angle: its argument [degrees, positive left, in [-180, 180)]: 0 for actions that take none, NaN where the
            recording does not know it.
    """

    index: int
    view: View
    action: PhysicalAction
    angle: float


Point: TypeAlias = InferencePoint | DecisionPoint


def ufn_points(session: Session, *, since: int = 0) -> Iterator[InferencePoint]:
    """Yields a point for each flagged dialogue move of the participant; of events from number `since` on."""
    yield from _inference_points(session, Task.UFN, Role.PARTICIPANT, since)


def rfn_points(session: Session, *, since: int = 0) -> Iterator[InferencePoint]:
    """Yields a point for each flagged dialogue move of the Co-Wizard; of events from number `since` on."""
    yield from _inference_points(session, Task.RFN, Role.CO_WIZARD, since)


def nfd_points(session: Session, *, since: int = 0) -> Iterator[DecisionPoint]:
    """Yields a point for each flagged navigation action of the Co-Wizard; of events from number `since` on."""
    history = _History(session, Task.NFD)
    for record in session.physical_actions:
        if record.index >= since and is_decision(record):
            yield DecisionPoint(
                index=record.index,
                view=history.view(record.frame, before=record.index),
                action=record.action,
                angle=label_angle(record),
            )


def task_points(session: Session, task: Task, *, since: int = 0) -> tuple[Point, ...]:
    """Returns the points of a task in a session; of events from number `since` on."""
    match task:
        case Task.UFN:
            return tuple(ufn_points(session, since=since))
        case Task.RFN:
            return tuple(rfn_points(session, since=since))
        case Task.NFD:
            return tuple(nfd_points(session, since=since))


def corpus_points(sessions: Iterable[Session], task: Task) -> Iterator[Point]:
    """Yields the points of a task in sessions, such as a `Corpus`; each session is read when it is its turn.

    Raises:
        SessionError: a session cannot be read.
    """
    for session in sessions:
        yield from task_points(session, task)


def is_decision(record: ActionRecord) -> bool:
    """Whether a physical action is a point of NfD."""
    return record.flagged and record.source is Role.CO_WIZARD and record.action in NAVIGATION_ACTIONS


def unpointed_events(session: Session) -> tuple[tuple[int, str], ...]:
    """Returns the number of each flagged event that is a point of no task, and why it is none.

    With the points of the three tasks they are all flagged events, each once.
    """
    acts = {act.index: act for act in session.physical_actions}
    return tuple(
        (index, reason)
        for index, event in enumerate(session.events)
        if event.flagged and (reason := _why_no_point(event, acts.get(index)))
    )


def _why_no_point(event: Event, act: ActionRecord | None) -> str:
    """Why a flagged event is no point; empty if it is one."""
    if act is not None:
        if act.action not in NAVIGATION_ACTIONS:
            return f"{act.action.label} is no navigation action"
        return "" if is_decision(act) else f"{act.action.label} of {act.source.value}, not of the Co-Wizard"
    if event.type is not EventType.DIALOGUE_MOVE:
        return f"an event of type {event.type_name}: neither a dialogue move nor a physical action"
    return (
        ""
        if event.source in (Role.PARTICIPANT, Role.CO_WIZARD)
        else f"a move of {event.source.value}, neither the participant nor the Co-Wizard"
    )


def final_view(session: Session, task: Task) -> View:
    """Returns what may be seen when the session is over: everything, and no utterance."""
    last_frame = round(session.duration * FRAME_RATE)
    return _History(session, task).view(last_frame + 1)


def history_angle(record: ActionRecord) -> float:
    """Returns the angle under which an action stands in a history [degrees]: a U-turn's is -180 (SDN), unknown is 0."""
    if record.action is PhysicalAction.U_TURN:
        return U_TURN_ANGLE
    return _wrap(record.angle or 0.0)


def label_angle(record: ActionRecord) -> float:
    """Returns NfD's label of an action's argument [degrees]: 0 where it takes none, NaN where it is not known."""
    if record.action.argument not in (ArgumentKind.ANGLE, ArgumentKind.SIDE):
        return 0.0
    return math.nan if record.angle is None else _wrap(record.angle)


def angle_error(predicted: float, label: float) -> float:
    """Returns how far an angle is off, on the circle [degrees], in [0, 180]: 179 and -179 differ by 2."""
    return abs(_wrap(predicted - label))


class _History:
    """What was recorded before each frame of a session."""

    def __init__(self, session: Session, task: Task) -> None:
        self._session = session
        self._task = task
        self._moves = session.moves()
        self._actions = session.physical_actions
        self._move_frames = [move.frame for move in self._moves]
        self._action_frames = [action.frame for action in self._actions]
        self._landmarks = tuple(row for row in session.header.landmarks if not row["hidden"])

    def view(self, frame: int, move: MoveRecord | None = None, before: int = 0) -> View:
        """The view at a frame.

        Args:
            frame: of the point.
            move: the one to be predicted, if it is one.
            before: utterances of the frame itself are visible whose last event has a number below this.
        """
        stop = bisect.bisect_left(self._move_frames, frame)
        while stop < len(self._moves) and self._moves[stop].frame == frame and self._moves[stop].index < before:
            stop += 1
        moves = self._moves[:stop]
        utterance = ""
        if move is not None:
            moves = tuple(past for past in moves if not _same_utterance(past, move))
        if move is not None and self._task is Task.UFN:
            utterance = move.text
            moves += tuple(past for past in self._moves if _same_utterance(past, move) and past.index < move.index)
        way = self._way(frame)
        return View(
            task=self._task,
            session=self._session.name,
            frame=frame,
            time=frame / FRAME_RATE,
            moves=moves,
            actions=self._actions[: bisect.bisect_left(self._action_frames, frame)],
            car=way[-1] if way else None,
            way=way,
            utterance=utterance,
            street_names=tuple(self._session.header.street_names),
            landmarks=self._landmarks,
        )

    def _way(self, frame: int) -> tuple[CarState, ...]:
        trajectory = self._session.trajectory
        last = int(np.searchsorted(trajectory["frame"], frame, side="left")) - 1
        if last < 0:
            return ()
        wanted = int(trajectory["frame"][last]) - WAY_STEP * np.arange(WAY_LENGTH)[::-1]
        rows = np.searchsorted(trajectory["frame"], wanted[wanted >= trajectory["frame"][0]])
        states = trajectory[list(_STATE)][rows].tolist()
        return tuple(CarState(**dict(zip(_STATE, state, strict=True))) for state in states)


_STATE: Final = ("frame", "x", "y", "heading", "speed")


def _inference_points(session: Session, task: Task, speaker: Role, since: int) -> Iterator[InferencePoint]:
    history = _History(session, task)
    for move in session.moves(speaker):
        if move.flagged and move.index >= since:
            yield InferencePoint(index=move.index, view=history.view(move.frame, move), act=move.act)


def _same_utterance(one: MoveRecord, other: MoveRecord) -> bool:
    return one.utterance == other.utterance and one.speaker is other.speaker


def _wrap(degrees: float) -> float:
    return (degrees + 180.0) % 360.0 - 180.0
