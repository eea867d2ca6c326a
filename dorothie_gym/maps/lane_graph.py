"""A town as a graph of lanes with typed edges: what TOTO reads, and the layout of the towns that come with SDN."""

from __future__ import annotations

import enum
import math
from collections import defaultdict, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import NO_JUNCTION, NO_STREET, Array, Lane, LinkType, Town

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


# --- A town as a graph of lanes with typed edges: what TOTO reads, and the layout of the towns that come  ------------

FEATURES = (
    *("start_x", "start_y", "start_z", "start_pitch", "start_yaw", "start_roll"),
    *("end_x", "end_y", "end_z", "end_pitch", "end_yaw", "end_roll"),
    *("length", "lane_id"),
)
"""Columns of `LaneGraph.features`: metres and degrees; the 14 numbers of a lane that TOTO does not look up."""

START, END, LENGTH, LANE_ID = slice(0, 6), slice(6, 12), 12, 13


class EdgeType(enum.StrEnum):
    """How two lanes are joined, as SDN's town files spell it."""

    CONCAT = "concat"
    LEFT_LANE_CHANGE = "left_lane_change"
    RIGHT_LANE_CHANGE = "right_lane_change"
    UTURN = "uturn"


EDGE_TYPES = tuple(EdgeType)


class Repair(enum.IntFlag):
    """What of a lane was not as its file says."""

    NONE = 0
    END_FROM_START = 1
    """The end is what the file has as the start (the known fault of SDN's files)."""
    START_FROM_PREDECESSOR = 2
    """The start is the end of the lanes before."""
    START_UNKNOWN = 4
    """No lane leads to this one, or those that do end apart: its start is what the file says, and may be wrong."""
    LENGTH_FROM_META_MAP = 8
    """The length is that of the road in the junction graph."""
    LENGTH_ESTIMATED = 16
    """The length is that of a smooth curve between both ends."""
    UNRELIABLE = 32
    """The ends of the file's lanes fit neither as they are written nor with the known fault: nothing was changed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneGraph:
    """Lanes of a town and how they are joined.

    Attributes:
        name: of the town.
        features: (n, 14) numbers of each lane, columns as `FEATURES`; yaw clockwise from east.
        road_ids: (n,).
        junction_ids: (n,), -1 outside junctions.
        have_left, have_right: (n,) whether a lane can be changed to that side.
        edges: (m, 2) rows of `features`, from and to, ordered by the first, the edge's type and the second; no pair
            twice.
        edge_types: (m,) indices in `EDGE_TYPES`.
        streets: of the town; index i is street i.
        meta_map: the junctions and the roads between them.
        repairs: (n,) `Repair` flags; all 0 but in a file that had faults.
        notes: faults of the file that concern no single lane, in words.
    """

    name: str
    features: Array
    road_ids: NDArray[np.int64]
    junction_ids: NDArray[np.int64]
    have_left: NDArray[np.bool_]
    have_right: NDArray[np.bool_]
    edges: NDArray[np.int64]
    edge_types: NDArray[np.int64]
    streets: tuple[GraphStreet, ...]
    meta_map: JunctionGraph
    repairs: NDArray[np.int64]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.features)

    @property
    def num_streets(self) -> int:
        """How many streets there are."""
        return len(self.streets)

    @cached_property
    def street(self) -> NDArray[np.int64]:
        """The street of each lane (n,): the first that its road belongs to, or -1."""
        first: dict[int, int] = {}
        for index, street in enumerate(self.streets):
            for road in street.roads:
                first.setdefault(road, index)
        return np.array([first.get(int(road), NO_STREET) for road in self.road_ids], dtype=np.int64)

    def members(self, street: int) -> NDArray[np.int64]:
        """Rows of the lanes that TOTO takes the mean of for a street: those of its roads and of its junctions."""
        found = self.streets[street]
        inside = np.isin(self.junction_ids, found.junctions) & (self.junction_ids != NO_JUNCTION)
        return np.flatnonzero(np.isin(self.road_ids, found.roads) | inside)

    def edges_of(self, kind: EdgeType) -> NDArray[np.int64]:
        """Edges of one type (k, 2)."""
        found: NDArray[np.int64] = self.edges[self.edge_types == EDGE_TYPES.index(kind)]
        return found

    def to_json(self) -> str:
        """The graph in the layout of SDN's town files; `parse_sdn_graph` reads it back exactly."""
        # the layout is written in terms of this class
        from dorothie_gym.maps.sdn_graph import graph_to_json

        return graph_to_json(self)


