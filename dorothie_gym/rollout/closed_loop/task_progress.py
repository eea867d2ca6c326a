"""The task of a recorded session: what was live, reached and where, found anew from header and events."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.analysis.exception_attribution import kind_of
from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place, router
from dorothie_gym.ontology import ExceptionKind, GoalStatus
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.recording import NO_LANE, Event, EventType, LandmarkRow, Session


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
        """Returns whether the rules allow to reach a live subgoal when some have been reached (as `tasks.TaskState`).

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
    """Returns whether an event tells that a subgoal was reached."""
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


# --- Remaining distance through the subgoals --------------------------------------------------------------------------


class TaskWay:
    """Ways through what is left of a task.

    Args:
        town: the map.
        task: the task.
        blocked: places that cannot be passed; where they leave no way, they are ignored.
    """

    def __init__(self, town: Town, task: TaskRecord, blocked: Sequence[Place] = ()) -> None:
        self._town, self._task, self._blocked = town, task, tuple(blocked)
        self._left: dict[int, CostToGo] = {}
        self._rest: dict[tuple[int, frozenset[int]], float] = {}

    def shortest(self, start: Place) -> float:
        """Returns the length of the shortest way through all live subgoals, reached or not [m]; inf if there is none.

        Between two places it is the way that the town's router takes, the quickest.
        """
        return _best(self._task, start, frozenset(), lambda one, two: self._length(one, two))

    def left(self, place: Place) -> float:
        """Returns what is left from a place through the subgoals not reached yet [m at 40 km/h]; inf if no way is.

        It is the router's cost, which knows speed limits, turns and lane changes.
        """
        task = self._task
        goals = [goal for goal in task.live if task.may_be_next(goal, task.reached)]
        if not task.left:
            return 0.0
        return min((self._cost(place, goal) + self._after(goal) for goal in goals), default=math.inf)

    def _after(self, goal: int) -> float:
        """Returns the remaining subgoals after a further one has been reached."""
        reached = self._task.reached | {goal}
        if (goal, reached) not in self._rest:
            place = self._task.places[goal]
            self._rest[goal, reached] = _best(self._task, place, reached, self._cost_between)
        return self._rest[goal, reached]

    def _cost_between(self, start: Place, goal: Place) -> float:
        number = next(k for k, place in self._task.places.items() if place == goal)
        return self._cost(start, number)

    def _cost(self, start: Place, goal: int) -> float:
        if goal not in self._left:
            self._left[goal] = CostToGo(self._town)
            self._left[goal].aim(self._task.places[goal], self._blocked)
        return self._left[goal].from_place(*start)

    def _length(self, start: Place, goal: Place) -> float:
        route = router(self._town).route(start, goal)
        return math.inf if route is None else route.length


def _best(task: TaskRecord, start: Place, reached: frozenset[int], between: Callable[[Place, Place], float]) -> float:
    """Length of the best way through what is not reached, over all orders that are allowed (Held and Karp, 1962)."""
    known: dict[tuple[Place, frozenset[int]], float] = {}
    lengths: dict[tuple[Place, Place], float] = {}

    def leg(one: Place, two: Place) -> float:
        if (one, two) not in lengths:
            lengths[one, two] = between(one, two)
        return lengths[one, two]

    def best(here: Place, done: frozenset[int]) -> float:
        if len(done) == len(task.live):
            return 0.0
        if (here, done) not in known:
            ways = (
                leg(here, task.places[goal]) + best(task.places[goal], done | {goal})
                for goal in task.live
                if task.may_be_next(goal, done)
            )
            known[here, done] = min(ways, default=math.inf)
        return known[here, done]

    return best(start, reached)


def driven_length(session: Session) -> float:
    """Returns how far the car drove [m]: the places of all frames, joined."""
    rows = session.trajectory
    return float(np.hypot(np.diff(rows["x"]), np.diff(rows["y"])).sum())


def places_of(session: Session, town: Town, frames: Iterable[int]) -> list[Place]:
    """Returns lane and station [m] of the car at frames; frames without a lane that the town has are left out."""
    rows = session.trajectory
    found: list[Place] = []
    if not len(rows):
        return found
    numbers: NDArray[np.int64] = rows["frame"]
    for k in np.clip(np.searchsorted(numbers, list(frames)), 0, len(rows) - 1):
        row = rows[int(k)]
        lane = int(row["lane"])
        if lane == NO_LANE or lane >= len(town.lanes):
            continue
        station, _ = town.lanes[lane].project(np.array([row["x"], row["y"]]))
        found.append((lane, float(np.clip(station, 0.0, town.lanes[lane].length))))
    return found
