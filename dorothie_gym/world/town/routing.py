"""Ways through a town by what the car can do: follow lanes, turn, change lanes, turn round."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, dijkstra

from dorothie_gym.world.town.model import LinkType, Town
from dorothie_gym.world.town.oncoming import oncoming_lanes

CELL = 10.0
"""Lanes are cut into cells of about this length for the search [m]."""

CHANGE_LENGTH = 36.0
"""Road that a lane change takes in a plan [m]: three seconds at 40 km/h, and the first metre."""

SHORT_CHANGE = 16.0
"""Road that it takes at least, at a walking pace [m]; every metre less than `CHANGE_LENGTH` counts double."""

CHANGE_COST = 10.0
"""Metres of detour that a lane change is worth."""

TURN_COST = {LinkType.STRAIGHT: 0.0, LinkType.RIGHT: 5.0, LinkType.LEFT: 10.0, LinkType.U_TURN: 60.0}
"""Metres of detour that a turn at a junction is worth."""

U_TURN_COST = 60.0
"""Metres of detour that turning round in the road is worth."""


class Entry(enum.StrEnum):
    """How a lane of a route is entered."""

    FOLLOW = "follow"
    CHANGE_LEFT = "change_left"
    CHANGE_RIGHT = "change_right"
    U_TURN = "u_turn"


_KINDS = tuple(Entry)


@dataclass(frozen=True)
class Leg:
    """A lane of a route, how it is entered, and from where to where it is driven [m]."""

    lane: int
    entry: Entry
    start: float
    end: float


@dataclass(frozen=True, kw_only=True)
class Route:
    """Legs from a place to another; `length` [m] counts the driven road only."""

    legs: tuple[Leg, ...]
    length: float

    @property
    def lanes(self) -> tuple[int, ...]:
        """Lanes in order."""
        return tuple(leg.lane for leg in self.legs)

    def junctions(self, town: Town) -> tuple[int, ...]:
        """Ids of the junctions that are crossed, in order."""
        found: list[int] = []
        for leg in self.legs:
            junction = town.lanes[leg.lane].junction_id
            if junction >= 0 and (not found or found[-1] != junction):
                found.append(junction)
        return tuple(found)


Place = tuple[int, float]
"""A lane and the distance along it [m]."""


class Router:
    """Searches a town's lanes, cut into cells of about 10 m; made once for a town (`router`)."""

    def __init__(self, town: Town) -> None:
        self._town = town
        counts = [max(1, round(lane.length / CELL)) for lane in town.lanes]
        self._first = np.concatenate(([0], np.cumsum(counts)))
        self._counts = counts
        self._lane_of = np.repeat(np.arange(len(town.lanes)), counts)
        rows: list[int] = []
        columns: list[int] = []
        costs: list[float] = []
        lengths: list[float] = []
        kinds: list[int] = []

        def edge(source: int, target: int, extra: float, length: float, kind: Entry) -> None:
            rows.append(source)
            columns.append(target)
            costs.append(max(length + extra, 1e-3))
            lengths.append(length)
            kinds.append(_KINDS.index(kind))

        for lane in town.lanes:
            size = lane.length / counts[lane.id]
            first = int(self._first[lane.id])
            for k in range(counts[lane.id] - 1):
                edge(first + k, first + k + 1, 0.0, size, Entry.FOLLOW)
            for link in town.successors(lane.id):
                edge(
                    first + counts[lane.id] - 1, int(self._first[link.target]), TURN_COST[link.type], size, Entry.FOLLOW
                )
            self._add_side_edges(lane.id, edge)
        self._edge_kind = {(r, c): kind for r, c, kind in zip(rows, columns, kinds, strict=True)}
        self._edge_length = {(r, c): length for r, c, length in zip(rows, columns, lengths, strict=True)}
        size_of = int(self._first[-1])
        self._graph: csr_matrix[np.float64] = csr_matrix((costs, (rows, columns)), shape=(size_of, size_of))

    def _add_side_edges(self, lane_id: int, edge: object) -> None:
        assert callable(edge)
        town, lane = self._town, self._town.lanes[lane_id]
        if lane.in_junction:
            return
        size = lane.length / self._counts[lane_id]
        for side, kind in (
            (LinkType.LANE_CHANGE_LEFT, Entry.CHANGE_LEFT),
            (LinkType.LANE_CHANGE_RIGHT, Entry.CHANGE_RIGHT),
        ):
            target = town.neighbour(lane_id, side)
            if target is None:
                continue
            for k in range(self._counts[lane_id]):
                start = (k + 0.5) * size
                length = min(CHANGE_LENGTH, lane.length - start)
                if length < SHORT_CHANGE:
                    break
                there, _ = town.lanes[target].project(lane.position(start + length))
                extra = CHANGE_COST + 2.0 * (CHANGE_LENGTH - length)
                edge(self.cell(lane_id, start), self.cell(target, there), extra, length, kind)
        table = oncoming_lanes(town)
        for k in range(self._counts[lane_id]):
            oncoming = table.at(lane_id, (k + 0.5) * size)
            if oncoming is not None and town.lanes[oncoming.lane].length - oncoming.station > CELL:
                source, target_cell = self.cell(lane_id, (k + 0.5) * size), self.cell(oncoming.lane, oncoming.station)
                edge(source, target_cell, U_TURN_COST, 20.0, Entry.U_TURN)

    def cell(self, lane: int, station: float) -> int:
        """Number of the cell that holds a place."""
        count = self._counts[lane]
        k = int(station / self._town.lanes[lane].length * count)
        return int(self._first[lane]) + min(max(k, 0), count - 1)

    def cells_of(self, places: Iterable[Place]) -> set[int]:
        """Cells that hold places."""
        return {self.cell(lane, station) for lane, station in places}

    def route(self, start: Place, goal: Place, blocked: Sequence[Place] = ()) -> Route | None:
        """Cheapest way between two places, or None.

        Args:
            start: where the car is.
            goal: where it is to go; a goal a little behind the start on its own lane means a way round.
            blocked: places that cannot be passed (roadblocks).
        """
        source, target = self.cell(*start), self.cell(*goal)
        graph = self._without(self.cells_of(blocked) - {source})
        if source == target and goal[1] >= start[1] - 1.0:
            return Route(legs=(Leg(start[0], Entry.FOLLOW, start[1], goal[1]),), length=max(goal[1] - start[1], 0.0))
        if source == target:
            return self._round_trip(graph, start, goal)
        cost, previous = dijkstra(graph, indices=np.array(source), return_predecessors=True)
        if not math.isfinite(cost[target]):
            return None
        return self._compress(_trace(previous, source, target), start, goal)

    def _round_trip(self, graph: csr_matrix[np.float64], start: Place, goal: Place) -> Route | None:
        cell = self.cell(*start)
        cost, previous = dijkstra(graph, indices=np.array(cell), return_predecessors=True)
        column = self._graph.tocsc()[:, [cell]].tocoo()
        ends = [
            (float(cost[k] + last), int(k))
            for k, last in zip(column.row, column.data, strict=True)
            if math.isfinite(cost[k]) and (int(k), cell) in self._edge_kind
        ]
        if not ends:
            return None
        cells = _trace(previous, cell, min(ends)[1])
        return self._compress([*cells, cell], start, goal)

    def reachable(self, start: Place, blocked: Sequence[Place] = ()) -> NDArray[np.bool_]:
        """For every cell, whether it can be reached from a place past the roadblocks."""
        source = self.cell(*start)
        graph = self._without(self.cells_of(blocked) - {source})
        order = breadth_first_order(graph, source, directed=True, return_predecessors=False)
        found = np.zeros(graph.shape[0], dtype=np.bool_)
        found[order] = True
        return found

    def distances_to(self, goal: Place, blocked: Sequence[Place] = ()) -> NDArray[np.float64]:
        """Cost of the way from every cell to a goal [m of driving and its worth in detour]; inf where there is none."""
        target = self.cell(*goal)
        graph = self._without(self.cells_of(blocked) - {target})
        result: NDArray[np.float64] = dijkstra(graph.T, indices=np.array(target))
        return result

    def _without(self, cells: set[int]) -> csr_matrix[np.float64]:
        if not cells:
            return self._graph
        keep = np.ones(self._graph.shape[0])
        keep[sorted(cells)] = 0.0
        graph = self._graph.copy()
        graph.data = graph.data * keep[graph.indices]
        graph.eliminate_zeros()
        return graph

    def _compress(self, cells: list[int], start: Place, goal: Place) -> Route:
        legs: list[Leg] = []
        length = 0.0
        lane, entry, begin = start[0], Entry.FOLLOW, start[1]
        for k in range(1, len(cells)):
            kind = _KINDS[self._edge_kind[(cells[k - 1], cells[k])]]
            length += self._edge_length[(cells[k - 1], cells[k])]
            next_lane = int(self._lane_of[cells[k]])
            if next_lane == lane and kind is Entry.FOLLOW and cells[k] == cells[k - 1] + 1:
                continue
            size = self._town.lanes[lane].length / self._counts[lane]
            position = cells[k - 1] - int(self._first[lane])
            end = self._town.lanes[lane].length if kind is Entry.FOLLOW else (position + 0.5) * size
            legs.append(Leg(lane, entry, begin, max(end, begin)))
            lane, entry = next_lane, kind
            begin = (cells[k] - int(self._first[lane])) * self._town.lanes[lane].length / self._counts[lane]
        legs.append(Leg(lane, entry, min(begin, goal[1]), goal[1]))
        return Route(legs=tuple(legs), length=length)


def _trace(previous: NDArray[np.int32], source: int, target: int) -> list[int]:
    cells = [target]
    while cells[-1] != source:
        cells.append(int(previous[cells[-1]]))
    return cells[::-1]


@lru_cache(maxsize=16)
def router(town: Town) -> Router:
    """The router of a town, made once."""
    return Router(town)
