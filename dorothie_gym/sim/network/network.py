"""A town as a highway-env road network, and tables of the continuations of each lane."""

from __future__ import annotations

import itertools
from collections import defaultdict, deque
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
from highway_env.road.lane import LineType
from highway_env.road.road import RoadNetwork
from numpy.typing import NDArray

from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.maps.model import HEIGHT, LANE_CHANGES, Array, Exit, Lane, LaneTable, LinkType
from dorothie_gym.maps.town import Town, check_extent
from dorothie_gym.sim.network.lane import PolylineLane
from dorothie_gym.sim.network.lane_lookup import GridIndex
from dorothie_gym.sim.state.codes import NOBODY
from dorothie_gym.sim.state.town_records import ExitRecord, LaneExitsRecord, LaneRecord
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import RecordArray, empty_records
from dorothie_gym.support.copying import shared
from dorothie_gym.support.portable_math import wrap_degrees

LEVEL_ENDS = 3.0
"""Lanes side by side end together when their ends are no farther apart than this along the road [m]."""
SIDE_BY_SIDE_WIDTHS = 1.5
"""... and when the distance across is no more than this times their mean width."""


def road_edges(town: Town) -> dict[tuple[str, str], list[Lane]]:
    """Edges of the road graph in the order of their first lanes' ids, each with its lanes from left to right.

    Lanes that are linked share a node. Lanes of one road and direction that begin side by side and end side by side are
    one edge. Anything else that joins the same two nodes (such as connectors that fan out) is also the same edge.
    """
    nodes = _Nodes(2 * len(town.lanes))
    for link in town.links:
        if not link.type.is_lane_change:
            nodes.join(_end(town.lanes[link.source]), _start(town.lanes[link.target]))
    roads: dict[tuple[int, bool], list[Lane]] = defaultdict(list)
    for lane in town.lanes:
        roads[lane.road_id, lane.lane_id > 0].append(lane)
    for left, right in itertools.chain.from_iterable(itertools.combinations(road, 2) for road in roads.values()):
        if _level(left, right, 0) and _level(left, right, -1):
            nodes.join(_start(left), _start(right))
            nodes.join(_end(left), _end(right))
    edges: dict[tuple[str, str], list[Lane]] = defaultdict(list)
    names = nodes.names()
    for lane in town.lanes:
        edges[names[_start(lane)], names[_end(lane)]].append(lane)
    return {edge: _left_to_right(lanes) for edge, lanes in edges.items()}


def _start(lane: Lane) -> int:
    return 2 * lane.id


def _end(lane: Lane) -> int:
    return 2 * lane.id + 1


def _offset(lane: Lane, other: Lane, end: int) -> tuple[float, float]:
    """Returns the offset of another lane's end (0 or -1) ahead and to the right of a lane's end [m]."""
    dx, dy = (float(d) for d in other.points[end, :2] - lane.points[end, :2])
    c, n = pm.cos(lane.headings[end]), pm.sin(lane.headings[end])
    return dx * c + dy * n, dy * c - dx * n


def _level(lane: Lane, other: Lane, end: int) -> bool:
    along, across = _offset(lane, other, end)
    width = 0.5 * float(lane.widths[end] + other.widths[end])
    limit = min(LEVEL_ENDS, 0.4 * lane.length, 0.4 * other.length)  # so that no short lane begins where it ends
    return abs(along) <= limit and abs(across) <= SIDE_BY_SIDE_WIDTHS * width


def _left_to_right(lanes: Iterable[Lane]) -> list[Lane]:
    first, *others = lanes
    across = {first.id: 0.0}
    for lane in others:
        across[lane.id] = _offset(first, lane, 0)[1] + _offset(first, lane, -1)[1]
    return sorted((first, *others), key=lambda lane: (across[lane.id], lane.id))


class _Nodes:
    """Sets of lane ends that are one place (union-find)."""

    def __init__(self, count: int) -> None:
        self._parent = list(range(count))

    def find(self, end: int) -> int:
        while self._parent[end] != end:
            self._parent[end] = self._parent[self._parent[end]]
            end = self._parent[end]
        return end

    def join(self, one: int, other: int) -> None:
        low, high = sorted((self.find(one), self.find(other)))
        self._parent[high] = low

    def names(self) -> list[str]:
        """Returns the name of the node of each end: numbers in the order of first appearance."""
        numbers: dict[int, str] = {}
        return [numbers.setdefault(self.find(end), str(len(numbers))) for end in range(len(self._parent))]


