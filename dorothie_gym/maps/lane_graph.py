"""Lane graph of a town: lanes as nodes, typed edges between them, and the graph of junctions (map input of TOTO).

Conventions are those of the town files of SDN: a U-turn is an edge from a lane to the innermost lane of the same road
in the opposite direction, and a street consists of roads and junctions.
"""

from __future__ import annotations

import enum
import math
from collections import defaultdict, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import NO_JUNCTION, NO_STREET, Array, Junction, Lane, LaneLink, LinkType, Street
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_degrees

FEATURES = (
    *("start_x", "start_y", "start_z", "start_pitch", "start_yaw", "start_roll"),
    *("end_x", "end_y", "end_z", "end_pitch", "end_yaw", "end_roll"),
    *("length", "lane_id"),
)
"""Columns of `LaneGraph.features` in metres and degrees: the 14 numeric features of a lane in TOTO."""

START, END, LENGTH, LANE_ID = slice(0, 6), slice(6, 12), 12, 13

_SIDES = (LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT)

_SHORTER = 1e-6
"""Smallest difference by which one path counts as shorter than another [m]."""


class EdgeType(enum.StrEnum):
    """Type of an edge between two lanes, spelt as in the town files of SDN."""

    CONCAT = "concat"
    LEFT_LANE_CHANGE = "left_lane_change"
    RIGHT_LANE_CHANGE = "right_lane_change"
    UTURN = "uturn"


EDGE_TYPES = tuple(EdgeType)


