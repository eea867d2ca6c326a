"""Routing graph: cells of about 10 m and the edges between them, with their costs."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.lane_neighbours import OncomingLanes, oncoming_lanes
from dorothie_gym.maps.model import Array, Lane, LinkType
from dorothie_gym.maps.town import Town

IntArray: TypeAlias = NDArray[np.int64]


class Entry(enum.StrEnum):
    """How a lane of a route is entered."""

    FOLLOW = "follow"
    CHANGE_LEFT = "change_left"
    CHANGE_RIGHT = "change_right"
    U_TURN = "u_turn"


ENTRIES = tuple(Entry)


@dataclass(frozen=True, kw_only=True, eq=False)
class Moves:
    """Edges of the graph, one a row; all arrays are (n,).

    Attributes:
        source, target: nodes.
        cost: metres at 40 km/h that it takes or is worth.
        entry: index in `ENTRIES`; FOLLOW within a lane and across its end.
        lane: that the move ends on.
        leave: distance along the lane before at which the move begins [m].
        land: distance along `lane` at which it ends [m].
        driven: length of a lane change or U-turn itself [m], else 0.
        first, last: cells of the lane before that it passes, both included; none where `last` < `first`.
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

    def take(self, rows: NDArray[np.bool_] | IntArray) -> Moves:
        """Some of the moves."""
        return Moves(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    @classmethod
    def join(cls, tables: Sequence[Moves]) -> Moves:
        """All moves of several tables."""
        return cls(**{f.name: np.concatenate([getattr(table, f.name) for table in tables]) for f in fields(cls)})

    @classmethod
    def make(cls, count: int, **columns: object) -> Moves:
        """Moves from columns that are arrays or single values; those left out are 0, and no cells are passed."""
        table: dict[str, Any] = {}
        for field in fields(cls):
            value = columns.get(field.name, -1 if field.name in ("last", "until") else 0)
            real = field.name in ("cost", "leave", "land", "driven")
            table[field.name] = np.broadcast_to(np.asarray(value, dtype=np.float64 if real else np.int64), count)
        return cls(**table)

    def cheapest(self, nodes: int) -> Moves:
        """Of the moves between the same two nodes only the cheapest, ordered by source and target."""
        key = self.source * nodes + self.target
        order = np.lexsort((self.cost, key))
        key = key[order]
        return self.take(order[np.concatenate(([True], key[1:] != key[:-1]))] if len(key) else order)

    def clear_of(self, blocked: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which moves neither end in blocked cells nor pass any; `blocked` has a row for every node."""
        before = np.concatenate(([0], np.cumsum(blocked)))
        on_first = before[np.maximum(self.last + 1, self.first)] - before[self.first]
        on_second = before[np.maximum(self.until + 1, self.onto)] - before[self.onto]
        result: NDArray[np.bool_] = (on_first + on_second == 0) & ~blocked[self.target]
        return result


# --- A town cut into cells of about 10 m, and the moves that lead from one to another: the graph that rou ------------

Place: TypeAlias = tuple[int, float]
"""A lane and the distance along it [m]."""

CELL = 10.0
"""Lanes are cut into cells of about this length for the search [m]."""

CHANGE_LENGTH = 36.0
"""Road that a lane change takes in a plan [m]: three seconds at 40 km/h, and the first metre."""

SHORT_CHANGE = 16.0
"""Road that it takes at least [m]: what the planner needs (15 m), and a metre to ask for it; every metre less than
`CHANGE_LENGTH` counts double."""

CHANGE_LEAD = 1.0
"""The first metre of a lane change is still driven straight on [m]."""

CHANGE_COST = 10.0
"""Metres of detour that a lane change is worth."""

LATE_CHANGE = 0.01
"""What a lane change costs more for every metre that it comes later on its lane: of equal ones the first is taken."""

SHARED = 2.0 / 3.0
"""Share of a lane change during which the car is in the way of, or in danger from, what stands on the one lane: for so
long after its beginning on the lane that it leaves, and before its end on the other (it is 1.7 m aside by then)."""

MAX_ASIDE = 6.0
"""Largest distance between the centre lines of lanes that one can change between [m]."""

TURN_COST = {LinkType.STRAIGHT: 0.0, LinkType.RIGHT: 5.0, LinkType.LEFT: 10.0, LinkType.U_TURN: 60.0}
"""Metres of detour that a turn at a junction is worth."""

U_TURN_COST = 60.0
"""Metres of detour that turning round in the road is worth."""

U_TURN_LENGTH = 20.0
"""Way that turning round takes [m]."""

U_TURN_REST = 6.0
"""Way that a car which has turned round goes on before it can stand: a goal is not nearer than this behind it [m]."""

SLIGHTLY_BEHIND = 1.0
"""A goal that lies no further behind than this is not worth a way round [m]."""

USUAL_SPEED = 40.0 / 3.6
"""Speed at which a metre counts as a metre [m/s]; where one may drive faster it counts for less, as time does."""

SPEEDS = (10.0 / 3.6, 60.0 / 3.6)
"""Limits below and above these make no difference [m/s]: a Co-Wizard never cruises at more than 60 km/h."""


_SIDES = ((LinkType.LANE_CHANGE_LEFT, Entry.CHANGE_LEFT), (LinkType.LANE_CHANGE_RIGHT, Entry.CHANGE_RIGHT))


class CellGraph:
    """Cells of a town and the moves between them.

    Attributes:
        cells: how many there are; the nodes are the cells, then the lanes' tails, then `start` and `goal`.
        start, goal: nodes for the ends of a search.
        moves: between cells and tails, of those with the same ends the cheapest.
        crossings: lane changes and U-turns from the starts of cells to the very place where they end, whose cell is
            the target (a move onto the road ahead leads to the next cell's start instead).
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
        # all lanes end to end, a metre apart, so that places on many of them can be looked up at once
        self._offsets = np.concatenate(([0.0], np.cumsum(lengths + 1.0)))
        self._stations = np.concatenate(
            [lane.stations + offset for lane, offset in zip(town.lanes, self._offsets[:-1], strict=True)]
        )
        self._points = np.concatenate([lane.points for lane in town.lanes])
        starts = {lane.id: self._starts(lane.id) for lane in town.lanes if not lane.in_junction}
        self.crossings = Moves.join([self._changes(starts), self._u_turns(starts)])
        tables = [self._within_lanes(), self._across_ends(), self._onward(self.crossings)]
        self.moves = Moves.join(tables).cheapest(self.nodes)

    @property
    def nodes(self) -> int:
        """How many nodes there are."""
        return self.goal + 1

    def cell(self, lane: int, station: float) -> int:
        """Number of the cell that holds a place."""
        return int(self._cells_at(lane, np.array([station]))[0])

    def cells_of(self, places: Iterable[Place]) -> set[int]:
        """Cells that hold places."""
        return {self.cell(lane, station) for lane, station in places}

    # --- moves between cells ----------------------------------------------------------------------------------------

    def _cells_at(self, lane: int | IntArray, stations: Array) -> IntArray:
        k = (stations / self._sizes[lane]).astype(np.int64)
        result: IntArray = self.first[lane] + np.clip(k, 0, self._counts[lane] - 1)
        return result

    def _starts(self, lane: int) -> Array:
        """Where the cells of a lane begin (n,) [m]."""
        starts: Array = np.arange(self._counts[lane]) * self._sizes[lane]
        return starts

    def _within_lanes(self) -> Moves:
        """From cell to cell along every lane."""
        owner = np.repeat(np.arange(len(self._counts)), self._counts)
        inner = np.ones(self.cells, dtype=np.bool_)
        inner[self.first[1:] - 1] = False
        source = np.flatnonzero(inner)
        lane = owner[source]
        land = (source + 1 - self.first[lane]) * self._sizes[lane]
        cost = self._sizes[lane] * self._weights[lane]
        return Moves.make(len(source), source=source, target=source + 1, cost=cost, lane=lane, leave=land, land=land)

    def _across_ends(self) -> Moves:
        """From the last cell of a lane, and from its tail, to the first of those that it goes on in."""
        links = [link for link in self._town.links if not link.type.is_lane_change]
        source = np.array([link.source for link in links], dtype=np.int64)
        target = np.array([link.target for link in links], dtype=np.int64)
        turn = np.array([TURN_COST[link.type] for link in links])
        last = self.first[source + 1] - 1
        common = {"target": self.first[target], "lane": target, "leave": self._lengths[source]}
        along = self._sizes[source] * self._weights[source]
        return Moves.join(
            [
                Moves.make(len(links), source=last, cost=along + turn, **common),
                # a search takes no free moves
                Moves.make(len(links), source=self.cells + source, cost=np.maximum(turn, 1e-3), **common),
            ]
        )

    def _onward(self, crossings: Moves) -> Moves:
        """The same crossings up to the start of the next cell, or to the lane's tail if there is none."""
        lane, cell = crossings.lane, crossings.target
        tail = cell + 1 == self.first[lane + 1]
        ahead = np.where(tail, self._lengths[lane], (cell + 1 - self.first[lane]) * self._sizes[lane])
        return replace(
            crossings,
            target=np.where(tail, self.cells + lane, cell + 1),
            cost=crossings.cost + (ahead - crossings.land) * self._weights[lane],
        )

    # --- lane changes and U-turns -----------------------------------------------------------------------------------

    def _changes(self, begins: Mapping[int, Array]) -> Moves:
        """Lane changes of several lengths, by lane the places from which the road for them is taken (n,) [m]."""
        pairs = [
            (lane, beside, ENTRIES.index(entry))
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
        # the longest is cut to what is left of the lane
        road = np.where(wanted == CHANGE_LENGTH, np.minimum(wanted, room), wanted)
        fits = (road >= SHORT_CHANGE) & (road <= room)
        return self._change(source[fits], target[fits], entry[fits], begin[fits], road[fits])

    def _change(self, source: IntArray, target: IntArray, entry: IntArray, begin: Array, road: Array) -> Moves:
        """Lane changes where the lanes do lie side by side; `road` is the way taken from `begin` on (n,) [m]."""
        leave, end = begin + CHANGE_LEAD, begin + road
        on, off = self._project(np.tile(target, 2), self._positions(np.tile(source, 2), np.concatenate((leave, end))))
        on, off = on.reshape(2, -1), off.reshape(2, -1)
        moves = Moves.make(
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
        return moves.take(near)

    def _positions(self, lanes: IntArray, stations: Array) -> Array:
        """Places on centre lines (n, 2) [m]."""
        at = self._offsets[lanes] + stations
        return np.column_stack([np.interp(at, self._stations, self._points[:, k]) for k in (0, 1)])

    def _project(self, lanes: IntArray, positions: Array) -> tuple[Array, Array]:
        """The closest places on lanes to positions (n, 2): how far along each (n,), and how far away (n,) [m]."""
        along, away = np.empty(len(lanes)), np.empty(len(lanes))
        order = np.argsort(lanes, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(lanes[order])) + 1):
            if len(rows):
                along[rows], away[rows] = _project(self._town.lanes[lanes[rows[0]]], positions[rows])
        return along, away

    def _u_turns(self, starts: Mapping[int, Array]) -> Moves:
        """U-turns in the middle of every cell that has an oncoming lane, by lane where the cells begin (n,) [m]."""
        rows = [
            (lane, float(begin), float(begin + 0.5 * self._sizes[lane])) for lane in starts for begin in starts[lane]
        ]
        return self._turn_round(rows)

    def _turn_round(self, rows: Iterable[tuple[int, float, float]]) -> Moves:
        """U-turns, where there is an oncoming lane that goes on for long enough behind them.

        Args:
            rows: lane, place from which the way is counted, and place where the U-turn begins [m].
        """
        found = []
        for lane, begin, leave in rows:
            oncoming = self._oncoming.at(lane, leave)
            if oncoming is not None and self._lengths[oncoming.lane] - oncoming.station > CELL:
                found.append((lane, begin, leave, oncoming.lane, oncoming.station))
        lanes, begins, leaves, others, stations = np.array(found, dtype=np.float64).reshape(-1, 5).T
        source, target = lanes.astype(np.int64), others.astype(np.int64)
        landing = self._cells_at(target, stations + U_TURN_REST)
        return Moves.make(
            len(found),
            source=self._cells_at(source, begins),
            target=landing,
            cost=(leaves - begins) * self._weights[source]
            + U_TURN_LENGTH
            + U_TURN_COST
            + U_TURN_REST * self._weights[target],
            entry=ENTRIES.index(Entry.U_TURN),
            lane=target,
            leave=leaves,
            land=stations + U_TURN_REST,
            driven=U_TURN_LENGTH + U_TURN_REST,
            onto=self._cells_at(target, stations),
            until=landing,
        )

    # --- the ends of a search ---------------------------------------------------------------------------------------

    def arrivals(self, goal: Place) -> Moves:
        """Moves that end at a place: along its cell, and by crossings that end in its cell before it."""
        lane, station = goal
        cell = self.cell(lane, station)
        begin = (cell - int(self.first[lane])) * self._sizes[lane]
        along = Moves.make(
            1, source=cell, cost=self._cost(lane, station - begin), lane=lane, leave=station, land=station
        )
        return self._up_to(goal, self.crossings, along)

    def departures(self, start: Place, goal: Place | None, obstacles: Iterable[Place]) -> Moves:
        """Moves from a place: on along its lane, and crossings that begin there.

        Args:
            start: where the car is.
            goal: where it is to go, perhaps by a single move.
            obstacles: places that cannot be passed; those ahead in the start's own cell are told apart from those
                behind.
        """
        lane, station = self._town.lanes[start[0]], start[1]
        cell = self.cell(*start)
        ahead = (at for on, at in obstacles if on == start[0] and at >= station and self.cell(on, at) == cell)
        nearest = min(ahead, default=np.inf)
        crossings = self._crossings_from(lane, station, nearest)
        tables = [self._onward(crossings)]
        if nearest == np.inf:
            tables.append(self._following(lane, station, cell))
        if goal is not None:
            direct = _NONE
            within = cell == self.cell(*goal) and goal[1] >= station - SLIGHTLY_BEHIND
            if within and nearest > goal[1]:
                cost = self._cost(lane.id, goal[1] - station)
                direct = Moves.make(1, cost=cost, lane=lane.id, leave=goal[1], land=goal[1])
            tables.append(self._up_to(goal, crossings, direct))
        moves = Moves.join(tables)
        # what stands in the own cell was looked at already, place by place
        return replace(moves, source=np.full(len(moves), self.start), first=np.full(len(moves), cell + 1))

    def stand(self, place: Place, source: int | None = None) -> Moves:
        """What a car can do that stands before a roadblock: the shortest lane change, and a U-turn on the spot.

        Args:
            place: where it stands. It has the room on its own lane that it stopped with; only that on the other counts.
            source: node that the moves begin at; by default the cell before the one that it stands in, whose end is
                closed like all of the road up to the roadblock. None if there is no such cell on the lane.
        """
        lane = place[0]
        cell = self.cell(*place)
        source = cell - 1 if source is None else source
        if source < self.first[lane]:
            return _NONE
        switches = self.departures(place, None, ())
        kind, shortest = switches.entry, switches.driven < SHORT_CHANGE
        switches = switches.take(shortest & (kind != ENTRIES.index(Entry.FOLLOW)) & (kind != _U_TURN))
        moves = Moves.join([switches, self.departures(place, None, [place])])
        count = len(moves)
        return replace(moves, source=np.full(count, source), first=np.zeros(count, int), last=np.full(count, -1))

    def _crossings_from(self, lane: Lane, station: float, nearest: float) -> Moves:
        """Lane changes and U-turns from a place on, up to an obstacle [m]."""
        if lane.in_junction:
            return _NONE
        changes = self._changes({lane.id: np.array([station])})
        changes = changes.take(changes.leave + SHARED * changes.driven < nearest)
        # the middle of the cell, too: just behind a junction there may be no oncoming lane yet
        middle = (self.cell(lane.id, station) - int(self.first[lane.id]) + 0.5) * float(self._sizes[lane.id])
        leaves = [leave for leave in sorted({station, max(station, middle)}) if leave <= nearest]
        return Moves.join([changes, self._turn_round((lane.id, station, leave) for leave in leaves)])

    def _following(self, lane: Lane, station: float, cell: int) -> Moves:
        """Moves that go on along a lane."""
        rows = self.moves.take((self.moves.source == cell) & (self.moves.entry == ENTRIES.index(Entry.FOLLOW)))
        gone = station - (cell - int(self.first[lane.id])) * self._sizes[lane.id]
        return replace(rows, cost=np.maximum(rows.cost - gone * self._weights[lane.id], 1e-3))

    def _up_to(self, goal: Place, crossings: Moves, more: Moves) -> Moves:
        """Moves to the goal: crossings that end before it in its cell, and others that are known to."""
        lane, station = goal
        there = crossings.take((crossings.target == self.cell(*goal)) & (crossings.land <= station))
        moves = Moves.join([there, more])
        cost = moves.cost + np.maximum(station - moves.land, 0.0) * self._weights[lane]
        return replace(moves, cost=cost, target=np.full(len(moves), self.goal))

    def _cost(self, lane: int, distance: float) -> float:
        """Cost of driving along a lane; never nothing, for a search takes no free moves."""
        return max(float(distance * self._weights[lane]), 1e-3)


_NONE = Moves.make(0)
_U_TURN = ENTRIES.index(Entry.U_TURN)


def _project(lane: Lane, positions: Array) -> tuple[Array, Array]:
    """Closest places on a lane to positions (n, 2): how far along it (n,), and how far away (n,) [m]."""
    a, d = lane.points[:-1, :2], np.diff(lane.points[:, :2], axis=0)
    to = positions[:, None, :] - a  # (n, segments, 2)
    t = np.clip(np.einsum("nsk,sk->ns", to, d) / np.einsum("sk,sk->s", d, d), 0.0, 1.0)
    away = np.linalg.norm(to - t[..., None] * d, axis=2)
    best = np.argmin(away, axis=1)
    row = np.arange(len(positions))
    along = lane.stations[best] + t[row, best] * np.diff(lane.stations)[best]
    return along, away[row, best]
