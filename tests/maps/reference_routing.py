"""Reference of the route search: all edges as NumPy columns, searched by scipy."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from dorothie_gym.maps import Lane, LinkType, Town
from dorothie_gym.maps.lane_neighbours import OncomingLanes, oncoming_lanes
from dorothie_gym.maps.model import Array
from dorothie_gym.maps.routing import LaneEntry, Leg, Place, Route
from dorothie_gym.maps.routing_graph import (
    CELL,
    CHANGE_COST,
    CHANGE_LEAD,
    CHANGE_LENGTH,
    LANE_ENTRIES,
    LATE_CHANGE,
    MAX_ASIDE,
    SHARED,
    SHORT_CHANGE,
    SLIGHTLY_BEHIND,
    SPEEDS,
    TURN_COST,
    U_TURN_COST,
    U_TURN_LENGTH,
    U_TURN_REST,
    USUAL_SPEED,
)

IntArray = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class RoutingEdges:
    """Edges of the routing graph as columns; all arrays are (n,).

    Attributes:
        source, target: nodes.
        cost: cost [m at 40 km/h].
        entry: index into `LANE_ENTRIES`; FOLLOW within a lane and across its end.
        lane: lane at the end of the edge.
        leave: station on the previous lane at which the edge begins [m].
        land: station on `lane` at which it ends [m].
        driven: length of a lane change or U-turn [m], else 0.
        first, last: range of traversed cells of the previous lane, both included; empty if `last` < `first`.
        onto, until: the same for `lane`.
    """

    source: IntArray
    target: IntArray
    cost: Array
    entry: IntArray
    lane: IntArray
    leave: Array
    land: Array
    driven: Array
    first: IntArray
    last: IntArray
    onto: IntArray
    until: IntArray

    def __len__(self) -> int:
        return len(self.source)

    def take(self, rows: NDArray[np.bool_] | IntArray) -> RoutingEdges:
        """Returns the selected edges."""
        return RoutingEdges(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    @classmethod
    def join(cls, tables: Sequence[RoutingEdges]) -> RoutingEdges:
        """Concatenates several tables."""
        return cls(**{f.name: np.concatenate([getattr(table, f.name) for table in tables]) for f in fields(cls)})

    @classmethod
    def make(cls, count: int, **columns: object) -> RoutingEdges:
        """Builds edges from columns given as arrays or single values.

        Missing columns are 0, and the ranges of traversed cells are empty.
        """
        table: dict[str, Any] = {}  # arrays of integers and of floats
        for field in fields(cls):
            value = columns.get(field.name, -1 if field.name in ("last", "until") else 0)
            real = field.name in ("cost", "leave", "land", "driven")
            table[field.name] = np.broadcast_to(np.asarray(value, dtype=np.float64 if real else np.int64), count)
        return cls(**table)

    def cheapest(self, nodes: int) -> RoutingEdges:
        """Returns only the cheapest edge between each pair of nodes, sorted by source and target."""
        key = self.source * nodes + self.target
        order = np.lexsort((self.cost, key))
        key = key[order]
        return self.take(order[np.concatenate(([True], key[1:] != key[:-1]))] if len(key) else order)

    def clear_of(self, blocked: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Returns which edges neither end in nor traverse blocked cells (n,); `blocked` has an entry for each node."""
        before = np.concatenate(([0], np.cumsum(blocked)))
        on_first = before[np.maximum(self.last + 1, self.first)] - before[self.first]
        on_second = before[np.maximum(self.until + 1, self.onto)] - before[self.onto]
        result: NDArray[np.bool_] = (on_first + on_second == 0) & ~blocked[self.target]
        return result


_SIDES = ((LinkType.LANE_CHANGE_LEFT, LaneEntry.CHANGE_LEFT), (LinkType.LANE_CHANGE_RIGHT, LaneEntry.CHANGE_RIGHT))


