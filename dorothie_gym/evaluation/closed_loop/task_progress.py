"""Task of a recorded session, reconstructed from header and events, and the remaining route through its subgoals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.analysis.exception_attribution import kind_of
from dorothie_gym.maps.routing import Place, router
from dorothie_gym.ontology.slots import GoalStatus
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.session.recording.events import Event, EventType
from dorothie_gym.session.recording.header import NO_LANE, LandmarkRow
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session


@dataclass(frozen=True, kw_only=True)
class TaskRecord:
    """State of the task at one moment.

    Attributes:
        places: lane and station [m] of each live subgoal, by number, in the order of the storyboard.
        after: for each subgoal, the numbers of the subgoals that must be reached before it, live or not.
        reached: live subgoals that have been reached.
    """

    places: Mapping[int, Place]
    after: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    reached: frozenset[int] = frozenset()

    @property
    def live(self) -> tuple[int, ...]:
        """Indices of the live subgoals; the last one is the destination."""
        return tuple(self.places)

    @property
    def left(self) -> frozenset[int]:
        """Live subgoals that have not been reached."""
        return frozenset(self.live) - self.reached

    @property
    def done(self) -> bool:
        """Whether every live subgoal has been reached, including the destination."""
        return bool(self.live) and not self.left

    def may_be_next(self, goal: int, reached: frozenset[int]) -> bool:
        """Returns whether a live subgoal may be reached next, given the reached ones (as `tasks.TaskState`).

        The destination comes after all other subgoals. Of the subgoals in `after`, only live ones count.
        """
        if goal in reached:
            return False
        before = self.live[:-1] if goal == self.live[-1] else self.after.get(goal, ())
        return all(other in reached for other in before if other in self.places)


def task_at_end(session: Session) -> TaskRecord:
    """Returns the task at the end of a session."""
    return task_after(session, len(session.events))


def task_after(session: Session, events: int) -> TaskRecord:
    """Returns the task after the first `events` events."""
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
    """Returns the task with no subgoal reached."""
    return replace(task, reached=frozenset())


def is_arrival(event: Event) -> bool:
    """Returns whether an event reports that a subgoal was reached."""
    return event.type is EventType.SUBGOAL and event.data.get("status") == GoalStatus.COMPLETE.label


def _subgoal(event: Event, count: int) -> int | None:
    number = event.data.get("subgoal")
    return number if isinstance(number, int) and 0 <= number < count else None


def _place(row: LandmarkRow) -> Place:
    return row["lane"], row["station"]


def _place_of_change(session: Session, event: Event, index: int) -> Place:
    """Returns the place of a changed subgoal.

    Older recordings contain only the name of the landmark. If several landmarks have this name, it is the one at which
    the car stood when the subgoal was reached, or else the first.
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
    return _place(min(named, key=lambda mark: pm.hypot(mark["x"] - at["x"], mark["y"] - at["y"])))


def _arrives(event: Event, change: Event) -> bool:
    return is_arrival(event) and event.data.get("subgoal") == change.data.get("subgoal")


# --- Remaining distance through the subgoals --------------------------------------------------------------------------


class TaskRoutes:
    """Lengths of the routes through the subgoals of a task.

    Args:
        town: the town.
        task: the task.
        blocked: places that cannot be passed; ignored if they leave no route.
    """

    def __init__(self, town: Town, task: TaskRecord, blocked: Sequence[Place] = ()) -> None:
        self._town, self._task, self._blocked = town, task, tuple(blocked)
        self._left: dict[int, CostToGo] = {}
        self._rest: dict[tuple[int, frozenset[int]], float] = {}

    def shortest(self, start: Place) -> float:
        """Returns the length of the shortest route through all live subgoals, reached or not [m]; inf without a route.

        Between two places, the town's router gives the quickest route.
        """
        return _best(self._task, start, frozenset(), lambda one, two: self._length(one, two))

    def remaining(self, place: Place) -> float:
        """Returns the cost of the route from a place through the unreached subgoals [m at 40 km/h]; inf without one.

        It is the router's cost, which includes speed limits, turns and lane changes.
        """
        task = self._task
        goals = [goal for goal in task.live if task.may_be_next(goal, task.reached)]
        if not task.left:
            return 0.0
        return min((self._cost(place, goal) + self._after(goal) for goal in goals), default=math.inf)

    def _after(self, goal: int) -> float:
        """Returns the remaining cost once a further subgoal has been reached."""
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
    """Returns the length of the best route through the unreached subgoals in any allowed order (Held-Karp, 1962)."""
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
    """Returns the distance driven [m]: the length of the polyline through the positions of all frames."""
    rows = session.trajectory
    return float(pn.hypot(np.diff(rows["x"]), np.diff(rows["y"])).sum())


def places_of(session: Session, town: Town, frames: Iterable[int]) -> list[Place]:
    """Returns lane and station [m] of the car at frames; frames without a lane of the town are left out."""
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
