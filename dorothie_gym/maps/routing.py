"""Ways through a town by what the car can do: follow lanes, turn, change lanes, turn round."""

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
    ENTRIES,
    SHORT_CHANGE,
    TURN_COST,
    U_TURN_COST,
    CellGraph,
    Entry,
    IntArray,
    Moves,
    Place,
)
from dorothie_gym.maps.town import Town

__all__ = [
    "CELL",
    "CHANGE_COST",
    "CHANGE_LENGTH",
    "SHORT_CHANGE",
    "TURN_COST",
    "U_TURN_COST",
    "Entry",
    "Instruction",
    "Leg",
    "Place",
    "Route",
    "Router",
    "router",
]

_FOLLOW = ENTRIES.index(Entry.FOLLOW)

# What a lane that is not simply followed is called, and its angle as the actions say it [degrees, positive left].
_MANOEUVRES = {
    Entry.CHANGE_LEFT: (LinkType.LANE_CHANGE_LEFT, 90),
    Entry.CHANGE_RIGHT: (LinkType.LANE_CHANGE_RIGHT, -90),
    Entry.U_TURN: (LinkType.U_TURN, -180),
}


@dataclass(frozen=True)
class Leg:
    """A lane of a route, how it is entered, and from where to where it is driven [m]."""

    lane: int
    entry: Entry
    start: float
    end: float


@dataclass(frozen=True, kw_only=True)
class Instruction:
    """One thing to do on a route, as a person would say it: a turn at a junction, a lane change or a U-turn.

    Attributes:
        entry: FOLLOW for a way across a junction.
        type: of the turn or lane change; U_TURN for turning round in the road, too.
        angle: degrees, positive left: that of the exit, 90 or -90 for a lane change, -180 for turning round.
        lane: lane that is left.
        onto: lane that the car is on afterwards.
        junction_id: junction that is crossed, or -1.
        street: index of the street of `onto`, or -1.
        choice: whether there is another way on, so that it has to be said; always for lane changes and U-turns.
        distance: from the start of the route to where it begins [m].
    """

    entry: Entry
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
    """Legs from a place to another.

    Attributes:
        legs: in order.
        length: way that is driven, with that of lane changes and U-turns between legs [m].
        cost: what the way takes or is worth [m at 40 km/h]: shorter where the speed limit is higher, more for turns.
    """

    legs: tuple[Leg, ...]
    length: float
    cost: float = math.nan

    @property
    def lanes(self) -> tuple[int, ...]:
        """Lanes in order."""
        return tuple(leg.lane for leg in self.legs)

    def junctions(self, town: Town) -> tuple[int, ...]:
        """Ids of the junctions that are crossed, in order; one that is crossed twice in a row counts once."""
        found: list[int] = []
        for leg in self.legs:
            junction = town.lanes[leg.lane].junction_id
            if junction >= 0 and (not found or found[-1] != junction):
                found.append(junction)
        return tuple(found)

    def turns(self, town: Town) -> tuple[Instruction, ...]:
        """What there is to do on the way, in order: ways across junctions, lane changes and U-turns."""
        found: list[Instruction] = []
        distance = 0.0
        for one, two in zip(self.legs[:-1], self.legs[1:], strict=True):
            distance += one.end - one.start
            instruction = _instruction(town, one, two, distance)
            if instruction is not None:
                found.append(instruction)
        return tuple(found)