class ReferenceGraph:
    """Cells of a town and the edges between them.

    Attributes:
        cells: number of cells; nodes are the cells, then the tails of the lanes, then `start` and `goal`.
        start, goal: nodes of the start and the goal of a search.
        edges: cheapest edge between each pair of cells and tails.
        manoeuvres: lane changes and U-turns from the starts of cells to the exact place where they end, whose cell is
            the target (in `edges` they lead to the start of the next cell instead).
    """

    def __init__(self, town: Town) -> None:
        self._town = town
        self._oncoming: OncomingLanes = oncoming_lanes(town)
        lengths = np.array([lane.length for lane in town.lanes])
        self._counts = np.maximum(1, np.round(lengths / CELL)).astype(np.int64)
        self._sizes = lengths / self._counts
        self._lengths = lengths
        self.first = np.concatenate(([0], np.cumsum(self._counts))).astype(np.int64)
        self.cells = int(self.first[-1])
        self.start, self.goal = self.cells + len(town.lanes), self.cells + len(town.lanes) + 1
        limits = np.clip([lane.speed_limit for lane in town.lanes], *SPEEDS)
        self._weights = USUAL_SPEED / limits
        # all lanes in one row with gaps of one metre, to interpolate on many lanes at once
        self._offsets = np.concatenate(([0.0], np.cumsum(lengths + 1.0)))
        self._stations = np.concatenate(
            [lane.stations + offset for lane, offset in zip(town.lanes, self._offsets[:-1], strict=True)]
        )
        self._points = np.concatenate([lane.points for lane in town.lanes])
        starts = {lane.id: self._starts(lane.id) for lane in town.lanes if not lane.in_junction}
        self.manoeuvres = RoutingEdges.join([self._changes(starts), self._u_turns(starts)])
        tables = [self._within_lanes(), self._across_ends(), self._onward(self.manoeuvres)]
        self.edges = RoutingEdges.join(tables).cheapest(self.nodes)

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self.goal + 1

    def cell(self, lane: int, station: float) -> int:
        """Returns the cell that contains a place."""
        return int(self._cells_at(lane, np.array([station]))[0])

    # --- Edges between cells -----------------------------------------------------------------------------------------

    def _cells_at(self, lane: int | IntArray, stations: Array) -> IntArray:
        k = (stations / self._sizes[lane]).astype(np.int64)
        result: IntArray = self.first[lane] + np.clip(k, 0, self._counts[lane] - 1)
        return result

    def _starts(self, lane: int) -> Array:
        """Returns the stations at which the cells of a lane begin (n,) [m]."""
        starts: Array = np.arange(self._counts[lane]) * self._sizes[lane]
        return starts

    def _within_lanes(self) -> RoutingEdges:
        """Returns the edges between successive cells of each lane."""
        owner = np.repeat(np.arange(len(self._counts)), self._counts)
        inner = np.ones(self.cells, dtype=np.bool_)
        inner[self.first[1:] - 1] = False
        source = np.flatnonzero(inner)
        lane = owner[source]
        land = (source + 1 - self.first[lane]) * self._sizes[lane]
        cost = self._sizes[lane] * self._weights[lane]
        return RoutingEdges.make(
            len(source), source=source, target=source + 1, cost=cost, lane=lane, leave=land, land=land
        )

    def _across_ends(self) -> RoutingEdges:
        """Returns the edges from the last cell and the tail of each lane to the first cells of its successors."""
        links = [link for link in self._town.links if not link.type.is_lane_change]
        source = np.array([link.source for link in links], dtype=np.int64)
        target = np.array([link.target for link in links], dtype=np.int64)
        turn = np.array([TURN_COST[link.type] for link in links])
        last = self.first[source + 1] - 1
        common = {"target": self.first[target], "lane": target, "leave": self._lengths[source]}
        along = self._sizes[source] * self._weights[source]
        return RoutingEdges.join(
            [
                RoutingEdges.make(len(links), source=last, cost=along + turn, **common),
                # the search ignores edges without cost
                RoutingEdges.make(len(links), source=self.cells + source, cost=np.maximum(turn, 1e-3), **common),
            ]
        )

    def _onward(self, manoeuvres: RoutingEdges) -> RoutingEdges:
        """Extends lane changes and U-turns to the start of the next cell, or to the tail of the lane."""
        lane, cell = manoeuvres.lane, manoeuvres.target
        tail = cell + 1 == self.first[lane + 1]
        ahead = np.where(tail, self._lengths[lane], (cell + 1 - self.first[lane]) * self._sizes[lane])
        return replace(
            manoeuvres,
            target=np.where(tail, self.cells + lane, cell + 1),
            cost=manoeuvres.cost + (ahead - manoeuvres.land) * self._weights[lane],
        )

    # --- Lane changes and U-turns ------------------------------------------------------------------------------------

    def _changes(self, begins: Mapping[int, Array]) -> RoutingEdges:
        """Returns lane changes of three lengths from the given stations (n,) [m] of each lane."""
        pairs = [
            (lane, beside, LANE_ENTRIES.index(entry))
            for lane in begins
            for side, entry in _SIDES
            if (beside := self._town.neighbour(lane, side)) is not None
        ]
        if not pairs:
            return _NONE
        source, target, entry = np.repeat(
            np.array(pairs, dtype=np.int64), [3 * len(begins[lane]) for lane, _, _ in pairs], axis=0
        ).T
        begin = np.concatenate([np.repeat(begins[lane], 3) for lane, _, _ in pairs])
        room = self._lengths[source] - begin
        wanted = np.tile((SHORT_CHANGE, (SHORT_CHANGE + CHANGE_LENGTH) / 2, CHANGE_LENGTH), len(begin) // 3)
        # the longest is limited by the rest of the lane
        road = np.where(wanted == CHANGE_LENGTH, np.minimum(wanted, room), wanted)
        fits = (road >= SHORT_CHANGE) & (road <= room)
        return self._change(source[fits], target[fits], entry[fits], begin[fits], road[fits])

    def _change(self, source: IntArray, target: IntArray, entry: IntArray, begin: Array, road: Array) -> RoutingEdges:
        """Returns lane changes of length `road` (n,) [m] from `begin` (n,) [m] where the lanes lie side by side."""
        leave, end = begin + CHANGE_LEAD, begin + road
        on, off = self._project(np.tile(target, 2), self._positions(np.tile(source, 2), np.concatenate((leave, end))))
        on, off = on.reshape(2, -1), off.reshape(2, -1)
        edges = RoutingEdges.make(
            len(begin),
            source=self._cells_at(source, begin),
            target=self._cells_at(target, on[1]),
            cost=road * self._weights[source] + CHANGE_COST + 2.0 * (CHANGE_LENGTH - road) + LATE_CHANGE * begin,
            entry=entry,
            lane=target,
            leave=leave,
            land=on[1],
            driven=end - leave,
            first=self._cells_at(source, begin),
            last=self._cells_at(source, leave + SHARED * (end - leave)),
            onto=self._cells_at(target, on[1] - SHARED * (on[1] - on[0])),
            until=self._cells_at(target, on[1]),
        )
        near: NDArray[np.bool_] = np.all(off < MAX_ASIDE, axis=0)
        return edges.take(near)

    def _positions(self, lanes: IntArray, stations: Array) -> Array:
        """Returns positions on centre lines (n, 2) [m]."""
        at = self._offsets[lanes] + stations
        return np.column_stack([np.interp(at, self._stations, self._points[:, k]) for k in (0, 1)])

    def _project(self, lanes: IntArray, positions: Array) -> tuple[Array, Array]:
        """Projects positions (n, 2) onto one lane each: station (n,) and distance (n,) [m]."""
        along, away = np.empty(len(lanes)), np.empty(len(lanes))
        order = np.argsort(lanes, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(lanes[order])) + 1):
            if len(rows):
                along[rows], away[rows] = _project(self._town.lanes[lanes[rows[0]]], positions[rows])
        return along, away

    def _u_turns(self, starts: Mapping[int, Array]) -> RoutingEdges:
        """Returns the U-turns from the middle of each cell; `starts` are the starts of the cells by lane (n,) [m]."""
        rows = [
            (lane, float(begin), float(begin + 0.5 * self._sizes[lane])) for lane in starts for begin in starts[lane]
        ]
        return self._turn_round(rows)

    def _turn_round(self, rows: Iterable[tuple[int, float, float]]) -> RoutingEdges:
        """Returns U-turns where there is an oncoming lane with sufficient length behind them.

        Args:
            rows: lane, station from which the cost counts, and station at which the U-turn begins [m].
        """
        found = []
        for lane, begin, leave in rows:
            oncoming = self._oncoming.at(lane, leave)
            if oncoming is not None and self._lengths[oncoming.lane] - oncoming.station > CELL:
                found.append((lane, begin, leave, oncoming.lane, oncoming.station))
        lanes, begins, leaves, others, stations = np.array(found, dtype=np.float64).reshape(-1, 5).T
        source, target = lanes.astype(np.int64), others.astype(np.int64)
        landing = self._cells_at(target, stations + U_TURN_REST)
        return RoutingEdges.make(
            len(found),
            source=self._cells_at(source, begins),
            target=landing,
            cost=(leaves - begins) * self._weights[source]
            + U_TURN_LENGTH
            + U_TURN_COST
            + U_TURN_REST * self._weights[target],
            entry=LANE_ENTRIES.index(LaneEntry.U_TURN),
            lane=target,
            leave=leaves,
            land=stations + U_TURN_REST,
            driven=U_TURN_LENGTH + U_TURN_REST,
            onto=self._cells_at(target, stations),
            until=landing,
        )

    # --- Start and goal of a search ----------------------------------------------------------------------------------

    def arrivals(self, goal: Place) -> RoutingEdges:
        """Returns the edges to a goal: along its cell, and lane changes and U-turns that end before it in its cell."""
        lane, station = goal
        cell = self.cell(lane, station)
        begin = (cell - int(self.first[lane])) * self._sizes[lane]
        along = RoutingEdges.make(
            1, source=cell, cost=self._cost(lane, station - begin), lane=lane, leave=station, land=station
        )
        return self._up_to(goal, self.manoeuvres, along)

    def departures(self, start: Place, goal: Place | None, obstacles: Iterable[Place]) -> RoutingEdges:
        """Returns the edges from a start: along its lane, and lane changes and U-turns that begin there.

        Args:
            start: place of the car.
            goal: goal, for edges that connect both directly.
            obstacles: impassable places; in the cell of the start only those ahead count.
        """
        lane, station = self._town.lanes[start[0]], start[1]
        cell = self.cell(*start)
        ahead = (at for on, at in obstacles if on == start[0] and at >= station and self.cell(on, at) == cell)
        nearest = min(ahead, default=np.inf)
        manoeuvres = self._manoeuvres_from(lane, station, nearest)
        tables = [self._onward(manoeuvres)]
        if nearest == np.inf:
            tables.append(self._following(lane, station, cell))
        if goal is not None:
            direct = _NONE
            within = cell == self.cell(*goal) and goal[1] >= station - SLIGHTLY_BEHIND
            if within and nearest > goal[1]:
                cost = self._cost(lane.id, goal[1] - station)
                direct = RoutingEdges.make(1, cost=cost, lane=lane.id, leave=goal[1], land=goal[1])
            tables.append(self._up_to(goal, manoeuvres, direct))
        edges = RoutingEdges.join(tables)
        # obstacles in the cell of the start were already considered by position
        return replace(edges, source=np.full(len(edges), self.start), first=np.full(len(edges), cell + 1))

    def _manoeuvres_from(self, lane: Lane, station: float, nearest: float) -> RoutingEdges:
        """Returns the lane changes and U-turns from a station up to the nearest obstacle [m]."""
        if lane.in_junction:
            return _NONE
        changes = self._changes({lane.id: np.array([station])})
        changes = changes.take(changes.leave + SHARED * changes.driven < nearest)
        # also from the middle of the cell: just behind a junction there may be no oncoming lane
        middle = (self.cell(lane.id, station) - int(self.first[lane.id]) + 0.5) * float(self._sizes[lane.id])
        leaves = [leave for leave in sorted({station, max(station, middle)}) if leave <= nearest]
        return RoutingEdges.join([changes, self._turn_round((lane.id, station, leave) for leave in leaves)])

    def _following(self, lane: Lane, station: float, cell: int) -> RoutingEdges:
        """Returns the edges from a place along its lane."""
        rows = self.edges.take((self.edges.source == cell) & (self.edges.entry == LANE_ENTRIES.index(LaneEntry.FOLLOW)))
        gone = station - (cell - int(self.first[lane.id])) * self._sizes[lane.id]
        return replace(rows, cost=np.maximum(rows.cost - gone * self._weights[lane.id], 1e-3))

    def _up_to(self, goal: Place, manoeuvres: RoutingEdges, more: RoutingEdges) -> RoutingEdges:
        """Returns the edges to a goal: lane changes and U-turns that end before it in its cell, and those in `more`."""
        lane, station = goal
        there = manoeuvres.take((manoeuvres.target == self.cell(*goal)) & (manoeuvres.land <= station))
        edges = RoutingEdges.join([there, more])
        cost = edges.cost + np.maximum(station - edges.land, 0.0) * self._weights[lane]
        return replace(edges, cost=cost, target=np.full(len(edges), self.goal))

    def _cost(self, lane: int, distance: float) -> float:
        """Returns the cost of driving along a lane; always positive, because the search ignores edges without cost."""
        return max(float(distance * self._weights[lane]), 1e-3)


