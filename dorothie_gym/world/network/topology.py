"""Nodes and edges for the lanes of a town, as highway-env's road graph wants them."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterable

from dorothie_gym.world.town.model import Lane, Town

LEVEL_ENDS = 3.0
"""Lanes side by side end together when their ends are no farther apart than this along the road [m]."""
SIDE_BY_SIDE = 1.5
"""... and when the distance across is no more than this times their mean width."""


def road_edges(town: Town) -> dict[tuple[str, str], list[Lane]]:
    """Edges of the road graph in the order of their first lanes' ids, each with its lanes from left to right.

    Lanes that are linked share a node. Lanes of one road and direction that begin side by side and end side by side are
    one edge. Whatever else joins the same two nodes (connectors that fan out, say) is the same edge, too.
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
    """How far ahead and how far to the right of a lane's end (0 or -1) the other one's is [m]."""
    dx, dy = (float(d) for d in other.points[end, :2] - lane.points[end, :2])
    c, n = math.cos(lane.headings[end]), math.sin(lane.headings[end])
    return dx * c + dy * n, dy * c - dx * n


def _level(lane: Lane, other: Lane, end: int) -> bool:
    along, across = _offset(lane, other, end)
    width = 0.5 * float(lane.widths[end] + other.widths[end])
    limit = min(LEVEL_ENDS, 0.4 * lane.length, 0.4 * other.length)  # so that no short lane begins where it ends
    return abs(along) <= limit and abs(across) <= SIDE_BY_SIDE * width


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
        """Name of the node of each end: numbers in the order of first appearance."""
        numbers: dict[int, str] = {}
        return [numbers.setdefault(self.find(end), str(len(numbers))) for end in range(len(self._parent))]
