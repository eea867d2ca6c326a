"""How far it is to the end of a task: through the subgoals that are left, in the best order that is allowed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.closed_loop.task import TaskRecord
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from dorothie_gym.sessions import NO_LANE, Session
from dorothie_gym.world.town import Town
from dorothie_gym.world.town.routing import Place, router


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
        """What is left when a subgoal has been reached, too."""
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
