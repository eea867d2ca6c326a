"""Geometric neighbours of lanes: parallel lanes, oncoming lanes, lane edges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import (
    HEADING,
    HEIGHT,
    STATION,
    Array,
    IntArray,
    LaneTable,
    LinkType,
    X,
    Y,
    local_coordinates,
    position,
    value_at,
)
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import allocating, compiled
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

WIDEST_MEDIAN = 13.0
"""Largest distance between the centre lines [m]: across a median, but not across a park."""

MAX_HEIGHT = 1.0
"""Largest difference of height [m]."""

MIN_OPPOSITION = math.radians(150.0)
"""Smallest difference of direction [rad]."""

MIN_GAP = 1.0
"""Smallest distance between the centre lines [m]."""

MAX_OFFSET = 3.0
"""Largest distance along the lane to the closest point of the other lane [m]; beyond it the other lane has ended."""

LEAST_TO_TURN, LEAST_TO_WAIT = 10.0, 5.0
"""Least length of a lane on which a car can turn round [m], and of one at whose end it waits.

It waits where no lane leads on, or one must be chosen. On a shorter lane the centre of a waiting car lies before the
lane, and a moving car passes it before it has braked.
"""

SAMPLING = 4.0
"""Spacing of the points by which candidate lanes are found [m]; up to twice as much on short lanes."""


class Oncoming(NamedTuple):
    """Point on the oncoming lane opposite a point on a lane: lane id, station [m] and distance [m]."""

    lane: int
    station: float
    gap: float


@shared
class OncomingLanes:
    """Lookup of the oncoming lane across the middle of the road from a point on a lane."""

    def __init__(self, town: Town) -> None:
        self._town = town
        self._table = LaneTable.of(town.lanes)
        owners, points = [], []
        for lane in town.lanes:
            if lane.in_junction:
                continue
            for station in np.linspace(0.0, lane.length, max(2, int(lane.length / SAMPLING) + 1)):
                points.append(lane.position(float(station)))
                owners.append(lane.id)
        self._owners = np.array(owners)
        self._points = np.array(points)
        self._near: dict[int, IntArray] = {}

    def at(self, lane_id: int, station: float) -> Oncoming | None:
        """Returns the opposite point on the oncoming lane.

        None in a junction, on a lane that is not the innermost or too short, and without an oncoming lane nearby. At a
        dead end, where all lanes end, cars turn round from the other lanes too.
        """
        candidates = self.candidates(lane_id)
        if not len(candidates):
            return None
        table = self._table
        sign = self._town.traffic.sign
        found = Oncoming(*across(table.points, table.offsets, table.ends, lane_id, station, candidates, sign))
        return found if found.lane >= 0 else None

    def candidates(self, lane_id: int) -> IntArray:
        """Returns the lanes that may be oncoming somewhere along a lane (n,)."""
        found = self._near.get(lane_id)
        if found is None:
            found = self._near[lane_id] = self._lanes_near(lane_id)
        return found

    def _lanes_near(self, lane_id: int) -> IntArray:
        """Returns the lanes outside junctions that are close enough to be oncoming somewhere along a lane."""
        lane = self._town.lanes[lane_id]
        innermost = self._town.neighbour(lane_id, self._town.traffic.to_middle) is None
        ways_on = len(self._town.successors(lane_id))
        ends = ways_on == 0 and self._town.merge(lane_id) is None
        short = lane.length < (LEAST_TO_TURN if ways_on == 1 else LEAST_TO_WAIT)
        if lane.in_junction or short or not (innermost or ends):
            return np.empty(0, dtype=np.int64)
        reach = pm.hypot(WIDEST_MEDIAN, MAX_OFFSET) + 2 * SAMPLING  # points are at most two samplings apart
        own = self._points[self._owners == lane_id]
        around = ((self._points >= own.min(axis=0) - reach) & (self._points <= own.max(axis=0) + reach)).all(axis=1)
        gaps = self._points[around][:, None] - own[None, :]
        near = (np.square(gaps).sum(axis=2) <= reach * reach).any(axis=1)
        return np.unique(self._owners[around][near]).astype(np.int64)


@allocating
def across(
    points: Array, offsets: IntArray, ends: Array, lane: int, station: float, candidates: IntArray, sign: float
) -> tuple[int, float, float]:
    """Returns the closest oncoming lane among candidates (-1: none), the station on it [m], and the distance [m].

    `sign` is that of the town's `DrivingSide`.
    """
    x, y = position(points, offsets, ends, lane, station, 0.0)
    heading = value_at(points, offsets, lane, HEADING, station)
    height = value_at(points, offsets, lane, HEIGHT, station)
    found, at, least = -1, 0.0, math.inf
    for other in candidates:
        there, _ = local_coordinates(points, offsets, ends, other, x, y)
        there = min(max(there, 0.0), points[offsets[other + 1] - 1, STATION])
        gap = opposite_gap(
            x,
            y,
            heading,
            height,
            value_at(points, offsets, other, X, there),
            value_at(points, offsets, other, Y, there),
            value_at(points, offsets, other, HEADING, there),
            value_at(points, offsets, other, HEIGHT, there),
            sign,
        )
        if gap < least:
            found, at, least = other, there, gap
    return found, at, least


@compiled
def opposite_gap(
    x: float,
    y: float,
    heading: float,
    height: float,
    other_x: float,
    other_y: float,
    other_heading: float,
    other_height: float,
    sign: float,
) -> float:
    """Returns the distance to a point on another lane, infinite if that is not opposite and oncoming [m].

    `sign` is that of the town's `DrivingSide`.
    """
    if abs((other_heading - heading + math.pi) % (2 * math.pi) - math.pi) < MIN_OPPOSITION:
        return math.inf
    c, n = pm.cos(heading), pm.sin(heading)
    dx, dy = other_x - x, other_y - y
    across, along = sign * (dy * c - dx * n), dx * c + dy * n  # positive towards the kerb
    if not -WIDEST_MEDIAN <= across < -MIN_GAP or abs(along) > MAX_OFFSET:
        return math.inf
    return -across if abs(other_height - height) <= MAX_HEIGHT else math.inf


@lru_cache(maxsize=16)
def oncoming_lanes(town: Town) -> OncomingLanes:
    """Returns the oncoming lanes of a town; built once for each town."""
    return OncomingLanes(town)


# --- Lanes side by side ----------------------------------------------------------------------------------------------


def outermost(town: Town, lane_id: int) -> int:
    """Returns the lane nearest to the kerb that can be reached by lane changes."""
    return _last(town, lane_id, town.traffic.to_kerb)


def innermost(town: Town, lane_id: int) -> int:
    """Returns the lane nearest to the middle of the road that can be reached by lane changes."""
    return _last(town, lane_id, town.traffic.to_middle)


def _last(town: Town, lane_id: int, side: LinkType) -> int:
    while (beside := town.neighbour(lane_id, side)) is not None:
        lane_id = beside
    return lane_id


# --- Ground covered by lanes -----------------------------------------------------------------------------------------

LANE_LEVEL = 2.0
"""Lanes with a larger difference of height are ignored [m]."""

LANE_SAMPLING = 0.5
"""Sampling distance of lanes and of tested lines [m]."""


class LaneEdges:
    """Ground covered by the lanes of a town, as discs of the lane width along the centre lines."""

    def __init__(self, town: Town) -> None:
        rows = []
        for lane in town.lanes:
            at = np.linspace(0.0, lane.length, max(2, math.ceil(lane.length / LANE_SAMPLING) + 1))
            rows.append(
                np.column_stack([np.interp(at, lane.stations, column) for column in (*lane.points.T, lane.widths / 2)])
            )
        self._discs = np.concatenate(rows)  # (n, 4) x, y, z, radius
        self._tree = cKDTree(self._discs[:, :2])
        self._widest = float(self._discs[:, 3].max())

    def height(self, place: Array) -> float:
        """Returns the height of the lane nearest to a position (2,) [m]."""
        return float(self._discs[int(self._tree.query(place)[1]), 2])

    def is_clear(self, ends: Sequence[Array] | Array, height: float, margin: float) -> bool:
        """Returns whether a straight line between two positions keeps a margin [m] to all lanes at its height."""
        first, last = ends[0][:2], ends[1][:2]
        count = max(2, math.ceil(float(pn.hypot(*(last - first))) / LANE_SAMPLING) + 1)
        share = np.linspace(0.0, 1.0, count)[:, None]
        places = (1.0 - share) * first + share * last
        return bool(self.free(np.column_stack((places, np.full(len(places), height))), margin).all())

    def free(self, places: Array, margin: float) -> NDArray[np.bool_]:
        """Returns which positions (n, 3) keep a margin [m] to all lanes at their height (n,)."""
        found = self._tree.query_ball_point(places[:, :2], self._widest + margin, return_sorted=False)
        near = cast(Sequence[list[int]], found)  # the stubs of scipy describe the result for a single point only
        counts = np.fromiter((len(discs) for discs in near), dtype=np.int64, count=len(places))
        free = np.ones(len(places), dtype=bool)
        if not counts.any():
            return free
        owners = np.repeat(np.arange(len(places)), counts)
        discs = self._discs[np.concatenate([np.asarray(discs, dtype=np.int64) for discs in near if discs])]
        gaps = pn.hypot(*(discs[:, :2] - places[owners, :2]).T)
        free[owners[(gaps < discs[:, 3] + margin) & (np.abs(discs[:, 2] - places[owners, 2]) < LANE_LEVEL)]] = False
        return free