@dataclass(frozen=True, kw_only=True)
class GraphStreet:
    """Road ids and junction ids of a street; a road or junction may belong to several streets."""

    roads: tuple[int, ...]
    junctions: tuple[int, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class JunctionGraph:
    """Junctions and the shortest path from each junction to every adjacent one.

    Attributes:
        ids: junction ids (n,).
        positions: centres of the junctions (n, 2) [m].
        edges: (m, 2) indices into `ids`, source and target; each pair once.
        lengths: length of each path outside the junctions (m,) [m].
        roads: road ids along each path, in order.
        streets: street of the first road with a street on each path (m,), or -1.
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
        """Returns the ids of the junctions that are adjacent to a junction.

        Raises:
            KeyError: the map has no such junction.
        """
        row = np.flatnonzero(self.ids == junction_id)
        if not len(row):
            raise KeyError(f"there is no junction {junction_id}; the map has {', '.join(map(str, self.ids))}")
        return tuple(int(self.ids[target]) for source, target in self.edges if source == row[0])


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneGraph:
    """Lanes of a town as nodes of a graph; see `Town.to_graph`.

    Attributes:
        name: name of the town.
        features: (n, 14) numeric features of each lane, columns as in `FEATURES`; yaw clockwise from east.
        road_ids: (n,).
        junction_ids: (n,), -1 outside junctions.
        have_left, have_right: (n,) whether a lane change to that side is possible.
        edges: (m, 2) indices of lanes, source and target, sorted by source, edge type and target; each pair once.
        edge_types: (m,) indices into `EDGE_TYPES`.
        streets: streets of the town; index i is street i.
        meta_map: junctions and the paths between them.
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

    def __len__(self) -> int:
        return len(self.features)

    @property
    def num_streets(self) -> int:
        """Number of streets."""
        return len(self.streets)

    @cached_property
    def street(self) -> NDArray[np.int64]:
        """Street of each lane (n,): the first street that contains its road, or -1."""
        first: dict[int, int] = {}
        for index, street in enumerate(self.streets):
            for road in street.roads:
                first.setdefault(road, index)
        return np.array([first.get(int(road), NO_STREET) for road in self.road_ids], dtype=np.int64)

    def members(self, street: int) -> NDArray[np.int64]:
        """Returns the lanes of a street as TOTO averages them: those on its roads and in its junctions."""
        found = self.streets[street]
        inside = np.isin(self.junction_ids, found.junctions) & (self.junction_ids != NO_JUNCTION)
        return np.flatnonzero(np.isin(self.road_ids, found.roads) | inside)

    def edges_of(self, kind: EdgeType) -> NDArray[np.int64]:
        """Returns the edges of one type (k, 2)."""
        found: NDArray[np.int64] = self.edges[self.edge_types == EDGE_TYPES.index(kind)]
        return found


def build_lane_graph(
    *,
    name: str,
    lanes: Sequence[Lane],
    links: Sequence[LaneLink],
    junctions: Sequence[Junction],
    streets: Sequence[Street],
) -> LaneGraph:
    """Builds the lane graph from the parts of a town; arguments as in `Town`.

    Where a road has several innermost opposite lanes along its course, the U-turn leads to one that lies beside the
    lane.
    """
    edges, kinds = _edges(lanes, links)
    graph_streets = _streets(lanes, links, streets)
    changes = [(link.source, link.type) for link in links if link.type.is_lane_change]
    left, right = (
        np.isin(np.arange(len(lanes)), [source for source, kind in changes if kind is side]) for side in _SIDES
    )
    return LaneGraph(
        name=name,
        features=np.array([_features(lane) for lane in lanes]).reshape(-1, len(FEATURES)),
        road_ids=np.array([lane.road_id for lane in lanes], dtype=np.int64),
        junction_ids=np.array([lane.junction_id for lane in lanes], dtype=np.int64),
        have_left=left,
        have_right=right,
        edges=edges,
        edge_types=kinds,
        streets=graph_streets,
        meta_map=_junction_graph(_Connections(lanes, links), junctions, graph_streets),
    )


def _features(lane: Lane) -> tuple[float, ...]:
    """Returns the feature row of a lane; roads have no roll."""
    rows = []
    for point, along, heading in ((0, slice(0, 2), lane.headings[0]), (-1, slice(-2, None), lane.headings[-1])):
        dx, dy, dz = np.diff(lane.points[along], axis=0)[0]
        pitch = math.degrees(pm.atan2(dz, pm.hypot(dx, dy)))
        rows += [*(float(value) for value in lane.points[point]), pitch, wrap_degrees(math.degrees(heading)), 0.0]
    return (*rows, lane.length, float(lane.lane_id))


def _edges(lanes: Sequence[Lane], links: Sequence[LaneLink]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns the edges (m, 2) and their types (m,); of several edges between two lanes, only the first is kept."""
    sides = {
        LinkType.LANE_CHANGE_LEFT: EdgeType.LEFT_LANE_CHANGE,
        LinkType.LANE_CHANGE_RIGHT: EdgeType.RIGHT_LANE_CHANGE,
    }
    kind_of: dict[tuple[int, int], int] = {}
    linked = ((link.source, link.target, sides.get(link.type, EdgeType.CONCAT)) for link in links)
    for source, target, kind in (*linked, *((a, b, EdgeType.UTURN) for a, b in _u_turns(lanes))):
        index = EDGE_TYPES.index(kind)
        kind_of[source, target] = min(kind_of.get((source, target), index), index)
    rows = sorted((source, kind, target) for (source, target), kind in kind_of.items())
    table = np.array(rows, dtype=np.int64).reshape(-1, 3)
    return table[:, [0, 2]], table[:, 1]


def _u_turns(lanes: Sequence[Lane]) -> Iterator[tuple[int, int]]:
    by_road: defaultdict[int, list[Lane]] = defaultdict(list)
    for lane in lanes:
        by_road[lane.road_id].append(lane)
    for lane in lanes:
        others = [other for other in by_road[lane.road_id] if other.lane_id * lane.lane_id < 0]
        if others:
            yield lane.id, min(others, key=lambda other: (*_aside(lane, other), other.id)).id


def _aside(lane: Lane, other: Lane) -> tuple[bool, int, float]:
    """Returns the rank of an opposite lane: first those beside the centre of the lane, innermost first; then by gap."""
    middle = lane.position(lane.length / 2)
    station, offset = other.project(middle)
    beyond = not 0.0 < station < other.length
    return (beyond, abs(other.lane_id), 0.0) if not beyond else (beyond, 0, abs(offset))


def _streets(lanes: Sequence[Lane], links: Sequence[LaneLink], streets: Sequence[Street]) -> tuple[GraphStreet, ...]:
    """Returns the roads of each street and the junctions that it crosses or ends at.

    A connecting road belongs to a street if all its lanes do.
    """
    on_road: defaultdict[int, dict[int, None]] = defaultdict(dict)
    at_junction: defaultdict[int, dict[int, None]] = defaultdict(dict)
    for lane in lanes:
        on_road[lane.road_id][lane.street] = None
    for link in links:
        source, target = lanes[link.source], lanes[link.target]
        for plain, crossing in ((source, target), (target, source)):
            if crossing.in_junction and not plain.in_junction:
                at_junction[plain.street][crossing.junction_id] = None
    roads: defaultdict[int, list[int]] = defaultdict(list)
    for road in sorted(on_road):
        if len(on_road[road]) == 1:
            roads[next(iter(on_road[road]))].append(road)
    return tuple(
        GraphStreet(roads=tuple(roads[street.id]), junctions=tuple(sorted(at_junction[street.id])))
        for street in streets
    )


# --- Junction graph --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _JunctionPath:
    """Path from a junction to the start of a lane: its length [m] and the roads along it."""

    length: float
    roads: tuple[int, ...]

    def along(self, road: int, length: float) -> _JunctionPath:
        roads = self.roads if self.roads[-1:] == (road,) else (*self.roads, road)
        return _JunctionPath(self.length + length, roads)

    def is_better(self, other: _JunctionPath | None) -> bool:
        return other is None or self.length < other.length - _SHORTER


class _Connections:
    """Successors and parallel lanes of each lane."""

    def __init__(self, lanes: Sequence[Lane], links: Sequence[LaneLink]) -> None:
        self.lanes = lanes
        self._successors: list[list[Lane]] = [[] for _ in lanes]
        self._beside: dict[tuple[int, LinkType], Lane] = {}
        for link in links:
            if link.type.is_lane_change:
                self._beside.setdefault((link.source, link.type), lanes[link.target])
            else:
                self._successors[link.source].append(lanes[link.target])

    def leaving(self, junction: int) -> Iterator[Lane]:
        """Yields the lanes that follow the connectors of a junction outside it."""
        for lane in self.lanes:
            if lane.junction_id == junction:
                yield from (target for target in self._successors[lane.id] if target.junction_id != junction)

    def onward(self, lane: Lane) -> Iterator[tuple[Lane, float]]:
        """Yields following and parallel lanes, and how far their starts lie beyond the start of the lane [m]."""
        for target in self._successors[lane.id]:
            yield target, lane.length
        for side in _SIDES:
            beside = self._beside.get((lane.id, side))
            if beside is not None:
                yield beside, lane.project(beside.points[0])[0] - beside.project(lane.points[0])[0]


def _junction_graph(
    connections: _Connections, junctions: Sequence[Junction], streets: Sequence[GraphStreet]
) -> JunctionGraph:
    """Returns the junction graph.

    A path follows lanes outside junctions and changes lanes where necessary: some turn lanes cannot be reached
    otherwise.
    """
    rows = {junction.id: row for row, junction in enumerate(junctions)}
    best: dict[tuple[int, int], _JunctionPath] = {}
    for junction in junctions:
        for target, path in _adjacent_junctions(connections, junction.id).items():
            best[rows[junction.id], rows[target]] = path
    pairs = sorted(best)
    return JunctionGraph(
        ids=np.array(list(rows), dtype=np.int64),
        positions=np.array([junction.position for junction in junctions], dtype=np.float64).reshape(-1, 2),
        edges=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        lengths=np.array([best[pair].length for pair in pairs], dtype=np.float64),
        roads=tuple(best[pair].roads for pair in pairs),
        streets=np.array([_first_street(best[pair].roads, streets) for pair in pairs], dtype=np.int64),
    )


def _adjacent_junctions(connections: _Connections, start: int) -> dict[int, _JunctionPath]:
    """Returns the shortest path from a junction to each adjacent junction, by junction id."""
    found: dict[int, _JunctionPath] = {}
    labels: dict[int, _JunctionPath] = {}  # by lane: the path to its start
    queue: deque[int] = deque()

    def reach(target: Lane, path: _JunctionPath) -> None:
        if target.in_junction:
            if path.is_better(found.get(target.junction_id)):
                found[target.junction_id] = path
        elif path.is_better(labels.get(target.id)):
            labels[target.id] = path
            queue.append(target.id)

    for target in connections.leaving(start):
        reach(target, _JunctionPath(0.0, ()))
    while queue:
        lane = connections.lanes[queue.popleft()]
        for target, length in connections.onward(lane):
            reach(target, labels[lane.id].along(lane.road_id, length))
    return found


def _first_street(roads: Sequence[int], streets: Sequence[GraphStreet]) -> int:
    """Returns the street of the first road that belongs to a street, or -1."""
    for road in roads:
        for index, street in enumerate(streets):
            if road in street.roads:
                return index
    return NO_STREET