# --- Network ----------------------------------------------------------------------------------------------------------

LaneIndex: TypeAlias = tuple[str, str, int]
Route: TypeAlias = list[tuple[str, str, int | None]]

LARGEST_COORDINATE = 1e9
"""Coordinate beyond which, as for NaN, highway-env's scan replaces the index, whose bounds rounding invalidates [m]."""


@shared
class TownNetwork(RoadNetwork):
    """The lanes of a town as highway-env's graph of roads, with an index for the closest one.

    `graph[from][to]` lists the lanes of an edge from left to right. A network does not change after it is built, so
    copies return the network itself (highway-env copies whole environments to predict and to plan).

    Attributes:
        town: the town.
        table: the centre lines of all lanes in the order in which the graph lists them.
    """

    def __init__(self, town: Town) -> None:
        """Builds the graph and the index of a town; raises `ValueError` if it has no lanes or is too large."""
        super().__init__()
        if not town.lanes:
            raise ValueError(f"town {town.name!r} has no lanes: there is nothing to drive on")
        check_extent(town, town.name)
        self.town = town
        for (start, end), lanes in road_edges(town).items():
            for lane in lanes:
                super().add_lane(start, end, PolylineLane(lane, line_types=_line_types(town, lane)))
        self._indexes: list[LaneIndex] = list(self.lanes_dict())
        ordered: list[PolylineLane] = self.lanes_list()
        self.table = LaneTable.of([lane.town_lane for lane in ordered])
        self._row_of = [0] * len(ordered)
        for row, lane in enumerate(ordered):
            lane.share(self.table, row)
            self._row_of[lane.town_lane.id] = row
        self._lanes = ordered
        self._grid = GridIndex(self.table)
        self._side_lanes = [self._find_side_lanes(lane.town_lane.id) for lane in ordered]
        heights = self.table.points[:, HEIGHT]
        self.height_range = float(heights.min()), float(heights.max())

    def add_lane(self, _from: str, _to: str, lane: object) -> None:
        """Raises `TypeError`: lanes are part of the town, which is complete before its network is built."""
        raise TypeError("a TownNetwork is built from a complete Town: add the lane to the town instead")

    # Lanes of the town and lanes of the graph

    def index_of(self, lane_id: int) -> LaneIndex:
        """Returns the index of a lane of the town in the graph."""
        return self._indexes[self._row_of[lane_id]]

    def lane_of(self, lane_id: int) -> PolylineLane:
        """Returns the network's lane for a lane of the town."""
        return self._lanes[self._row_of[lane_id]]

    def lane_id(self, index: tuple[str, str, int | None]) -> int:
        """Returns the id in the town of the lane at an index; an id of None stands for the only lane of an edge."""
        return int(self.get_lane(index).town_lane.id)

    def row(self, index: tuple[str, str, int | None]) -> int:
        """Returns the row in the table of the lane at an index."""
        return int(self.get_lane(index).row)

    # Closest lane

    def get_closest_lane_index(
        self, position: Array, heading: float | None = None, height: float | None = None
    ) -> LaneIndex:
        """Returns the lane that highway-env's scan over all lanes would choose, found by the grid index.

        Args:
            position: world position (2,) [m].
            heading: heading [rad]; if given, a difference of heading of 1 rad counts like 1 m.
            height: height [m]; if given, only lanes whose height at their closest place is within `grid.SAME_LEVEL`
                are considered, or all lanes if there is no such lane in the town.

        Returns:
            The index with the minimum `distance_with_heading`; of equals, the first one in the graph's order.
        """
        x, y = float(position[0]), float(position[1])
        if (
            abs(x) < LARGEST_COORDINATE
            and abs(y) < LARGEST_COORDINATE
            and (heading is None or abs(heading) < LARGEST_COORDINATE)
        ):
            return self._indexes[self._grid.closest(x, y, heading, height)]
        found: LaneIndex = super().get_closest_lane_index(position, heading)
        return found

    def random_lane_index(self, np_random: np.random.Generator) -> LaneIndex:
        """Returns an index drawn uniformly from all lanes."""
        return self._indexes[int(np_random.choice(len(self._indexes)))]

    # Successors

    def successors(self, index: tuple[str, str, int | None]) -> list[LaneIndex]:
        """Lanes that follow a lane by the town's links."""
        return [self.index_of(link.target) for link in self.town.successors(self.lane_id(index))]

    def predecessors(self, index: tuple[str, str, int | None]) -> list[LaneIndex]:
        """Lanes that precede a lane by the town's links."""
        return [self.index_of(lane) for lane in self.town.predecessors(self.lane_id(index))]

    def side_lanes(self, lane_index: LaneIndex) -> list[LaneIndex]:
        """Lanes to the left and to the right that a vehicle may change to: those that the town's links allow."""
        return list(self._side_lanes[self.row(lane_index)])

    def next_lane(
        self,
        current_index: LaneIndex,
        route: Route | None = None,
        position: Array | None = None,
        np_random: np.random.Generator = np.random,  # type: ignore[assignment]  # highway-env's default
    ) -> LaneIndex:
        """Returns the lane that follows the current one.

        Args:
            current_index: lane that ends.
            route: edges or lanes to come (a lane id of None leaves the lane open); its head is dropped when it is the
                current edge. Ignored if it is not a continuation of the current lane by a link.
            position: not needed here; part of highway-env's interface.
            np_random: source of the choice between several continuations.

        Returns:
            An index; the current one at the end of a lane without a continuation.
        """
        if route and route[0][:2] == current_index[:2]:
            route.pop(0)
        onward = self.successors(current_index)
        if not onward:
            return current_index
        planned = self.along_route(onward, route)
        if planned:
            return planned[0]
        return onward[int(np_random.choice(len(onward))) if len(onward) > 1 else 0]

    def along_route(
        self, candidates: Sequence[LaneIndex], route: Sequence[tuple[str, str, int | None]] | None
    ) -> list[LaneIndex]:
        """Returns the candidates that are on the next edge of a route, the best first.

        Best is the lane that the route names, then one that leads on to the edge after the next.
        """
        if not route:
            return []
        planned = [index for index in candidates if index[:2] == route[0][:2]]
        if len(planned) > 1:
            wanted = route[0][2]
            after = route[1][:2] if len(route) > 1 else None
            planned.sort(key=lambda i: (i[2] != wanted, all(on[:2] != after for on in self.successors(i)), i[2]))
        return planned

    def next_lane_given_next_road(
        self, _from: str, _to: str, _id: int, next_to: str, next_id: int | None, position: Array
    ) -> tuple[int, float]:
        """Returns the lane on the next edge (a linked one, else highway-env's choice) and its distance [m].

        Args:
            _from: start of the current edge.
            _to: end of the current edge, start of the next.
            _id: current lane.
            next_to: end of the next edge.
            next_id: preferred lane, or None.
            position: world position (2,) [m].
        """
        linked = [index for index in self.successors((_from, _to, _id)) if index[:2] == (_to, next_to)]
        if not linked:
            found: tuple[int, float] = super().next_lane_given_next_road(_from, _to, _id, next_to, next_id, position)
            return found
        distances = {index[2]: float(self.get_lane(index).distance(position)) for index in linked}
        if next_id not in distances:
            next_id = min(distances, key=lambda lane: distances[lane])
        return int(next_id), distances[int(next_id)]

    def shortest_path(self, start: str, goal: str) -> list[str]:
        """Nodes of the path with the fewest edges, start and goal included; empty if there is none.

        The same path as highway-env's, whose search over all paths takes exponential time in a town.
        """
        if start == goal:
            return []
        came_from = {start: ""}
        queue = deque([start])
        while queue:
            node = queue.popleft()
            for neighbour in sorted(self.graph.get(node, {})):
                if neighbour not in came_from:
                    came_from[neighbour] = node
                    queue.append(neighbour)
                    if neighbour == goal:
                        queue.clear()
                        break
        if goal not in came_from:
            return []
        path = [goal]
        while path[-1] != start:
            path.append(came_from[path[-1]])
        return path[::-1]

    @classmethod
    def from_config(cls, config: Mapping[str, object]) -> RoadNetwork:
        """Builds the plain highway-env network that `to_config` described; a config has no links of a town."""
        return RoadNetwork.from_config(config)

    def _find_side_lanes(self, lane_id: int) -> list[LaneIndex]:
        neighbours = (self.town.neighbour(lane_id, side) for side in LANE_CHANGES)
        return [self.index_of(lane) for lane in neighbours if lane is not None]


