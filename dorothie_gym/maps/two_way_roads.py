"""Pairs of one-way roads that are the two directions of one street, as SUMO writes them."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Lane

STEP = 5.0
"""Distance between compared points of a road [m]."""

VERGE = 4.0
"""Largest distance between the inner edges of the two directions [m]: room for a turn lane that opens."""

OVERLAP = 1.0
"""Largest overlap of the two directions [m]; also the least distance between lanes side by side."""

SHARE = 0.7
"""Smallest share of the points of either road that lie beside the other one."""

MIN_OPPOSITION = math.radians(150.0)
"""Smallest difference of direction [rad]."""

MAX_HEIGHT = 1.0
"""Largest difference of height [m]."""


class RoadWay(NamedTuple):
    """Two-way road that a road is part of: the smaller id of the two roads, and whether this one runs against it."""

    road: int
    flipped: bool


def two_way_roads(lanes: Sequence[Lane]) -> dict[int, RoadWay]:
    """Returns the two-way road of each road; a road that is no half of a pair is its own."""
    ways = {lane.road_id: RoadWay(lane.road_id, False) for lane in lanes}
    points = _points_of_one_way_roads(lanes)
    if not points:
        return ways
    owners = np.repeat(list(points), [len(rows) for rows in points.values()])
    table = np.concatenate(list(points.values()))
    best = _most_beside(owners, table)
    for road, other in best.items():
        if best.get(other) == road and road < other:
            ways[other] = RoadWay(road, True)
    return ways


def _most_beside(owners: np.ndarray[tuple[int], np.dtype[np.int64]], table: Array) -> dict[int, int]:
    """Returns for each road the one that lies opposite along most of its length, if there is one."""
    tree = cKDTree(table[:, :2])
    around = tree.query_ball_point(table[:, :2], float(table[:, 4].max()) + VERGE + STEP, return_sorted=True)
    sections: Counter[int] = Counter()  # cross-sections of each road; a row of lanes side by side is one
    opposite: defaultdict[int, Counter[int]] = defaultdict(Counter)
    for k, found in enumerate(around):
        others = np.asarray(found, dtype=np.int64)
        road, same = int(owners[k]), owners[others] == owners[k]
        along, across = _beside(table[k], table[others])
        level = along <= 0.5 * STEP
        sections[road] += not np.any(same & level & (across > OVERLAP) & (others < k))
        gap = across - 0.5 * (table[others, 4] + table[k, 4])
        touching = level & (gap >= -OVERLAP) & (gap <= VERGE)
        opposite[road].update(set(owners[others[touching & ~same & _is_oncoming(table[k], table[others])]].tolist()))
    best = {}
    for road, counts in opposite.items():
        if counts:
            other, count = min(counts.items(), key=lambda item: (-item[1], item[0]))
            if count >= SHARE * sections[road]:
                best[road] = other
    return best


def _points_of_one_way_roads(lanes: Sequence[Lane]) -> dict[int, Array]:
    """Returns points along the lanes of one-way roads, by road: x, y, z, heading, width (n, 5)."""
    roads: defaultdict[int, list[Lane]] = defaultdict(list)
    for lane in lanes:
        if not lane.in_junction:
            roads[lane.road_id].append(lane)
    return {
        road: np.concatenate([_points(lane) for lane in members])
        for road, members in sorted(roads.items())
        if len({lane.lane_id > 0 for lane in members}) == 1
    }


def _points(lane: Lane) -> Array:
    at = np.linspace(0.0, lane.length, max(2, math.ceil(lane.length / STEP) + 1))
    columns = (*lane.points.T, lane.headings, lane.widths)
    return np.column_stack([np.interp(at, lane.stations, column) for column in columns])


def _beside(row: Array, others: Array) -> tuple[Array, Array]:
    """Returns the distances of points (n, 5) to a point (5,) along and across its direction (n,) [m]."""
    dx, dy = (others[:, k] - row[k] for k in (0, 1))
    c, n = pn.cos(row[3]), pn.sin(row[3])
    return np.abs(dx * c + dy * n), np.abs(dy * c - dx * n)


def _is_oncoming(row: Array, others: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Returns which points (n, 5) are on the level of a point (5,) and have the opposite direction (n,)."""
    turn = np.abs((others[:, 3] - row[3] + math.pi) % (2.0 * math.pi) - math.pi)
    result: np.ndarray[tuple[int], np.dtype[np.bool_]] = turn >= MIN_OPPOSITION
    result &= np.abs(others[:, 2] - row[2]) <= MAX_HEIGHT
    return result