def lane_graph(town: Town) -> LaneGraph:
    """The lane graph of a town, the same for our own and for imported ones.

    U-turns are joined as in SDN's files: each lane to the innermost one of its road that runs the other way (where a
    road has several of those along its course, to one that lies beside).
    """
    edges, kinds = _edges(town)
    streets = _streets(town)
    changes = [(link.source, link.type) for link in town.links if link.type.is_lane_change]
    left, right = (
        np.isin(np.arange(len(town.lanes)), [source for source, kind in changes if kind is side])
        for side in (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)
    )
    return LaneGraph(
        name=town.name,
        features=np.array([_features(lane) for lane in town.lanes]).reshape(-1, len(FEATURES)),
        road_ids=np.array([lane.road_id for lane in town.lanes], dtype=np.int64),
        junction_ids=np.array([lane.junction_id for lane in town.lanes], dtype=np.int64),
        have_left=left,
        have_right=right,
        edges=edges,
        edge_types=kinds,
        streets=streets,
        meta_map=junction_graph(town, streets),
        repairs=np.zeros(len(town.lanes), dtype=np.int64),
    )


def _features(lane: Lane) -> tuple[float, ...]:
    """The row of a lane; roads have no roll here."""
    rows = []
    for point, along, heading in ((0, slice(0, 2), lane.headings[0]), (-1, slice(-2, None), lane.headings[-1])):
        dx, dy, dz = np.diff(lane.points[along], axis=0)[0]
        pitch = math.degrees(math.atan2(dz, math.hypot(dx, dy)))
        yaw = (math.degrees(heading) + 180.0) % 360.0 - 180.0
        rows += [*(float(value) for value in lane.points[point]), pitch, yaw, 0.0]
    return (*rows, lane.length, float(lane.lane_id))


def _edges(town: Town) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Edges (m, 2) and their types (m,); of several between the same two lanes the first type counts."""
    sides = {
        LinkType.LANE_CHANGE_LEFT: EdgeType.LEFT_LANE_CHANGE,
        LinkType.LANE_CHANGE_RIGHT: EdgeType.RIGHT_LANE_CHANGE,
    }
    kind_of: dict[tuple[int, int], int] = {}
    linked = ((link.source, link.target, sides.get(link.type, EdgeType.CONCAT)) for link in town.links)
    for source, target, kind in (*linked, *((a, b, EdgeType.UTURN) for a, b in _u_turns(town))):
        index = EDGE_TYPES.index(kind)
        kind_of[source, target] = min(kind_of.get((source, target), index), index)
    rows = sorted((source, kind, target) for (source, target), kind in kind_of.items())
    table = np.array(rows, dtype=np.int64).reshape(-1, 3)
    return table[:, [0, 2]], table[:, 1]


def _u_turns(town: Town) -> Iterator[tuple[int, int]]:
    by_road: defaultdict[int, list[Lane]] = defaultdict(list)
    for lane in town.lanes:
        by_road[lane.road_id].append(lane)
    for lane in town.lanes:
        others = [other for other in by_road[lane.road_id] if other.lane_id * lane.lane_id < 0]
        if others:
            yield lane.id, min(others, key=lambda other: (*_aside(lane, other), other.id)).id


def _aside(lane: Lane, other: Lane) -> tuple[bool, int, float]:
    """Ranks lanes of the other direction: those beside the lane's middle, the innermost, the nearest first."""
    middle = lane.position(lane.length / 2)
    station, offset = other.project(middle)
    beyond = not 0.0 < station < other.length
    return (beyond, abs(other.lane_id), 0.0) if not beyond else (beyond, 0, abs(offset))


def _streets(town: Town) -> tuple[GraphStreet, ...]:
    """Roads of each street, and the junctions that it crosses or ends at.

    A connecting road belongs to a street if all its lanes do.
    """
    on_road: defaultdict[int, dict[int, None]] = defaultdict(dict)
    at_junction: defaultdict[int, dict[int, None]] = defaultdict(dict)
    for lane in town.lanes:
        on_road[lane.road_id][lane.street] = None
    for link in town.links:
        source, target = town.lanes[link.source], town.lanes[link.target]
        for plain, crossing in ((source, target), (target, source)):
            if crossing.in_junction and not plain.in_junction:
                at_junction[plain.street][crossing.junction_id] = None
    roads: defaultdict[int, list[int]] = defaultdict(list)
    for road in sorted(on_road):
        if len(on_road[road]) == 1:
            roads[next(iter(on_road[road]))].append(road)
    return tuple(
        GraphStreet(roads=tuple(roads[street.id]), junctions=tuple(sorted(at_junction[street.id])))
        for street in town.streets
    )
