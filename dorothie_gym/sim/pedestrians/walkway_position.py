"""The place of a pedestrian on its walkway, and the walkways beside streets without a pavement."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.maps.lane_neighbours import LaneEdges, innermost, oncoming_lanes, outermost
from dorothie_gym.maps.model import Array
from dorothie_gym.sim.pedestrians.pacing import FROM_ENDS, FROM_JUNCTION, KERB, SHORTEST_WALK, WALK_STEP
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.sim.state.records import PedestrianRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import LaneRecord, WalkwayRecord


SIDE_KEPT = 0.4
"""Offset at which pedestrians walk from the centre, to the side of the traffic [m], so that they pass each other."""

FROM_EDGE = 0.4
"""Minimum distance to the edge of the footway [m]."""


@inlined
def side_kept(town: TownArrays, way: WalkwayRecord) -> float:
    """Returns the offset to the right of the centre of a footway at which pedestrians walk [m]."""
    return float(town.sign * min(SIDE_KEPT, max(way.half_width - FROM_EDGE, 0.0)))


@inlined
def locate(town: TownArrays, walker: PedestrianRecord) -> float:
    """Finds the station, segment and height of a pedestrian on its footway.

    Returns:
        Its offset to the right of the centre, in the direction of the footway [m].
    """
    way, points = town.walks[walker.walk], town.walk_points
    k = min(max(walker.segment, way.first), way.last - 1)
    along = _along(points, k, walker.x, walker.y)
    if along > points[k + 1, 2] - points[k, 2]:
        while k < way.last - 1 and along > points[k + 1, 2] - points[k, 2]:
            k += 1
            along = max(_along(points, k, walker.x, walker.y), 0.0)
    else:
        while k > way.first and along < 0.0:
            k -= 1
            along = min(_along(points, k, walker.x, walker.y), points[k + 1, 2] - points[k, 2])
    walker.segment, walker.station = k, points[k, 2] + along
    length = points[k + 1, 2] - points[k, 2]
    walker.height = points[k, 4] + min(max(along / length, 0.0), 1.0) * (points[k + 1, 4] - points[k, 4])
    dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    return float((dx * (walker.y - points[k, 1]) - dy * (walker.x - points[k, 0])) / length)


@inlined
def _along(points: Array, k: int, x: float, y: float) -> float:
    """Returns the distance of a place along a segment [m]."""
    dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    return float(((x - points[k, 0]) * dx + (y - points[k, 1]) * dy) / (points[k + 1, 2] - points[k, 2]))


@inlined
def find_segment(town: TownArrays, walker: PedestrianRecord) -> None:
    """Finds the segment of a pedestrian's footway that its station is on."""
    way, points = town.walks[walker.walk], town.walk_points
    k = way.first
    while k < way.last - 1 and points[k + 1, 2] <= walker.station:
        k += 1
    walker.segment = k


@compiled
def place_beside(
    town: TownArrays, walker: PedestrianRecord, station: float, aside: float
) -> tuple[float, float, float, float]:
    """Returns a place on a pedestrian's footway, to the right of its centre as it walks [m], and the direction there.

    Beyond its ends the footway continues straight.
    """
    way, points = town.walks[walker.walk], town.walk_points
    k = min(max(walker.segment, way.first), way.last - 1)
    while k < way.last - 1 and points[k + 1, 2] <= station:
        k += 1
    while k > way.first and points[k, 2] > station:
        k -= 1
    length = points[k + 1, 2] - points[k, 2]
    cos, sin = (points[k + 1, 0] - points[k, 0]) / length, (points[k + 1, 1] - points[k, 1]) / length
    along, aside = station - points[k, 2], walker.direction * aside
    x = points[k, 0] + along * cos - aside * sin
    y = points[k, 1] + along * sin + aside * cos
    return x, y, walker.direction * cos, walker.direction * sin


@inlined
def enter_next(town: TownArrays, walker: PedestrianRecord) -> None:
    """Moves a pedestrian to the next footway at the end of one, or turns it round if there is none."""
    way = town.walks[walker.walk]
    end = 1 if walker.direction > 0.0 else 0
    if way.next_walk[end] < 0:
        walker.direction = -walker.direction
        return
    walker.direction = 1.0 if way.next_end[end] == 0 else -1.0
    walker.walk = way.next_walk[end]
    way = town.walks[walker.walk]
    walker.segment = way.first if walker.direction > 0.0 else way.last - 1


@compiled
def closest_walk(town: TownArrays, kind: int, x: float, y: float, reach: float) -> tuple[int, float, int]:
    """Returns number (-1 for none in reach), station [m] and segment of the closest footway of a kind to a place."""
    found, at, segment, best = -1, 0.0, 0, reach * reach
    points = town.walk_points
    for number in range(len(town.walks)):
        way = town.walks[number]
        if way.kind != kind or way.length <= 0.0:
            continue
        for k in range(way.first, way.last):
            length = points[k + 1, 2] - points[k, 2]
            along = min(max(_along(points, k, x, y), 0.0), length)
            dx = points[k, 0] + along / length * (points[k + 1, 0] - points[k, 0]) - x
            dy = points[k, 1] + along / length * (points[k + 1, 1] - points[k, 1]) - y
            if dx * dx + dy * dy < best:
                found, at, segment, best = number, points[k, 2] + along, k, dx * dx + dy * dy
    return found, at, segment


