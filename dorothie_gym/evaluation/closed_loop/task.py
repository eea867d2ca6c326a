"""The task of a recorded session: what was live, reached and where, found anew from header and events."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from dorothie_gym.ontology import ExceptionKind, GoalStatus
from dorothie_gym.sessions import Event, EventType, LandmarkRow, Session
from dorothie_gym.sessions.statistics.handling import kind_of
from dorothie_gym.world.town.routing import Place


@dataclass(frozen=True, kw_only=True)
class TaskRecord:
    """The task as it stood at a moment.

    Attributes:
        places: lane and station [m] of each live subgoal, by number, in the storyboard's order.
        after: numbers of the subgoals that come before each, live or not.
        reached: live subgoals that have been reached.
    """

    places: Mapping[int, Place]
    after: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    reached: frozenset[int] = frozenset()

    @property
    def live(self) -> tuple[int, ...]:
        """Numbers of the live subgoals; the last is the destination."""
        return tuple(self.places)

    @property
    def left(self) -> frozenset[int]:
        """Live subgoals that have not been reached."""
        return frozenset(self.live) - self.reached

    @property
    def done(self) -> bool:
        """Whether every live subgoal has been reached, the destination among them."""
        return bool(self.live) and not self.left

    def may_be_next(self, goal: int, reached: frozenset[int]) -> bool:
        """Whether the rules allow to reach a live subgoal when some have been reached (as `tasks.TaskState`).

        The destination comes after all others; what a subgoal comes after binds only where it is live.
        """
        if goal in reached:
            return False
        before = self.live[:-1] if goal == self.live[-1] else self.after.get(goal, ())
        return all(other in reached for other in before if other in self.places)


def task_at_end(session: Session) -> TaskRecord:
    """Returns the task as it stood when the session was over."""
    return task_after(session, len(session.events))


def task_after(session: Session, events: int) -> TaskRecord:
    """Returns the task as it stood after the first so many events."""
    rows = session.header.subgoals
    live = {number: not row["trigger"] for number, row in enumerate(rows)}
    places = {number: _place(session.header.landmarks[row["landmark"]]) for number, row in enumerate(rows)}
    reached: set[int] = set()
    for index, event in enumerate(session.events[:events]):
        number = _subgoal(event, len(rows))
        if number is None:
            continue
        if is_arrival(event):
            reached.add(number)
        kind = kind_of(event)
        if kind in (ExceptionKind.TASK_TRIGGER, ExceptionKind.TASK_DELETE):
            live[number] = kind is ExceptionKind.TASK_TRIGGER
        elif kind is ExceptionKind.TASK_CHANGE:
            places[number] = _place_of_change(session, event, index)
    alive = [number for number in live if live[number]]
    return TaskRecord(
        places={number: places[number] for number in alive},
        after={number: tuple(rows[number]["after"]) for number in alive},
        reached=frozenset(reached & set(alive)),
    )


def without_reached(task: TaskRecord) -> TaskRecord:
    """Returns the same task with nothing reached yet."""
    return replace(task, reached=frozenset())


def is_arrival(event: Event) -> bool:
    """Whether an event tells that a subgoal was reached."""
    return event.type is EventType.SUBGOAL and event.data.get("status") == GoalStatus.COMPLETE.label


def _subgoal(event: Event, count: int) -> int | None:
    number = event.data.get("subgoal")
    return number if isinstance(number, int) and 0 <= number < count else None


def _place(row: LandmarkRow) -> Place:
    return row["lane"], row["station"]


def _place_of_change(session: Session, event: Event, index: int) -> Place:
    """Where a changed subgoal is.

    Older recordings tell the name of the landmark only; where several have it, it is the one at which the car stood
    when the subgoal was reached, else the first of them.
    """
    landmarks = session.header.landmarks
    row = event.data.get("row")
    if isinstance(row, int) and 0 <= row < len(landmarks):
        return _place(landmarks[row])
    named = [mark for mark in landmarks if mark["name"] == event.data.get("landmark")]
    if not named:
        number = _subgoal(event, len(session.header.subgoals))
        return _place(landmarks[session.header.subgoals[number or 0]["landmark"]])
    arrival = next((each for each in session.events[index:] if _arrives(each, event)), None)
    rows = session.trajectory
    if arrival is None or not len(rows):
        return _place(named[0])
    at = rows[min(int((rows["frame"] <= arrival.frame).sum()), len(rows)) - 1]
    return _place(min(named, key=lambda mark: math.hypot(mark["x"] - at["x"], mark["y"] - at["y"])))


def _arrives(event: Event, change: Event) -> bool:
    return is_arrival(event) and event.data.get("subgoal") == change.data.get("subgoal")
