"""Cost of the cheapest route to a goal, from anywhere in a town."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.routing import Place, router
from dorothie_gym.maps.routing_graph import RoutingLane, routing_graph
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import RecordArray
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

REACHED_BEHIND = 2.0
"""Largest distance behind the car at which a goal counts as reached rather than passed [m]."""

ROWS = 512
"""Rows of costs that a process keeps: one takes 4 to 30 KB."""


@compiled
def cost_from(
    lanes: RecordArray[RoutingLane], costs: Array, goal_lane: int, goal_station: float, lane: int, station: float
) -> float:
    """Returns the cost from a place to a goal [m]; infinite where no route leads there.

    Costs are known where the router's cells begin; in between they are interpolated.

    Args:
        lanes: lanes of the routing graph.
        costs: (cells + lanes,) costs from the starts of the cells and the ends of the lanes, see `Router.costs_to`.
        goal_lane: lane of the goal.
        goal_station: station of the goal [m].
        lane: lane of the place.
        station: station of the place [m].
    """
    row = lanes[lane]
    size, passed = row.cell_size, False
    if lane == goal_lane:
        ahead = goal_station - station
        if -REACHED_BEHIND <= ahead <= size:
            return abs(ahead)
        passed = ahead < 0.0 and int(station / size) == int(goal_station / size)
    k = min(int(max(station, 0.0) / size), row.cells - 1)
    share = min(max(station, 0.0) / size - k, 1.0)
    # in the goal's own cell but past the goal, the cost follows from the end of the cell
    here = math.inf if passed else float(costs[row.first + k])
    if k + 1 < row.cells:
        after = float(costs[row.first + k + 1])
        if math.isinf(here):
            return after + (1.0 - share) * size
        return here if math.isinf(after) else here + share * (after - here)
    if math.isinf(here):
        return float(costs[len(costs) - len(lanes) + lane]) + (1.0 - share) * size
    return here - share * size


@shared
@dataclass(frozen=True, eq=False)
class CostTable:
    """Costs of the cheapest routes to a goal; costs are metres at 40 km/h, as computed by `Router.route`.

    Attributes:
        goal: lane and distance along it [m].
        lanes: lanes of the routing graph.
        costs: see `cost_from`.
    """

    goal: Place
    lanes: RecordArray[RoutingLane]
    costs: Array


@lru_cache(maxsize=ROWS)
def cost_table(town: Town, goal: Place, blocked: tuple[Place, ...] = ()) -> CostTable:
    """Returns the costs to a goal, computed once for all in the process.

    Args:
        town: the map.
        goal: lane and distance along it [m].
        blocked: places that cannot be passed.
    """
    return CostTable(goal, routing_graph(town).lanes, router(town).costs_to(goal, blocked))


class CostToGo:
    """Cost of the cheapest route to a goal.

    Attributes:
        goal: lane and distance along it [m], or None.
        blocked: places that cannot be passed.
    """

    def __init__(self, town: Town) -> None:
        self._town = town
        self._table: CostTable | None = None
        self.goal: Place | None = None
        self.blocked: tuple[Place, ...] = ()

    def aim(self, goal: Place | None, blocked: tuple[Place, ...] = ()) -> bool:
        """Sets the goal and the blocked places; returns whether anything changed."""
        if (goal, blocked) == (self.goal, self.blocked):
            return False
        self.goal, self.blocked = goal, blocked
        self._table = None if goal is None else cost_table(self._town, goal, blocked)
        return True

    @property
    def rows(self) -> tuple[RecordArray[RoutingLane], Array]:
        """Lanes and costs for `cost_from`; no costs if there is no goal."""
        if self._table is None:
            return routing_graph(self._town).lanes, np.zeros(0)
        return self._table.lanes, self._table.costs

    def from_place(self, lane: int, station: float) -> float:
        """Returns the cost from a place [m]; infinite where no route leads to the goal, or there is no goal."""
        table = self._table
        if table is None:
            return math.inf
        return cost_from(table.lanes, table.costs, *table.goal, lane, station)