def _instruction(town: Town, one: Leg, two: Leg, distance: float) -> Instruction | None:
    """How to come from one leg to the next; None where the road just goes on."""
    if two.entry is not Entry.FOLLOW:
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
        entry=Entry.FOLLOW,
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
    """Searches a town's lanes, cut into cells of about 10 m; made once for a town (`router`)."""

    def __init__(self, town: Town) -> None:
        self._town = town
        self._graph = CellGraph(town)

    def cell(self, lane: int, station: float) -> int:
        """Number of the cell that holds a place."""
        return self._graph.cell(lane, station)

    def cells_of(self, places: Iterable[Place]) -> set[int]:
        """Cells that hold places."""
        return self._graph.cells_of(places)

    def route(self, start: Place, goal: Place, blocked: Sequence[Place] = ()) -> Route | None:
        """Cheapest way between two places, or None.

        Args:
            start: where the car is.
            goal: where it is to go; a goal a little behind the start on its own lane means a way round.
            blocked: places that cannot be passed (roadblocks). No way leads through the cells that hold them, or into
                those by a lane change; in the start's own cell only those ahead count.
        """
        graph = self._graph
        extra = Moves.join([graph.departures(start, goal, blocked), graph.arrivals(goal)])
        moves = self._open(blocked, extra)
        cost, previous = dijkstra(self._matrix(moves), indices=np.array(graph.start), return_predecessors=True)
        if not math.isfinite(cost[graph.goal]):
            return None
        nodes = _trace(previous, graph.start, graph.goal)
        keys = moves.source * graph.nodes + moves.target
        taken = moves.take(np.searchsorted(keys, nodes[:-1] * graph.nodes + nodes[1:]))
        return _lay(taken, start, goal, float(cost[graph.goal]))

    def reachable(self, start: Place, blocked: Sequence[Place] = ()) -> NDArray[np.bool_]:
        """For every cell, whether it can be reached from a place past the roadblocks; the start's own always can."""
        moves = self._open(blocked, self._graph.departures(start, None, blocked))
        order = breadth_first_order(self._matrix(moves), self._graph.start, directed=True, return_predecessors=False)
        found = np.zeros(self._graph.nodes, dtype=np.bool_)
        found[order] = True
        found[self.cell(*start)] = True
        return found[: self._graph.cells]

    def onward(self, start: Place, blocked: Sequence[Place] = (), stands: Sequence[Place] = (),
               held: Place | None = None) -> NDArray[np.bool_]:  # fmt: skip
        """For every node of the graph, whether a car comes to it that drives on from a place past the roadblocks.

        The nodes are the starts of the cells, in their order, then the tails of the lanes (`cells`). The cell that the
        start is in counts if the car can come back to its beginning.

        Args:
            start: where the car is.
            blocked: places that cannot be passed, see `route`.
            stands: where cars stand before the roadblocks, at the beginnings of the blocked stretches.
            held: where the car itself has to stand before the next roadblock, if that is near.
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
        """For every node, whether all of some cells can be reached from it past the roadblocks; see `onward`."""
        matrix = self._passable(blocked, stands, [])
        _, group = connected_components(matrix, directed=True, connection="strong")
        reverse = matrix.T.tocsr()
        result = np.ones(self._graph.nodes, dtype=np.bool_)
        # what leads to one node of a group leads to all of it, and in a town nearly everything is one group
        for goal in {int(group[goal]): goal for goal in goals}.values():
            order = breadth_first_order(reverse, goal, directed=True, return_predecessors=False)
            leading = np.zeros(self._graph.nodes, dtype=np.bool_)
            leading[order] = True
            result &= leading
        return result

    def leads_to(self, stand: Place, nodes: NDArray[np.bool_], blocked: Sequence[Place]) -> bool:
        """Whether a car that stands before a roadblock can go from there straight to one of some nodes."""
        moves = self._clear(self._graph.stand(stand, self._graph.start), blocked)
        return bool(nodes[moves.target].any())

    def _passable(
        self, blocked: Sequence[Place], stands: Sequence[Place], extra: Sequence[Moves]
    ) -> csr_matrix[np.float64]:
        joined = Moves.join([Moves.make(0), *extra, *(self._graph.stand(place) for place in stands)])
        return self._matrix(self._open(blocked, joined))

    def distances_to(self, goal: Place, blocked: Sequence[Place] = ()) -> NDArray[np.float64]:
        """Cost of the way from the start of every cell to a goal [m at 40 km/h]; inf where there is none."""
        moves = self._open(blocked, self._graph.arrivals(goal))
        result: NDArray[np.float64] = dijkstra(self._matrix(moves).T, indices=np.array(self._graph.goal))
        return result[: self._graph.cells]

    def _open(self, blocked: Sequence[Place], extra: Moves) -> Moves:
        """The town's moves and some more, without those that roadblocks prevent; ordered, each pair of nodes once."""
        moves = Moves.join([self._graph.moves, extra.cheapest(self._graph.nodes)])
        moves = self._clear(moves, blocked).cheapest(self._graph.nodes)
        return moves.take(np.argsort(moves.source * self._graph.nodes + moves.target, kind="stable"))

    def _clear(self, moves: Moves, blocked: Sequence[Place]) -> Moves:
        """Those moves that no roadblock prevents."""
        if not blocked:
            return moves
        closed = np.zeros(self._graph.nodes, dtype=np.bool_)
        closed[sorted(self.cells_of(blocked))] = True
        return moves.take(moves.clear_of(closed))

    def _matrix(self, moves: Moves) -> csr_matrix[np.float64]:
        """Moves in their order as a matrix of costs."""
        nodes = self._graph.nodes
        rows = np.searchsorted(moves.source, np.arange(nodes + 1))
        return csr_matrix((moves.cost, moves.target, rows), shape=(nodes, nodes))


def _trace(previous: NDArray[np.int32], source: int, target: int) -> IntArray:
    nodes = [target]
    while nodes[-1] != source:
        nodes.append(int(previous[nodes[-1]]))
    return np.array(nodes[::-1], dtype=np.int64)


def _lay(moves: Moves, start: Place, goal: Place, cost: float) -> Route:
    """Legs along the moves of a way."""
    legs: list[Leg] = []
    lane, entry, begin = start[0], Entry.FOLLOW, start[1]
    for k in range(len(moves)):
        within = moves.entry[k] == _FOLLOW and moves.leave[k] == moves.land[k]
        if within:
            continue
        legs.append(Leg(lane, entry, begin, float(moves.leave[k])))
        lane, entry, begin = int(moves.lane[k]), ENTRIES[moves.entry[k]], float(moves.land[k])
    legs.append(Leg(lane, entry, begin, goal[1]))
    length = sum(max(leg.end - leg.start, 0.0) for leg in legs) + float(moves.driven.sum())
    return Route(legs=tuple(legs), length=length, cost=cost)


@lru_cache(maxsize=16)
def router(town: Town) -> Router:
    """The router of a town, made once."""
    return Router(town)