# --- Ways beside streets ----------------------------------------------------------------------------------------------

WIDEST_ROAD = 45.0
"""Width of the widest road that pedestrians cross [m]."""

NARROWEST_ROAD = 3.0
"""Width of the narrowest road [m]."""

STRAIGHT = 0.01
"""Change of heading below which points are left out [rad]."""

EVEN = 0.05
"""Change of the distance across below which points are left out [m]."""


class StreetWalk(NamedTuple):
    """A footway beside a lane.

    Attributes:
        lane: its id, the outermost one of its direction.
        points: (n, 6) x, y, station, heading, height, and the distance to the kerb across the road, at a right angle
            from the kerb, or 0 where the road is not crossed [m].
    """

    lane: int
    points: Array


def street_walks(points: Array, lanes: RecordArray[LaneRecord], town: Town, edges: LaneEdges) -> list[StreetWalk]:
    """Returns all footways beside lanes outside junctions, cut where another lane obstructs them.

    Args:
        points: (p, 6) of the lanes' centre lines, as in `TownArrays`.
        lanes: `town_records.LaneRecord`.
        town: the town.
        edges: edges of its lanes.
    """
    beside = [_beside(points, lanes[lane.id], town.traffic.sign) for lane in town.lanes]
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
    if not found:  # short roads, or lanes on both sides
        return []
    across = [_across(points, lanes, town, walk) for walk in found]
    far = [_far(walk.points, town.traffic.sign * way) for walk, way in zip(found, across, strict=True)]
    landing = np.split(edges.free(np.concatenate(far), KERB / 2), np.cumsum([len(each) for each in far])[:-1])
    return [
        StreetWalk(walk.lane, _finished(walk.points, way * lands))
        for walk, way, lands in zip(found, across, landing, strict=True)
    ]


def _beside(points: Array, lane: LaneRecord, sign: int) -> Array | None:
    """Returns x, y, station on the lane, heading, height, 0 at the kerb of a lane; None if there is no footway."""
    count = int((lane.length - 2.0 * FROM_ENDS) / WALK_STEP) + 1
    if lane.outer >= 0 or lane.junction >= 0 or (count - 1) * WALK_STEP < SHORTEST_WALK:
        return None
    return _offset(points, lane, np.linspace(FROM_ENDS, FROM_ENDS + (count - 1) * WALK_STEP, count), sign)


def _offset(points: Array, lane: LaneRecord, stations: Array, side: int) -> Array:
    """Returns the rows of `_beside` at the given stations, to the right of a lane (side 1) or to the left (-1)."""
    own = points[lane.first : lane.last + 1]
    x, y, heading, height, width = (np.interp(stations, own[:, 2], own[:, k]) for k in (0, 1, 3, 4, 5))
    lateral = side * (width / 2 + KERB)
    return np.column_stack(
        (x - lateral * pn.sin(heading), y + lateral * pn.cos(heading), stations, heading, height, 0.0 * x)
    )


def _across(points: Array, lanes: RecordArray[LaneRecord], town: Town, walk: StreetWalk) -> Array:
    """Returns the distance across all lanes of both directions (n,) [m], 0 where the road is not crossed."""
    row, own, sign = walk.points, town.lanes[walk.lane], town.traffic.sign
    far, side = innermost(town, walk.lane), -sign
    middle = own.position(float(row[len(row) // 2, 2]))
    oncoming = oncoming_lanes(town).at(far, town.lanes[far].project(middle)[0])
    if oncoming is not None:
        far, side = outermost(town, oncoming.lane), sign
    stations = np.linspace(0.0, lanes[far].length, int(lanes[far].length) + 2)
    kerb = _offset(points, lanes[far], stations, side)
    dx, dy = (kerb[None, :, k] - row[:, None, k] for k in (0, 1))
    cos, sin = pn.cos(row[:, 3, None]), pn.sin(row[:, 3, None])
    along, over = np.abs(dx * cos + dy * sin), sign * (dx * sin - dy * cos)
    along[(over < NARROWEST_ROAD) | (over > WIDEST_ROAD)] = np.inf
    nearest = along.argmin(axis=1)
    rows = np.arange(len(row))
    crosses = (along[rows, nearest] < 1.0) & (row[:, 2] > FROM_JUNCTION) & (row[:, 2] < own.length - FROM_JUNCTION)
    return np.where(crosses, over[rows, nearest], 0.0)


def _far(row: Array, across: Array) -> Array:
    """Returns the places at distances to the left (n,), across the road (n, 3) [m]."""
    return np.column_stack((row[:, 0] + across * pn.sin(row[:, 3]), row[:, 1] - across * pn.cos(row[:, 3]), row[:, 4]))


def _finished(row: Array, across: Array) -> Array:
    """Returns the necessary points of a footway, with stations along it and distances across."""
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