_NONE = RoutingEdges.make(0)


def _project(lane: Lane, positions: Array) -> tuple[Array, Array]:
    """Projects positions (n, 2) onto a lane: station (n,) and distance (n,) [m]."""
    a, d = lane.points[:-1, :2], np.diff(lane.points[:, :2], axis=0)
    to = positions[:, None, :] - a  # (n, segments, 2)
    t = np.clip(np.einsum("nsk,sk->ns", to, d) / np.einsum("sk,sk->s", d, d), 0.0, 1.0)
    away = np.linalg.norm(to - t[..., None] * d, axis=2)
    best = np.argmin(away, axis=1)
    row = np.arange(len(positions))
    along = lane.stations[best] + t[row, best] * np.diff(lane.stations)[best]
    return along, away[row, best]


class ReferenceRouter:
    """Route search by scipy."""

    def __init__(self, town: Town) -> None:
        self.graph = ReferenceGraph(town)

    def route(self, start: Place, goal: Place, blocked: Sequence[Place] = ()) -> Route | None:
        """Returns the cheapest route between two places, or None if there is none."""
        graph = self.graph
        extra = RoutingEdges.join([graph.departures(start, goal, blocked), graph.arrivals(goal)])
        edges = self._open(blocked, extra)
        cost, previous = dijkstra(self._matrix(edges), indices=np.array(graph.start), return_predecessors=True)
        if not math.isfinite(cost[graph.goal]):
            return None
        nodes = [graph.goal]
        while nodes[-1] != graph.start:
            nodes.append(int(previous[nodes[-1]]))
        path = np.array(nodes[::-1], dtype=np.int64)
        keys = edges.source * graph.nodes + edges.target
        taken = edges.take(np.searchsorted(keys, path[:-1] * graph.nodes + path[1:]))
        return _lay(taken, start, goal, float(cost[graph.goal]))

    def distances_to(self, goal: Place, blocked: Sequence[Place] = ()) -> NDArray[np.float64]:
        """Returns the cost from the start of each cell to a goal (cells,) [m at 40 km/h]; inf without a route."""
        edges = self._open(blocked, self.graph.arrivals(goal))
        result: NDArray[np.float64] = dijkstra(self._matrix(edges).T, indices=np.array(self.graph.goal))
        return result[: self.graph.cells]

    def _open(self, blocked: Sequence[Place], extra: RoutingEdges) -> RoutingEdges:
        nodes = self.graph.nodes
        edges = RoutingEdges.join([self.graph.edges, extra.cheapest(nodes)])
        closed = np.zeros(nodes, dtype=np.bool_)
        closed[[self.graph.cell(*place) for place in blocked]] = True
        edges = edges.take(edges.clear_of(closed)).cheapest(nodes)
        return edges.take(np.argsort(edges.source * nodes + edges.target, kind="stable"))

    def _matrix(self, edges: RoutingEdges) -> csr_matrix[np.float64]:
        nodes = self.graph.nodes
        rows = np.searchsorted(edges.source, np.arange(nodes + 1))
        return csr_matrix((edges.cost, edges.target, rows), shape=(nodes, nodes))


def _lay(edges: RoutingEdges, start: Place, goal: Place, cost: float) -> Route:
    legs: list[Leg] = []
    lane, entry, begin = start[0], LaneEntry.FOLLOW, start[1]
    for k in range(len(edges)):
        if LANE_ENTRIES[edges.entry[k]] is LaneEntry.FOLLOW and edges.leave[k] == edges.land[k]:
            continue
        legs.append(Leg(lane, entry, begin, float(edges.leave[k])))
        lane, entry, begin = int(edges.lane[k]), LANE_ENTRIES[edges.entry[k]], float(edges.land[k])
    legs.append(Leg(lane, entry, begin, goal[1]))
    length = sum(max(leg.end - leg.start, 0.0) for leg in legs) + float(edges.driven.sum())
    return Route(legs=tuple(legs), length=length, cost=cost)
