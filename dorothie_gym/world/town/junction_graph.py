"""The junctions of a town and the roads that lead from one to the next: SDN's meta map, which plans refer to."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.town.model import NO_STREET, Array, Lane, LinkType, Town

_SIDES = (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)

# A way that is not shorter by this is no better [m].
_SHORTER = 1e-6


@dataclass(frozen=True, kw_only=True)
class GraphStreet:
    """Roads and junctions that belong to a street; both may belong to several."""

    roads: tuple[int, ...]
    junctions: tuple[int, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class JunctionGraph:
    """Junctions and the ways from each to those that one comes to next.

    Attributes:
        ids: junction ids (n,).
        positions: their centres (n, 2) [m].
        edges: (m, 2) rows of `ids`, from and to; of several ways between the same two the shortest.
        lengths: of the ways outside junctions (m,) [m].
        roads: ids of the roads along each way, in order.
        streets: (m,) street of the first of those roads that has one, or -1.
    """

    ids: NDArray[np.int64]
    positions: Array
    edges: NDArray[np.int64]
    lengths: Array
    roads: tuple[tuple[int, ...], ...]
    streets: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.ids)

    def neighbours(self, junction_id: int) -> tuple[int, ...]:
        """Ids of the junctions that one comes to next from a junction.

        Raises:
            KeyError: there is no such junction.
        """
        row = np.flatnonzero(self.ids == junction_id)
        if not len(row):
            raise KeyError(f"there is no junction {junction_id}; the map has {', '.join(map(str, self.ids))}")
        return tuple(int(self.ids[target]) for source, target in self.edges if source == row[0])


def first_street(roads: Sequence[int], streets: Sequence[GraphStreet]) -> int:
    """The street of the first of some roads that belongs to one; -1 if none does."""
    for road in roads:
        for index, street in enumerate(streets):
            if road in street.roads:
                return index
    return NO_STREET


@dataclass(frozen=True)
class _Way:
    """Roads from a junction to the start of a lane, and how long they are [m]."""

    length: float
    roads: tuple[int, ...]

    def along(self, road: int, length: float) -> _Way:
        roads = self.roads if self.roads[-1:] == (road,) else (*self.roads, road)
        return _Way(self.length + length, roads)

    def is_better(self, other: _Way | None) -> bool:
        return other is None or self.length < other.length - _SHORTER


def junction_graph(town: Town, streets: Sequence[GraphStreet]) -> JunctionGraph:
    """The junction graph of a town.

    A way leads along lanes outside junctions, changing lanes where it must (a turn lane is only reached so).

    Args:
        town: the map.
        streets: its streets as the lane graph has them.
    """
    rows = {junction.id: row for row, junction in enumerate(town.junctions)}
    best: dict[tuple[int, int], _Way] = {}
    for junction in town.junctions:
        for target, way in _next_junctions(town, junction.id).items():
            best[rows[junction.id], rows[target]] = way
    pairs = sorted(best)
    return JunctionGraph(
        ids=np.array(list(rows), dtype=np.int64),
        positions=np.array([junction.position for junction in town.junctions], dtype=np.float64).reshape(-1, 2),
        edges=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        lengths=np.array([best[pair].length for pair in pairs], dtype=np.float64),
        roads=tuple(best[pair].roads for pair in pairs),
        streets=np.array([first_street(best[pair].roads, streets) for pair in pairs], dtype=np.int64),
    )


def _next_junctions(town: Town, start: int) -> dict[int, _Way]:
    """Shortest ways from a junction to those that one comes to next."""
    found: dict[int, _Way] = {}
    labels: dict[int, _Way] = {}  # by lane: the way to its start
    queue: deque[int] = deque()

    def reach(target: Lane, way: _Way) -> None:
        if target.in_junction:
            if way.is_better(found.get(target.junction_id)):
                found[target.junction_id] = way
        elif way.is_better(labels.get(target.id)):
            labels[target.id] = way
            queue.append(target.id)

    for target in _leaving(town, start):
        reach(target, _Way(0.0, ()))
    while queue:
        lane = town.lanes[queue.popleft()]
        for target, length in _ways_on(town, lane):
            reach(target, labels[lane.id].along(lane.road_id, length))
    return found


def _leaving(town: Town, junction: int) -> Iterator[Lane]:
    """Lanes that one comes onto when one leaves a junction."""
    for lane in town.lanes:
        if lane.junction_id == junction:
            for link in town.successors(lane.id):
                if town.lanes[link.target].junction_id != junction:
                    yield town.lanes[link.target]


def _ways_on(town: Town, lane: Lane) -> Iterator[tuple[Lane, float]]:
    """Lanes that follow a lane or lie beside it, and how much further on than the lane's start they begin [m]."""
    for link in town.successors(lane.id):
        yield town.lanes[link.target], lane.length
    for side in _SIDES:
        beside = town.neighbour(lane.id, side)
        if beside is not None:
            yield town.lanes[beside], _ahead(lane, town.lanes[beside])


def _ahead(lane: Lane, beside: Lane) -> float:
    """How much further on a lane begins than the one beside it [m]; negative if it begins before it."""
    return lane.project(beside.points[0])[0] - beside.project(lane.points[0])[0]
