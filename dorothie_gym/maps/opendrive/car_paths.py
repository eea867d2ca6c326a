"""Shortest paths that a car can follow between two places, on arcs of one radius (L. E. Dubins, 1957)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

# Radii of the arcs [m], the largest that fits: a little more than the smallest turning circle of the car, and smaller
# ones where lanes meet at a corner without room, which a car leaves by less than a metre.
RADII = (4.2, 3.2, 2.4, 1.8, 1.3, 0.9, 0.6, 0.4)

# Largest sum of turns in addition to the change of direction [rad]: two swings in a U-turn, but no loop. On arcs that
# are tighter than the turning circle of the car, swings are in vain.
MOST_SWING, MOST_TIGHT_SWING = math.radians(220.0), math.radians(60.0)

_STEP, _LARGEST_ANGLE = 0.3, 0.15  # largest distance between points on arcs [m], and change of direction [rad]


class Pose(NamedTuple):
    """Position [m] and direction [rad] in the plane."""

    x: float
    y: float
    heading: float


def turn_between(source: Array, target: Array) -> float:
    """Returns the change of direction from the end of a lane to the start of another one, without sign [rad]."""
    return abs(math.remainder(pose_at(target, 0).heading - pose_at(source, -1).heading, math.tau))


def path_between(source: Array, target: Array, widths: tuple[float, float]) -> Array | None:
    """Returns the centre line (n, 4) from the end of a line to the start of another one.

    Args:
        source: the line before (m, >= 3): x, y, z.
        target: the line after it.
        widths: width at both ends [m].

    Returns:
        Rows of x, y, z and width [m], or None if a car would have to drive a loop.
    """
    begin, end = pose_at(source, -1), pose_at(target, 0)
    for radius in RADII:
        legs = shortest_legs(begin, end, radius)
        turned = sum(abs(length) for kind, length in legs if kind != 0) / radius
        swing = MOST_SWING if radius == RADII[0] else MOST_TIGHT_SWING
        if turned <= turn_between(source, target) + swing:
            break
    else:
        return None
    points = np.array([(begin.x, begin.y), *_points(begin, legs, radius)])
    points[-1] = end.x, end.y
    along = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(points, axis=0).T))))
    points = points[np.concatenate(([True], np.diff(along) > 1e-3))]
    along = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(points, axis=0).T))))
    if len(points) < 2:
        return None
    share = along / along[-1]
    heights = (1.0 - share) * source[-1, 2] + share * target[0, 2]
    return np.column_stack((points, heights, np.interp(share, [0.0, 1.0], widths)))


def pose_at(line: Array, end: int) -> Pose:
    """Returns the pose at the start (0) or end (-1) of a line (n, >= 2)."""
    dx, dy = line[-1, :2] - line[-2, :2] if end else line[1, :2] - line[0, :2]
    return Pose(float(line[end, 0]), float(line[end, 1]), pm.atan2(float(dy), float(dx)))


def _points(pose: Pose, legs: list[tuple[int, float]], radius: float) -> Iterator[tuple[float, float]]:
    """Yields points along legs: the ends of straights, and steps along arcs of a radius [m]."""
    x, y, heading = pose
    step = min(_STEP, _LARGEST_ANGLE * radius)
    for kind, length in legs:
        count = 1 if kind == 0 else max(1, math.ceil(length / step))
        turn = kind * length / radius / count
        chord = length / count if kind == 0 else 2.0 * radius * pm.sin(0.5 * abs(turn))
        for _ in range(count):
            x, y = x + chord * pm.cos(heading + 0.5 * turn), y + chord * pm.sin(heading + 0.5 * turn)
            heading += turn
            yield x, y


def shortest_legs(begin: Pose, end: Pose, radius: float) -> list[tuple[int, float]]:
    """Returns the shortest path between two poses with turns of one radius (L. E. Dubins, 1957).

    Returns:
        Three legs: 1, -1 or 0 for an arc to either side (1: growing heading) or a straight, and its length [m].
    """
    dx, dy = (end.x - begin.x) / radius, (end.y - begin.y) / radius
    c, n = pm.cos(begin.heading), pm.sin(begin.heading)
    ahead, aside, turn = dx * c + dy * n, dy * c - dx * n, (end.heading - begin.heading) % math.tau
    found = []
    for side in (1, -1):  # mirrored, an arc to one side is one to the other
        for kinds, lengths in _words(ahead, side * aside, (side * turn) % math.tau):
            found.append((sum(lengths), [(side * kind, radius * a) for kind, a in zip(kinds, lengths, strict=True)]))
    return min(found, key=lambda row: row[0])[1]


def _words(x: float, y: float, turn: float) -> Iterator[tuple[tuple[int, int, int], tuple[float, float, float]]]:
    """Yields the paths that begin with an arc of growing heading, from (0, 0, 0) to (x, y, turn), radius 1.

    The centre of the first arc is (0, 1); that of the last one lies beside the end.
    """
    c, n = pm.cos(turn), pm.sin(turn)
    # both arcs to the same side: the straight is as long as the centres are apart
    u, v = x - n, y + c - 1.0
    apart = pm.hypot(u, v)
    way = pm.atan2(v, u) % math.tau if apart > 1e-9 else 0.0
    yield (1, 0, 1), (way, apart, (turn - way) % math.tau)
    if apart <= 4.0:  # three arcs: the centre of the middle one is 2 from both others
        corner = pm.acos(0.25 * apart)
        for side in (1, -1):
            first, middle = (way + side * corner + 0.5 * math.pi) % math.tau, math.pi + side * 2.0 * corner
            yield (1, -1, 1), (first, middle, (turn - first + middle) % math.tau)
    # the last arc to the other side: the straight crosses between the centres
    u, v = x + n, y - c - 1.0
    apart = pm.hypot(u, v)
    if apart >= 2.0:
        length = math.sqrt(apart * apart - 4.0)
        way = (pm.atan2(v, u) + pm.atan2(2.0, length)) % math.tau
        yield (1, 0, -1), (way, length, (way - turn) % math.tau)
