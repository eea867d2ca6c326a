"""Route search in a town, by the manoeuvres of the car: follow lanes, turn, change lanes, make U-turns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, dijkstra

from dorothie_gym.maps.model import NO_JUNCTION, LinkType
from dorothie_gym.maps.routing_graph import (
    CELL,
    CHANGE_COST,
    CHANGE_LENGTH,
    LANE_ENTRIES,
    SHORT_CHANGE,
    TURN_COST,
    U_TURN_COST,
    CellGraph,
    IntArray,
    LaneEntry,
    Place,
    RoutingEdges,
)
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

_FOLLOW = LANE_ENTRIES.index(LaneEntry.FOLLOW)

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


class Router:
    """Route search on the routing graph of a town; use `router` to share one for each town."""

    def __init__(self, town: Town) -> None:
        self._town = town
        self._graph = CellGraph(town)

    def cell(self, lane: int, station: float) -> int:
        """Returns the cell that contains a place."""
        return self._graph.cell(lane, station)

    def cells_of(self, places: Iterable[Place]) -> set[int]:
        """Returns the cells that contain the given places."""
        return self._graph.cells_of(places)

    def route(self, start: Place, goal: Place, blocked: Sequence[Place] = ()) -> Route | None:
        """Returns the cheapest route between two places, or None if there is none.

        Args:
            start: where the car is.
            goal: goal; one slightly behind the start on the same lane needs a detour.
            blocked: impassable places (roadblocks). The route does not enter their cells, nor by lane changes; in
                the cell of the start only those ahead count.
        """
        graph = self._graph
        extra = RoutingEdges.join([graph.departures(start, goal, blocked), graph.arrivals(goal)])
        edges = self._open(blocked, extra)
        cost, previous = dijkstra(self._matrix(edges), indices=np.array(graph.start), return_predecessors=True)
        if not math.isfinite(cost[graph.goal]):
            return None
        nodes = _trace(previous, graph.start, graph.goal)
        keys = edges.source * graph.nodes + edges.target
        taken = edges.take(np.searchsorted(keys, nodes[:-1] * graph.nodes + nodes[1:]))
        return _lay(taken, start, goal, float(cost[graph.goal]))

    def reachable(self, start: Place, blocked: Sequence[Place] = ()) -> NDArray[np.bool_]:
        """Returns which cells (cells,) are reachable despite roadblocks; the cell of the start always is."""
        edges = self._open(blocked, self._graph.departures(start, None, blocked))
        order = breadth_first_order(self._matrix(edges), self._graph.start, directed=True, return_predecessors=False)
        found = np.zeros(self._graph.nodes, dtype=np.bool_)
        found[order] = True
        found[self.cell(*start)] = True
        return found[: self._graph.cells]

    def onward(self, start: Place, blocked: Sequence[Place] = (), stands: Sequence[Place] = (),
               held: Place | None = None) -> NDArray[np.bool_]:  # fmt: skip
        """Returns which nodes of the graph a car can reach by driving on from a place, despite roadblocks (nodes,).

        Nodes are the starts of the cells in order, then the tails of the lanes. The cell of the start counts if the car
        can return to its beginning.

        Args:
            start: where the car is.
            blocked: impassable places, see `route`.
            stands: stopping places before the roadblocks, at the beginnings of the blocked sections.
            held: stopping place of the car before the next roadblock, if that is near.
        """
        graph = self._graph
        extra = [graph.departures(start, None, blocked)]
        if held is not None:
            extra.append(graph.stand(held, graph.start))
        order = breadth_first_order(
            self._passable(blocked, stands, extra), graph.start, directed=True, return_predecessors=False
        )
        found = np.zeros(graph.nodes, dtype=np.bool_)
        found[order] = True
        found[graph.start] = False
        return found

    def safe(
        self, goals: Sequence[int], blocked: Sequence[Place] = (), stands: Sequence[Place] = ()
    ) -> NDArray[np.bool_]:
        """Returns the nodes from which all goal cells are reachable despite roadblocks; see `onward`."""
        matrix = self._passable(blocked, stands, [])
        _, group = connected_components(matrix, directed=True, connection="strong")
        reverse = matrix.T.tocsr()
        result = np.ones(self._graph.nodes, dtype=np.bool_)
        # the nodes of a strongly connected group reach the same nodes, and most of a town is one group
        for goal in {int(group[goal]): goal for goal in goals}.values():
            order = breadth_first_order(reverse, goal, directed=True, return_predecessors=False)
            leading = np.zeros(self._graph.nodes, dtype=np.bool_)
            leading[order] = True
            result &= leading
        return result

    def leads_to(self, stand: Place, nodes: NDArray[np.bool_], blocked: Sequence[Place]) -> bool:
        """Returns whether one edge leads from a stopping place before a roadblock to one of the nodes (nodes,)."""
        edges = self._clear(self._graph.stand(stand, self._graph.start), blocked)
        return bool(nodes[edges.target].any())

    def _passable(
        self, blocked: Sequence[Place], stands: Sequence[Place], extra: Sequence[RoutingEdges]
    ) -> csr_matrix[np.float64]:
        joined = RoutingEdges.join([RoutingEdges.make(0), *extra, *(self._graph.stand(place) for place in stands)])
        return self._matrix(self._open(blocked, joined))

    def distances_to(self, goal: Place, blocked: Sequence[Place] = ()) -> NDArray[np.float64]:
        """Returns the cost from the start of each cell to a goal (cells,) [m at 40 km/h]; inf without a route."""
        edges = self._open(blocked, self._graph.arrivals(goal))
        result: NDArray[np.float64] = dijkstra(self._matrix(edges).T, indices=np.array(self._graph.goal))
        return result[: self._graph.cells]

    def _open(self, blocked: Sequence[Place], extra: RoutingEdges) -> RoutingEdges:
        """Returns the edges of the town and extra ones, without those blocked by roadblocks, sorted and unique."""
        edges = RoutingEdges.join([self._graph.edges, extra.cheapest(self._graph.nodes)])
        edges = self._clear(edges, blocked).cheapest(self._graph.nodes)
        return edges.take(np.argsort(edges.source * self._graph.nodes + edges.target, kind="stable"))

    def _clear(self, edges: RoutingEdges, blocked: Sequence[Place]) -> RoutingEdges:
        """Returns the edges that no roadblock blocks."""
        if not blocked:
            return edges
        closed = np.zeros(self._graph.nodes, dtype=np.bool_)
        closed[sorted(self.cells_of(blocked))] = True
        return edges.take(edges.clear_of(closed))

    def _matrix(self, edges: RoutingEdges) -> csr_matrix[np.float64]:
        """Returns sorted edges as a matrix of costs."""
        nodes = self._graph.nodes
        rows = np.searchsorted(edges.source, np.arange(nodes + 1))
        return csr_matrix((edges.cost, edges.target, rows), shape=(nodes, nodes))


def _trace(previous: NDArray[np.int32], source: int, target: int) -> IntArray:
    nodes = [target]
    while nodes[-1] != source:
        nodes.append(int(previous[nodes[-1]]))
    return np.array(nodes[::-1], dtype=np.int64)


def _lay(edges: RoutingEdges, start: Place, goal: Place, cost: float) -> Route:
    """Returns the route along a sequence of edges."""
    legs: list[Leg] = []
    lane, entry, begin = start[0], LaneEntry.FOLLOW, start[1]
    for k in range(len(edges)):
        within = edges.entry[k] == _FOLLOW and edges.leave[k] == edges.land[k]
        if within:
            continue
        legs.append(Leg(lane, entry, begin, float(edges.leave[k])))
        lane, entry, begin = int(edges.lane[k]), LANE_ENTRIES[edges.entry[k]], float(edges.land[k])
    legs.append(Leg(lane, entry, begin, goal[1]))
    length = sum(max(leg.end - leg.start, 0.0) for leg in legs) + float(edges.driven.sum())
    return Route(legs=tuple(legs), length=length, cost=cost)


@lru_cache(maxsize=16)
def router(town: Town) -> Router:
    """Returns the router of a town; built once for each town."""
    return Router(town)
