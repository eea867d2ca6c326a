"""Ways beside the lanes, where people walk that are no pavement's: in towns without them, and whom a wizard calls."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dorothie_gym.world.kernel.gait import (
    FROM_ENDS,
    FROM_JUNCTION,
    KERB,
    SHORTEST_WALK,
    WALK_STEP,
)
from dorothie_gym.world.kernel.records import Records
from dorothie_gym.world.town.beside import leftmost, rightmost
from dorothie_gym.world.town.lane_edges import LaneEdges
from dorothie_gym.world.town.model import Array, Town
from dorothie_gym.world.town.oncoming import oncoming_lanes

WIDEST = 45.0
"""Nobody crosses a wider road [m]."""

NARROWEST = 3.0
"""A narrower one is none [m]."""

STRAIGHT = 0.01
"""Points are left out where the heading changes by less than this [rad] ..."""

EVEN = 0.05
"""... and the way across by less than this [m]."""


class StreetWalk(NamedTuple):
    """A way beside a lane.

    Attributes:
        lane: its id, the rightmost one of its direction.
        points: (n, 6) x, y, station, heading, height, and how far it is to the kerb across the road, at a right angle
            to the left, or 0 where nobody crosses [m].
    """

    lane: int
    points: Array


def street_walks(points: Array, lanes: Records, town: Town, edges: LaneEdges) -> list[StreetWalk]:
    """All ways beside lanes outside junctions, as long as no other lane is in their way.

    Args:
        points: (p, 6) of the lanes' centre lines, as in `TownArrays`.
        lanes: `records.LANE`.
        town: the town.
        edges: where its lanes are.
    """
    beside = [_beside(points, lanes[lane.id]) for lane in town.lanes]
    rows = [(k, row) for k, row in enumerate(beside) if row is not None]
    if not rows:
        return []
    free = edges.free(np.concatenate([row[:, (0, 1, 4)] for _, row in rows]), KERB / 2)
    found: list[StreetWalk] = []
    begin = 0
    for lane, row in rows:
        blocked = np.flatnonzero(~free[begin : begin + len(row)])
        begin += len(row)
        for low, high in pairwise((-1, *blocked.tolist(), len(row))):
            stretch = row[low + 1 : high]
            if len(stretch) and stretch[-1, 2] - stretch[0, 2] >= SHORTEST_WALK:
                found.append(StreetWalk(lane, stretch))
    across = [_across(points, lanes, town, walk) for walk in found]
    far = [_far(walk.points, way) for walk, way in zip(found, across, strict=True)]
    landing = np.split(edges.free(np.concatenate(far), KERB / 2), np.cumsum([len(each) for each in far])[:-1])
    return [
        StreetWalk(walk.lane, _finished(walk.points, way * lands))
        for walk, way, lands in zip(found, across, landing, strict=True)
    ]  # fmt: skip


def _beside(points: Array, lane: Records) -> Array | None:
    """x, y, station on the lane, heading, height, 0 at the kerb of a lane; None if nobody walks beside it."""
    count = int((lane.length - 2.0 * FROM_ENDS) / WALK_STEP) + 1
    if lane.right >= 0 or lane.junction >= 0 or (count - 1) * WALK_STEP < SHORTEST_WALK:
        return None
    return _offset(points, lane, np.linspace(FROM_ENDS, FROM_ENDS + (count - 1) * WALK_STEP, count), 1.0)


def _offset(points: Array, lane: Records, stations: Array, side: float) -> Array:
    """As `_beside` at some stations, to the right of a lane (side 1) or to the left (-1)."""
    own = points[lane.first : lane.last + 1]
    x, y, heading, height, width = (np.interp(stations, own[:, 2], own[:, k]) for k in (0, 1, 3, 4, 5))
    lateral = side * (width / 2 + KERB)
    return np.column_stack(
        (x - lateral * np.sin(heading), y + lateral * np.cos(heading), stations, heading, height, 0.0 * x)
    )


def _across(points: Array, lanes: Records, town: Town, walk: StreetWalk) -> Array:
    """How far it is straight to the left over all lanes of both directions (n,) [m], 0 where nobody crosses."""
    row, own = walk.points, town.lanes[walk.lane]
    far, side = leftmost(town, walk.lane), -1.0
    middle = own.position(float(row[len(row) // 2, 2]))
    oncoming = oncoming_lanes(town).at(far, town.lanes[far].project(middle)[0])
    if oncoming is not None:
        far, side = rightmost(town, oncoming.lane), 1.0
    stations = np.linspace(0.0, lanes[far].length, int(lanes[far].length) + 2)
    kerb = _offset(points, lanes[far], stations, side)
    dx, dy = (kerb[None, :, k] - row[:, None, k] for k in (0, 1))
    cos, sin = np.cos(row[:, 3, None]), np.sin(row[:, 3, None])
    along, left = np.abs(dx * cos + dy * sin), dx * sin - dy * cos
    along[(left < NARROWEST) | (left > WIDEST)] = np.inf
    nearest = along.argmin(axis=1)
    rows = np.arange(len(row))
    crosses = (along[rows, nearest] < 1.0) & (row[:, 2] > FROM_JUNCTION) & (row[:, 2] < own.length - FROM_JUNCTION)
    return np.where(crosses, left[rows, nearest], 0.0)


def _far(row: Array, across: Array) -> Array:
    """Places across the road (n, 3) [m]."""
    return np.column_stack((row[:, 0] + across * np.sin(row[:, 3]), row[:, 1] - across * np.cos(row[:, 3]), row[:, 4]))


def _finished(row: Array, across: Array) -> Array:
    """The points that are needed of a way, with stations along itself and the ways across."""
    kept = [0]
    for k in range(1, len(row) - 1):
        last = kept[-1]
        turned = max(abs(row[k, 3] - row[last, 3]), abs(row[k + 1, 3] - row[last, 3]))
        changed = max(abs(across[k] - across[last]), abs(across[k + 1] - across[last]))
        if turned > STRAIGHT or changed > EVEN:
            kept.append(k)
    kept.append(len(row) - 1)
    points = np.column_stack((row[:, :5], across))[kept]
    steps = np.sqrt((np.diff(points[:, :2], axis=0) ** 2).sum(axis=1))
    points[:, 2] = np.concatenate(([0.0], np.cumsum(steps)))
    return points
