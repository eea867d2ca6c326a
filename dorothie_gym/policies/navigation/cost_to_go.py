"""Cost of the cheapest route to a goal, from anywhere in a town."""

from __future__ import annotations

import math
from functools import lru_cache

from dorothie_gym.maps import Town
from dorothie_gym.maps.routing import Place, router

REACHED_BEHIND = 2.0
"""Largest distance behind the car at which a goal counts as reached instead of passed [m]."""


class CostToGo:
    """Cost of the cheapest route to a goal in metres at 40 km/h, as computed by `Router.route`.

    Attributes:
        goal: lane and distance along it [m], or None.
        blocked: places that cannot be passed.
    """

    def __init__(self, town: Town) -> None:
        self._town = town
        self._cells = _cells(town)
        self.goal: Place | None = None
        self.blocked: tuple[Place, ...] = ()
        self._costs: list[float] = []

    def aim(self, goal: Place | None, blocked: tuple[Place, ...] = ()) -> bool:
        """Sets the goal and the blocked places; returns whether anything changed."""
        if (goal, blocked) == (self.goal, self.blocked):
            return False
        self.goal, self.blocked = goal, blocked
        if goal is not None:
            costs = router(self._town).distances_to(goal, blocked)
            if blocked and not any(map(math.isfinite, costs.tolist())):
                costs = router(self._town).distances_to(goal)
            self._costs = costs.tolist()
        return True

    def from_place(self, lane: int, station: float) -> float:
        """Returns the cost from a place [m]; infinite where no route leads to the goal, or there is no goal.

        Costs are known where the router's cells begin; in between they are interpolated.
        """
        if self.goal is None:
            return math.inf
        goal_lane, goal_station = self.goal
        first, count, size = self._cells[lane]
        passed = False
        if lane == goal_lane:
            ahead = goal_station - station
            if -REACHED_BEHIND <= ahead <= size:
                return abs(ahead)
            passed = ahead < 0.0 and int(station / size) == int(goal_station / size)
        k = min(int(max(station, 0.0) / size), count - 1)
        share = min(max(station, 0.0) / size - k, 1.0)
        # in the goal's own cell but behind the goal, the cost follows from the end of the cell
        here = math.inf if passed else self._costs[first + k]
        if k + 1 < count:
            ahead = self._costs[first + k + 1]
            if math.isinf(here):
                return ahead + (1.0 - share) * size
            return here if math.isinf(ahead) else here + share * (ahead - here)
        return self._after_lane(lane) + (1.0 - share) * size if math.isinf(here) else here - share * size

    def _after_lane(self, lane: int) -> float:
        """Returns the cost from the end of a lane."""
        starts = [self._cells[way.connector][0] for way in self._town.exits(lane)]
        return min((self._costs[start] for start in starts), default=math.inf)


@lru_cache(maxsize=16)
def _cells(town: Town) -> tuple[tuple[int, int, float], ...]:
    """Returns for each lane: number of its first cell, number of cells, and length of each [m]."""
    found = []
    for lane in town.lanes:
        first = router(town).cell(lane.id, 0.0)
        count = router(town).cell(lane.id, lane.length) - first + 1
        found.append((first, count, lane.length / count))
    return tuple(found)
