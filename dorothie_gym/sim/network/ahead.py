"""Lanes ahead of and behind a lane, and the next bodies on them."""

from __future__ import annotations

import functools
import heapq
import itertools
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from dorothie_gym.maps.model import LEVEL_HEIGHT, WIDTH, Array, IntArray, LaneTable, local_coordinates, value_at
from dorothie_gym.support.compilation import allocating

if TYPE_CHECKING:
    from dorothie_gym.sim.network.network import LaneIndex, TownNetwork

HORIZON = 80.0
"""Range ahead and behind, beyond the vehicle's own lane, in which neighbours are searched [m]."""
LANE_MARGIN = 1.0
"""Distance outside of a lane up to which a body counts as on it [m], as in highway-env."""
OVERHANG = 5.0
"""Distance before the start and after the end of a lane up to which a body counts as on it [m], as in highway-env."""


_Rest: TypeAlias = tuple[tuple[str, str, int | None], ...]


class Chain(NamedTuple):
    """Sequence of lanes.

    Attributes:
        rows: (n,) in the network's table.
        offsets: (n,) start of each, measured from the start of the first one [m].
    """

    rows: IntArray
    offsets: Array


class LaneChains:
    """Lanes around each lane, with a cache of the last answers, since a vehicle keeps its route for a while."""

    def __init__(self, network: TownNetwork) -> None:
        self._network = network
        self._remembered = functools.lru_cache(maxsize=4096)(self._find)

    def around(self, index: LaneIndex, route: Sequence[tuple[str, str, int | None]] | None) -> Chain:
        """Returns the lane itself, the lanes ahead along a route (or all, where it has ended) and the lanes behind.

        Args:
            index: lane to start from.
            route: remaining edges or lanes, starting with this lane's edge or the next one.

        Returns:
            Lanes that begin within `HORIZON` of the lane's end or end within it of its start; the lane itself first,
            then those ahead and then those behind, each from near to far.
        """
        return self._remembered(index, tuple(route or ()))

    def _find(self, index: LaneIndex, route: _Rest) -> Chain:
        row = self._network.row(index)
        length = self._network.get_lane(index).length
        ahead = self._walk(index, route, self._onward, length)
        behind = self._walk(index, (), self._back, 0.0)
        found = [(row, 0.0), *((r, s) for r, s in ahead), *((r, -s - self._length(r)) for r, s in behind)]
        rows, offsets = zip(*found, strict=True)
        return Chain(np.array(rows, dtype=np.int64), np.array(offsets, dtype=np.float64))

    def _length(self, row: int) -> float:
        table = self._network.table
        return float(table.points[table.offsets[row + 1] - 1, 2])

    def _onward(self, index: LaneIndex, route: _Rest) -> list[tuple[LaneIndex, _Rest]]:
        if route and route[0][:2] == index[:2]:
            route = route[1:]
        successors = self._network.successors(index)
        planned = self._network.along_route(successors, route)
        return [(planned[0], route)] if planned else [(lane, ()) for lane in successors]

    def _back(self, index: LaneIndex, route: _Rest) -> list[tuple[LaneIndex, _Rest]]:
        return [(lane, route) for lane in self._network.predecessors(index)]

    def _walk(
        self,
        index: LaneIndex,
        route: _Rest,
        step: Callable[[LaneIndex, _Rest], list[tuple[LaneIndex, _Rest]]],
        start: float,
    ) -> list[tuple[int, float]]:
        """Rows and distances of the lanes that are reached, nearest first (Dijkstra's search)."""
        seen = {self._network.row(index)}
        order = itertools.count()  # so that lanes equally far keep the order of the links
        found: list[tuple[int, float]] = []
        queue: list[tuple[float, int, LaneIndex, _Rest]] = []

        def push(at: float, lane: LaneIndex, rest: _Rest) -> None:
            for following, remaining in step(lane, rest):
                heapq.heappush(queue, (at, next(order), following, remaining))

        push(start, index, route)
        while queue:
            at, _, lane, rest = heapq.heappop(queue)
            row = self._network.row(lane)
            if row in seen or at - start > HORIZON:
                continue
            seen.add(row)
            found.append((row, at))
            push(at + self._length(row), lane, rest)
        return found


class Neighbours(NamedTuple):
    """Next bodies: positions in the list of candidates (-1: none), and distances along the lanes [m] (infinite)."""

    front: int
    front_distance: float
    rear: int
    rear_distance: float


def lane_zones(table: LaneTable) -> Array:
    """Returns minimum x, minimum y, maximum x, maximum y [m] of the bodies that count as on each lane: (n, 4)."""
    widest = np.maximum.reduceat(table.points[:, WIDTH], table.offsets[:-1])
    reach = (0.5 * widest + LANE_MARGIN + OVERHANG)[:, None]
    return np.hstack((table.boxes[:, :2] - reach, table.boxes[:, 2:] + reach))


@allocating
def neighbours_on(
    points: Array,
    offsets: IntArray,
    ends: Array,
    zones: Array,
    rows: IntArray,
    starts: Array,
    own: Array,
    places: Array,
    heights: Array,
    lanes: IntArray,
) -> tuple[int, float, int, float]:
    """Returns the nearest of many bodies ahead and behind on a chain of lanes, by highway-env's rules.

    Args:
        points: see `LaneTable`.
        offsets: see `LaneTable`.
        ends: see `LaneTable`.
        zones: (n, 4) rectangles outside of which no body is on a lane; see `lane_zones`.
        rows: lanes of the chain; the first is the one to start from.
        starts: where they begin [m].
        own: one's own position (2,) [m].
        places: positions (n, 2) of the candidates [m].
        heights: their heights (n,) [m], NaN for that of their lanes.
        lanes: rows (n,) of the lanes they are on, -1 for none: then they may be at any height.

    Returns:
        Fields of `Neighbours`.
    """
    s, _ = local_coordinates(points, offsets, ends, rows[0], own[0], own[1])
    front, rear, s_front, s_rear = -1, -1, np.inf, -np.inf
    for i in range(len(places)):
        x, y = places[i, 0], places[i, 1]
        for j in range(len(rows)):
            row = rows[j]
            if x < zones[row, 0] or x > zones[row, 2] or y < zones[row, 1] or y > zones[row, 3]:
                continue
            at, lateral = local_coordinates(points, offsets, ends, row, x, y)
            if not -OVERHANG <= at < points[offsets[row + 1] - 1, 2] + OVERHANG:
                continue
            if abs(lateral) > 0.5 * value_at(points, offsets, row, 5, at) + LANE_MARGIN:
                continue
            height = heights[i]
            if math.isnan(height) and lanes[i] >= 0:
                below, _ = local_coordinates(points, offsets, ends, lanes[i], x, y)
                height = value_at(points, offsets, lanes[i], 4, below)
            if abs(value_at(points, offsets, row, 4, at) - height) > LEVEL_HEIGHT:
                continue
            at += starts[j]
            if j > 0 and abs(at - s) > HORIZON:
                continue
            if s <= at and at <= s_front:
                front, s_front = i, at
            if at < s and at > s_rear:
                rear, s_rear = i, at
            if j == 0:
                break  # as in highway-env; elsewhere several routes may lead to it, round a block both ahead and behind
    return front, s_front - s, rear, s - s_rear