def _line_types(town: Town, lane: Lane) -> list[int]:
    """Marks left and right: stripes between lanes (drawn once), solid lines outside, none in junctions."""
    if lane.in_junction:
        return [LineType.NONE, LineType.NONE]
    left = town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT)
    right = town.neighbour(lane.id, LinkType.LANE_CHANGE_RIGHT)
    return [
        LineType.CONTINUOUS if left is None else LineType.STRIPED,
        LineType.CONTINUOUS if right is None else LineType.NONE,
    ]


@lru_cache(maxsize=16)
def network_of(town: Town) -> TownNetwork:
    """Returns the network of a town; built once for each town."""
    return TownNetwork(town)


# --- Ways on from each lane -------------------------------------------------------------------------------------------
# Tables of the continuations of each lane, built once for each town: exits, default successors, lanes beside, oncoming.

ANOTHER_WAY = 15.0
"""Difference in angle at which exits count as different turns [degrees]."""


class LaneExits(NamedTuple):
    """The tables.

    Attributes:
        ways: continuations of each lane, by the lanes' ids.
        exits: exits, those of a lane in the order of `Town.exits`.
        lists: int32 lanes beside each lane, and lanes that may be oncoming.
    """

    ways: RecordArray[LaneExitsRecord]
    exits: RecordArray[ExitRecord]
    lists: NDArray[np.int32]


