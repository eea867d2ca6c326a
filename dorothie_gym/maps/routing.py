"""Route search in a town, by the manoeuvres of the car: follow lanes, turn, change lanes, make U-turns; roadblocks."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from dorothie_gym.maps.model import NO_JUNCTION, LinkType
from dorothie_gym.maps.route_arrays import LegRecord, RouteSearch, empty_search, place_records
from dorothie_gym.maps.route_search import find_costs, find_departures, find_route
from dorothie_gym.maps.routing_graph import (
    CELL,
    CHANGE_COST,
    CHANGE_LEFT,
    CHANGE_LENGTH,
    CHANGE_RIGHT,
    LANE_ENTRIES,
    NONE,
    SHORT_CHANGE,
    TURN_COST,
    U_TURN_COST,
    LaneEntry,
    Place,
    RoutingEdge,
    RoutingGraph,
    cheapest,
    joined,
    routing_graph,
)
from dorothie_gym.support.compilation.records import RecordArray, argument, empty_records, fields, filled_records, plain

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

__all__ = [
    "CELL",
    "CHANGE_COST",
    "CHANGE_LENGTH",
    "SHORT_CHANGE",
    "TURN_COST",
    "U_TURN_COST",
    "Instruction",
    "LaneEntry",
    "Leg",
    "Place",
    "Route",
    "Router",
    "router",
]

# Type of each manoeuvre other than following a lane, and its action angle [degrees, positive left].
_MANOEUVRES = {
    LaneEntry.CHANGE_LEFT: (LinkType.LANE_CHANGE_LEFT, 90),
    LaneEntry.CHANGE_RIGHT: (LinkType.LANE_CHANGE_RIGHT, -90),
    LaneEntry.U_TURN: (LinkType.U_TURN, -180),
}


@dataclass(frozen=True)
class Leg:
    """One lane of a route: how it is entered, and the stations between which it is driven [m]."""

    lane: int
    entry: LaneEntry
    start: float
    end: float


@dataclass(frozen=True, kw_only=True)
class Instruction:
    """One manoeuvre of a route, as a person would describe it: a turn at a junction, a lane change or a U-turn.

    Attributes:
        entry: FOLLOW for a turn at a junction.
        type: type of the turn or lane change; U_TURN also for a U-turn between junctions.
        angle: action angle [degrees, positive left]: that of the exit, 90 or -90 for a lane change, -180 for a U-turn.
        lane: lane before the manoeuvre.
        onto: lane after the manoeuvre.
        junction_id: junction that is crossed, or -1.
        street: index of the street of `onto`, or -1.
        choice: whether there are other exits, so that the turn must be stated; true for lane changes and U-turns.
        distance: distance from the start of the route to the start of the manoeuvre [m].
    """

    entry: LaneEntry
    type: LinkType
    angle: int
    lane: int
    onto: int
    junction_id: int = NO_JUNCTION
    street: int
    choice: bool
    distance: float


@dataclass(frozen=True, kw_only=True)
class Route:
    """Route between two places.

    Attributes:
        legs: lanes in order.
        length: driven distance, lane changes and U-turns included [m].
        cost: cost [m at 40 km/h]: lower at higher speed limits, with extra cost for manoeuvres.
    """

    legs: tuple[Leg, ...]
    length: float
    cost: float = math.nan

    @cached_property
    def records(self) -> RecordArray[LegRecord]:
        """The legs as records (n,)."""
        rows = [(leg.start, leg.end, leg.lane, LANE_ENTRIES.index(leg.entry)) for leg in self.legs]
        return argument(filled_records(LegRecord, rows))

    @property
    def lanes(self) -> tuple[int, ...]:
        """Ids of the lanes in order."""
        return tuple(leg.lane for leg in self.legs)

    def junctions(self, town: Town) -> tuple[int, ...]:
        """Returns the ids of the crossed junctions in order; immediate repetitions count once."""
        found: list[int] = []
        for leg in self.legs:
            junction = town.lanes[leg.lane].junction_id
            if junction >= 0 and (not found or found[-1] != junction):
                found.append(junction)
        return tuple(found)

    def turns(self, town: Town) -> tuple[Instruction, ...]:
        """Returns the manoeuvres in order: turns at junctions, lane changes and U-turns."""
        found: list[Instruction] = []
        distance = 0.0
        for one, two in zip(self.legs[:-1], self.legs[1:], strict=True):
            distance += one.end - one.start
            instruction = _instruction(town, one, two, distance)
            if instruction is not None:
                found.append(instruction)
        return tuple(found)


def _instruction(town: Town, one: Leg, two: Leg, distance: float) -> Instruction | None:
    """Returns the manoeuvre between two legs; None where the road simply continues."""
    if two.entry is not LaneEntry.FOLLOW:
        kind, angle = _MANOEUVRES[two.entry]
        street = town.lanes[two.lane].street
        return Instruction(
            entry=two.entry,
            type=kind,
            angle=angle,
            lane=one.lane,
            onto=two.lane,
            street=street,
            choice=True,
            distance=distance,
        )
    exits = town.exits(one.lane)
    way = next(way for way in exits if way.connector == two.lane)
    if way.junction_id == NO_JUNCTION or (town.lanes[one.lane].in_junction and len(exits) == 1):
        return None
    return Instruction(
        entry=LaneEntry.FOLLOW,
        type=way.type,
        angle=way.angle,
        lane=one.lane,
        onto=way.lane,
        junction_id=way.junction_id,
        street=town.lanes[way.lane].street,
        choice=len(exits) > 1,
        distance=distance,
    )


class _Searches(threading.local):
    """Scratch space of a thread for searches in a town."""

    def __init__(self, graph: RoutingGraph) -> None:
        self.search = empty_search(graph)


class Router:
    """Route search on the routing graph of a town; use `router` to share one for each town.

    Attributes:
        lane_cells: for each lane the number of its first cell, the number of cells, and the length of each [m].
    """

    def __init__(self, town: Town) -> None:
        self._graph = routing_graph(town)
        self._searches = _Searches(self._graph)
        self.lane_cells: list[tuple[int, int, float]] = plain(self._graph.lanes)[
            ["first", "cells", "cell_size"]
        ].tolist()

    @property
    def search(self) -> RouteSearch:
        """Scratch space of the current thread for `find_route`."""
        return self._searches.search

    def cell(self, lane: int, station: float) -> int:
        """Returns the cell that contains a place."""
        first, count, size = self.lane_cells[lane]
        return first + min(max(int(station / size), 0), count - 1)

    def cells_of(self, places: Iterable[Place]) -> set[int]:
        """Returns the cells that contain the given places."""
        return {self.cell(lane, station) for lane, station in places}

    def route(
        self, start: Place, goal: Place, blocked: Sequence[Place] = (), manoeuvre_cost: float = 0.0
    ) -> Route | None:
        """Returns the cheapest route between two places, or None if there is none; see `find_route`.

        Args:
            start: where the car is.
            goal: the goal; a goal slightly behind the start on the same lane needs a detour.
            blocked: impassable places (roadblocks). The route does not enter their cells, nor by lane changes; in
                the cell of the start only those ahead count.
            manoeuvre_cost: extra cost of each lane change and U-turn [m].

        Raises:
            IndexError: the town has no such lane.
        """
        self._check(start, goal, *blocked)
        search, places = self.search, place_records(blocked)
        if not find_route(self._graph, search, *start, *goal, places, len(blocked), manoeuvre_cost):
            return None
        cost, _, steps, count = fields(search.result, "cost", "extra", "steps", "legs").item()
        rows = plain(search.legs)[:count].tolist()
        legs = tuple(Leg(lane, LANE_ENTRIES[entry], begin, end) for begin, end, lane, entry in rows)
        length = sum(max(leg.end - leg.start, 0.0) for leg in legs) + float(search.driven[:steps].sum())
        return Route(legs=legs, length=length, cost=cost)

    def distances_to(self, goal: Place, blocked: Sequence[Place] = ()) -> NDArray[np.float64]:
        """Returns the cost from the start of each cell to a goal (cells,) [m at 40 km/h]; inf without a route."""
        return self.costs_to(goal, blocked)[: self._graph.cells]

    def costs_to(self, goal: Place, blocked: Sequence[Place] = ()) -> NDArray[np.float64]:
        """Returns `distances_to`, and the costs from the ends of the lanes without the turn there (cells + lanes,)."""
        self._check(goal, *blocked)
        costs = np.empty(self._graph.cells + len(self._graph.lanes))
        find_costs(self._graph, self.search, *goal, place_records(blocked), len(blocked), costs)
        return costs

    def _check(self, *places: Place) -> None:
        """Raises an `IndexError` for a lane that the town does not have; compiled code would read other memory."""
        count = len(self.lane_cells)
        for lane, _ in places:
            if not 0 <= lane < count:
                raise IndexError(f"the town has no lane {lane}; its lanes are 0 to {count - 1}")

    # --- What can be reached ----------------------------------------------------------------------------------------

    def reachable(self, start: Place, blocked: Sequence[Place] = ()) -> NDArray[np.bool_]:
        """Returns which cells (cells,) are reachable despite roadblocks; the cell of the start always is."""
        found = self._reached(self._matrix(blocked, self._departures(start, blocked)), self._graph.start)
        found[self.cell(*start)] = True
        return found[: self._graph.cells]

    def onward(
        self, start: Place, blocked: Sequence[Place] = (), stands: Sequence[Place] = (), held: Place | None = None
    ) -> NDArray[np.bool_]:
        """Returns which nodes of the graph a car can reach by driving on from a place, despite roadblocks (nodes,).

        Nodes are the starts of the cells in order, then the tails of the lanes. The cell of the start counts if the car
        can return to its start.

        Args:
            start: where the car is.
            blocked: impassable places, see `route`.
            stands: stopping places before the roadblocks, at the starts of the blocked sections.
            held: stopping place of the car before the next roadblock, if that is near.
        """
        extra = [self._departures(start, blocked), *map(self._stand, stands)]
        if held is not None:
            extra.append(self._stand(held, self._graph.start))
        found = self._reached(self._matrix(blocked, *extra), self._graph.start)
        found[self._graph.start] = False
        return found

    def parts(self) -> NDArray[np.int64]:
        """Returns a label of each cell (cells,): cells of one label can be reached from each other.

        The label is -1 for cells to which a car cannot return.
        """
        matrix = self._matrix(())
        _, labels = connected_components(matrix, directed=True, connection="strong")
        returns = (np.bincount(labels)[labels] > 1) | (matrix.diagonal() > 0.0)
        return np.where(returns, labels, NONE).astype(np.int64)[: self._graph.cells]

    def safe(
        self, goals: Sequence[int], blocked: Sequence[Place] = (), stands: Sequence[Place] = ()
    ) -> NDArray[np.bool_]:
        """Returns the nodes from which all goal cells are reachable despite roadblocks; see `onward`."""
        matrix = self._matrix(blocked, *map(self._stand, stands))
        _, group = connected_components(matrix, directed=True, connection="strong")
        reverse = matrix.T.tocsr()
        result = np.ones(self._graph.nodes, dtype=np.bool_)
        # the nodes of a strongly connected group reach the same nodes, and most of a town is one group
        for goal in {int(group[goal]): goal for goal in goals}.values():
            result &= self._reached(reverse, goal)
        return result

    def leads_to(self, stand: Place, nodes: NDArray[np.bool_], blocked: Sequence[Place]) -> bool:
        """Returns whether one edge leads from a stopping place before a roadblock to one of the nodes (nodes,)."""
        edges = self._clear(self._stand(stand, self._graph.start), blocked)
        return bool(nodes[edges["target"]].any())

    def _departures(self, start: Place, blocked: Sequence[Place]) -> RecordArray[RoutingEdge]:
        """Returns the edges from a start, see `find_departures`."""
        self._check(start, *blocked)
        search = self.search
        count = find_departures(self._graph, search, *start, NONE, 0.0, place_records(blocked), len(blocked))
        return joined(search.extra[:count])

    def _stand(self, place: Place, source: int | None = None) -> RecordArray[RoutingEdge]:
        """Returns the edges from a stop before a roadblock: the shortest lane change, and a U-turn on the spot.

        Args:
            place: place of the car. Room on its own lane is assumed; only the other lane is checked for obstacles.
            source: node at which the edges begin; by default the cell before that of the car, because the road up to
                the roadblock is closed. No edges if there is no such cell on the lane.
        """
        source = self.cell(*place) - 1 if source is None else source
        if source < self._graph.lanes[place[0]].first:
            return empty_records(RoutingEdge, 0)
        edges = self._departures(place, ())
        changes = (edges["entry"] == CHANGE_LEFT) | (edges["entry"] == CHANGE_RIGHT)
        edges = joined(edges[changes & (edges["driven"] < SHORT_CHANGE)], self._departures(place, [place]))
        edges["source"], edges["first"], edges["last"] = source, 0, NONE
        return edges

    def _clear(self, edges: RecordArray[RoutingEdge], blocked: Sequence[Place]) -> RecordArray[RoutingEdge]:
        """Returns the edges that neither end in nor traverse the cells of roadblocks."""
        if not blocked:
            return edges
        closed = np.zeros(self._graph.nodes, dtype=np.bool_)
        closed[sorted(self.cells_of(blocked))] = True
        before = np.concatenate(([0], np.cumsum(closed)))
        on_first = before[np.maximum(edges["last"] + 1, edges["first"])] - before[edges["first"]]
        on_second = before[np.maximum(edges["until"] + 1, edges["onto"])] - before[edges["onto"]]
        free: NDArray[np.bool_] = (on_first + on_second == 0) & ~closed[edges["target"]]
        return edges[free]

    def _matrix(self, blocked: Sequence[Place], *extra: RecordArray[RoutingEdge]) -> csr_matrix[np.float64]:
        """Returns the edges of the town and extra ones that are not blocked as a matrix of costs."""
        edges = cheapest(self._clear(joined(self._graph.edges, cheapest(joined(*extra))), blocked))
        nodes = self._graph.nodes
        cost, source, target = (np.ascontiguousarray(edges[name]) for name in ("cost", "source", "target"))
        return csr_matrix((cost, target, np.searchsorted(source, np.arange(nodes + 1))), shape=(nodes, nodes))

    def _reached(self, matrix: csr_matrix[np.float64], source: int) -> NDArray[np.bool_]:
        """Returns which nodes are reached from one of them (nodes,)."""
        found = np.zeros(self._graph.nodes, dtype=np.bool_)
        found[breadth_first_order(matrix, source, directed=True, return_predecessors=False)] = True
        return found


@lru_cache(maxsize=16)
def router(town: Town) -> Router:
    """Returns the router of a town; built once for each town."""
    return Router(town)


# --- Roadblocks -------------------------------------------------------------------------------------------------------
# Check that a town remains passable with roadblocks in it.
#
# Cells of the router in which a prop prevents a car from driving or turning round are closed. The remaining cells must
# suffice not only for the current place of the car: from wherever it may drive, or stop before a prop, it must be able
# to reach every place that it could reach before.

STANDS_BEFORE = 17.0
"""Distance of a car that stops for a prop to the prop, between their centres [m]."""

TURNS_BEHIND = 16.0
"""Minimum distance beyond a prop at which a U-turn onto its lane ends: `limits.U_TURN_REACH`, by which the car swings
ahead first, and half the length of a prop [m]."""

ONE_ROADBLOCK = 3.0
"""Largest distance along the road of props on adjacent lanes that form one roadblock [m]."""

APART = 22.0
"""Minimum distance along the road of other props [m]: a U-turn before the one swings out onto the other lane."""


def closed_by(place: Place) -> list[Place]:
    """Returns the places that a prop closes to cars: right before it, under it, or too close beyond it to turn."""
    lane, station = place
    return [(lane, station + float(on)) for on in np.arange(-STANDS_BEFORE, TURNS_BEHIND, CELL / 2)]


def crowds(town: Town, place: Place, others: Iterable[Place]) -> bool:
    """Returns whether a prop would leave too little room for a U-turn before a prop on a lane beside, or itself."""
    lane, station = place
    position = town.lanes[lane].position(station)
    beside = {
        near
        for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)
        if (near := town.neighbour(lane, side)) is not None
    }
    return any(
        ONE_ROADBLOCK < abs(town.lanes[other].project(position)[0] - at) < APART
        for other, at in others
        if other in beside
    )


def cuts_off(town: Town, car: Place, standing: Sequence[Place], added: Place) -> bool:
    """Returns whether one more prop would cut a route that the car needs, now or later.

    Args:
        town: the map.
        car: place of the car.
        standing: places of the existing props.
        added: place of the new one.

    Returns:
        Whether there is a site that can be reached from the car's place now, and then no longer: from there,
        from a place that the car can reach, or from its stopping place before one of the props.
    """
    search = router(town)
    props = [*standing, added]
    closed = [spot for place in props for spot in closed_by(place)]
    stands = [_stand(place) for place in props]
    on = search.onward(car)
    goals = [cell for site in town.sites if on[cell := search.cell(site.lane, site.station)]]
    safe = search.safe(goals, closed, stands)
    lost = search.safe(goals) & ~safe
    near = [at for lane, at in props if lane == car[0] and 0.0 < at - car[1] < STANDS_BEFORE + 2 * CELL]
    held = (car[0], max(min(near) - STANDS_BEFORE, car[1])) if near else None
    on = search.onward(car, closed, stands, held)
    if not on[goals].all() or (on & lost).any():
        return True
    return not all(search.leads_to(stand, safe, closed) for stand in stands)


def _stand(place: Place) -> Place:
    return place[0], max(place[1] - STANDS_BEFORE, 0.0)
