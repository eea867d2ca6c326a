"""Where somebody is on a footway, and what lies a little ahead."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.records import Records
from dorothie_gym.world.town.model import Array

if TYPE_CHECKING:
    from dorothie_gym.world.kernel.town_arrays import TownArrays

ASIDE = 0.4
"""How far to the right of the middle one walks [m]: those who come towards one pass by."""

FROM_EDGE = 0.4
"""But no closer to the edge than this [m]."""


@inlined
def side_kept(way: Records) -> float:
    """How far to the right of the middle of a way one walks [m]."""
    return float(min(ASIDE, max(way.half_width - FROM_EDGE, 0.0)))


@inlined
def locate(town: TownArrays, walker: Records) -> float:
    """Finds the station, segment and height of a pedestrian on its footway.

    Returns:
        How far to the right of the middle it is, seen along the way's own direction [m].
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
    """How far along a segment a place is [m]."""
    dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    return float(((x - points[k, 0]) * dx + (y - points[k, 1]) * dy) / (points[k + 1, 2] - points[k, 2]))


@inlined
def find_segment(town: TownArrays, walker: Records) -> None:
    """Finds the segment of a pedestrian's footway that its station is on."""
    way, points = town.walks[walker.walk], town.walk_points
    k = way.first
    while k < way.last - 1 and points[k + 1, 2] <= walker.station:
        k += 1
    walker.segment = k


@compiled
def place_beside(town: TownArrays, walker: Records, station: float, aside: float) -> tuple[float, float, float, float]:
    """A place on a pedestrian's footway, to the right of its middle as it walks [m], and the direction there.

    Beyond its ends the way goes straight on.
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
def enter_next(town: TownArrays, walker: Records) -> None:
    """Goes over to the next footway at the end of one, or turns round where there is none."""
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
    """The footway of a kind that is closest to a place: its number (-1 for none in reach), station [m] and segment."""
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