def build_exits(town: Town, lanes: RecordArray[LaneRecord]) -> LaneExits:
    """Builds the tables of a town; `lanes` are its lanes with their junctions."""
    ways = empty_records(LaneExitsRecord, len(town.lanes))
    exits: list[tuple[int, int, int, int]] = []
    lists: list[int] = []
    oncoming = oncoming_lanes(town)
    for lane in town.lanes:
        record, found = ways[lane.id], town.exits(lane.id)
        record.exit, record.exits = len(exits), len(found)
        exits += [(way.connector, way.lane, way.angle, lanes[way.connector].junction) for way in found]
        record.chooses = _is_choice(found)
        record.onward = NOBODY
        record.end, record.merge = lane.length, NOBODY
        side = town.merge(lane.id)
        beside_end = None if side is None else town.neighbour(lane.id, side)
        if beside_end is not None:
            record.end, record.merge = lane.wide_until, beside_end
        if found and not record.chooses:
            record.onward = min(found, key=lambda way: (abs(way.angle), way.connector)).connector
        beside, candidates = side_by_side(town, lane.id), oncoming.candidates(lane.id).tolist()
        record.offers = record.chooses or (bool(found) and ways_part(town, beside))
        record.beside, record.besides = len(lists), len(beside)
        record.oncoming, record.oncomings = len(lists) + len(beside), len(candidates)
        lists += beside + candidates
    table = empty_records(ExitRecord, len(exits))
    for name, column in zip(("connector", "lane", "angle", "junction"), zip(*exits, strict=True), strict=False):
        table[name] = column
    return LaneExits(ways, table, np.array(lists, dtype=np.int32))


def side_by_side(town: Town, lane: int) -> list[int]:
    """Returns a lane and all that are reached from it by lane changes."""
    found = [lane]
    for known in found:
        for side in LANE_CHANGES:
            beside = town.neighbour(known, side)
            if beside is not None and beside not in found:
                found.append(beside)
    return found


def _is_choice(exits: tuple[Exit, ...]) -> bool:
    return len(exits) > 1 and any(way.junction_id >= 0 for way in exits)


def ways_part(town: Town, beside: list[int]) -> bool:
    """Returns whether the exits of adjacent lanes lead to different directions."""
    turns = [way.angle for lane in beside for way in town.exits(lane) if way.junction_id >= 0]
    return max((abs(wrap_degrees(turn - turns[0])) for turn in turns), default=0.0) > ANOTHER_WAY
