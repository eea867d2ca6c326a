"""The line that the car is to drive: lanes joined end to end, with lane switches and U-turns cut in."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dorothie_gym.world.town.model import Array, Lane

SPACING = 1.0
"""Distance between points of a path [m]."""

TURNING_RADIUS = 4.5
"""Radius of a U-turn [m]: a little over the 3.8 m of highway-env's bicycle at full lock (60 degrees, 5 m long)."""


U_TURN_REACH = 14.0
"""Room ahead of its middle that a car needs for a U-turn [m]: 11 m for its middle where lanes are 3.5 m apart, 1 m for
its side, and what is kept free beside it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A stretch of path that belongs to one lane.

    Attributes:
        lane: lane that the car counts as being on.
        points: centre line (n, 2) [m].
        heights: (n,) [m].
        stations: distance along `lane` of each point (n,) [m]; during a U-turn that of its end.
        limit: speed limit [m/s].
        manoeuvre: whether the stretch leaves the lane's centre line (lane switch or U-turn).
    """

    lane: int
    points: Array
    heights: Array
    stations: Array
    limit: float
    manoeuvre: bool = False


def follow(lane: Lane, start: float = 0.0, end: float | None = None) -> Piece:
    """Stretch along the centre line of a lane."""
    end = lane.length if end is None else end
    count = max(2, math.ceil((end - start) / SPACING) + 1)
    s = np.linspace(start, end, count)
    return Piece(lane=lane.id, points=_sample(lane, s), heights=_heights(lane, s), stations=s, limit=lane.speed_limit)


def switch(source: Lane, target: Lane, start: float, distance: float) -> Piece:
    """Stretch from one lane to the one beside it.

    The lateral shift follows 10 t^3 - 15 t^4 + 6 t^5, which has no jump in curvature at either end.

    Args:
        source: lane the car is on.
        target: lane beside it, in the same direction.
        start: distance along `source` at which it begins [m].
        distance: length of the switch along `source` [m].
    """
    t = np.linspace(0.0, 1.0, max(3, math.ceil(distance / SPACING) + 1))
    begin, _ = target.project(source.position(start))
    end, _ = target.project(source.position(start + distance))
    weight = (t**3 * (10 - 15 * t + 6 * t**2))[:, None]
    stations = begin + t * (end - begin)
    points = (1 - weight) * _sample(source, start + t * distance) + weight * _sample(target, stations)
    return Piece(
        lane=target.id,
        points=points,
        heights=_heights(target, stations),
        stations=stations,
        limit=min(source.speed_limit, target.speed_limit),
        manoeuvre=True,
    )


def u_turn(source: Lane, target: Lane, start: float, radius: float = TURNING_RADIUS) -> Piece:
    """Stretch from a lane to the oncoming one on its left.

    Where the lanes are closer than two radii the car first swings out: arcs right, left by more than a half circle,
    right again, whose lateral shifts add up to the distance d of the lanes: cos(swing) = (d + 2 r) / (4 r).

    Args:
        source: lane the car is on.
        target: oncoming lane.
        start: distance along `source` at which it begins [m].
        radius: radius of all arcs [m].
    """
    origin, heading = source.position(start), source.heading_at(start)
    station, lateral = target.project(origin)
    gap = abs(lateral)
    if gap < 2 * radius:
        swing = math.acos((gap + 2 * radius) / (4 * radius))
        arcs = [(radius, swing), (-radius, math.pi + 2 * swing), (radius, swing)]
        middle = 0.0
    else:
        arcs, middle = [(-radius, math.pi / 2), (-radius, math.pi / 2)], gap - 2 * radius
    x, y, psi = float(origin[0]), float(origin[1]), heading
    points = [(x, y)]
    for k, (r, angle) in enumerate(arcs):
        if k == 1 and middle > 0:
            x, y = x + middle * math.cos(psi), y + middle * math.sin(psi)
            points.append((x, y))
        steps = max(2, math.ceil(abs(r) * angle / (SPACING / 2)))
        for _ in range(steps):
            turn = math.copysign(angle / steps, r)
            # chord of an arc of `turn` radians; positive radius turns right (headings are clockwise)
            chord = 2 * abs(r) * math.sin(abs(turn) / 2)
            x, y = x + chord * math.cos(psi + turn / 2), y + chord * math.sin(psi + turn / 2)
            psi += turn
            points.append((x, y))
    line = np.array(points)
    return Piece(
        lane=target.id,
        points=line,
        heights=np.full(len(line), target.height_at(station)),
        stations=np.full(len(line), station),
        limit=min(source.speed_limit, target.speed_limit),
        manoeuvre=True,
    )


class Path:
    """Pieces joined to one line that a car can be steered along.

    Attributes:
        s: distance along the path of each point (n,) [m].
        points: (n, 2) [m].
        headings: (n,) [rad], unwrapped.
        curvatures: (n,) [1/m], positive to the right.
        heights: (n,) [m].
        lanes: lane of each point (n,).
        stations: distance along that lane (n,) [m].
        limits: speed limit of each point (n,) [m/s].
    """

    def __init__(self, pieces: Sequence[Piece]) -> None:
        points = np.concatenate([piece.points for piece in pieces])
        keep = np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > 1e-3))
        self.points = points[keep]
        self.heights = np.concatenate([piece.heights for piece in pieces])[keep]
        self.stations = np.concatenate([piece.stations for piece in pieces])[keep]
        self.lanes = np.concatenate([np.full(len(piece.points), piece.lane) for piece in pieces])[keep]
        self.limits = np.concatenate([np.full(len(piece.points), piece.limit) for piece in pieces])[keep]
        self.manoeuvre = np.concatenate([np.full(len(piece.points), piece.manoeuvre) for piece in pieces])[keep]
        steps = np.diff(self.points, axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        self.s = np.concatenate(([0.0], np.cumsum(lengths)))
        segment = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        middle = (self.s[:-1] + self.s[1:]) / 2
        # headings at the points, from those of the segments at their middles; the ends go on with the curvature
        self.headings = np.interp(self.s, middle, segment)
        if len(segment) > 1:
            self.headings[0] = segment[0] - (segment[1] - segment[0]) * (middle[0] - 0.0) / (middle[1] - middle[0])
            rate = (segment[-1] - segment[-2]) / (middle[-1] - middle[-2])
            self.headings[-1] = segment[-1] + rate * (self.s[-1] - middle[-1])
        self.curvatures = np.gradient(self.headings, self.s)
        self._s = self.s.tolist()
        self._asked, self._answer = math.nan, 0
        self._x, self._y = self.points[:, 0].tolist(), self.points[:, 1].tolist()
        self._headings = self.headings.tolist()

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(self._s[-1])

    def index_at(self, s: float) -> int:
        """Number of the point at or before a distance along the path."""
        if s != self._asked:  # most ask where the car is, one after the other
            self._asked, self._answer = s, min(max(bisect_right(self._s, s) - 1, 0), len(self._s) - 1)
        return self._answer

    def project(self, x: float, y: float, near: float, window: float = 6.0) -> tuple[float, float]:
        """Closest place of the path to a position, looked for around a known place.

        Args:
            x: [m].
            y: [m].
            near: distance along the path close to the answer [m].
            window: how far from `near` to look [m].

        Returns:
            Distance along the path [m], and signed distance from it, positive right [m].
        """
        first = self.index_at(near - window)
        last = min(self.index_at(near + window) + 1, len(self._s) - 1)
        best, answer = math.inf, (near, 0.0)
        for k in range(first, last):
            ax, ay = self._x[k], self._y[k]
            dx, dy = self._x[k + 1] - ax, self._y[k + 1] - ay
            t = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
            # before the first and after the last point the path goes on straight
            if (t < 0.0 and k > 0) or (t > 1.0 and k < len(self._s) - 2):
                t = 0.0 if t < 0.0 else 1.0
            ox, oy = x - ax - t * dx, y - ay - t * dy
            distance = ox * ox + oy * oy
            if distance < best:
                best = distance
                side = 1.0 if dx * oy - dy * ox >= 0 else -1.0
                answer = (self._s[k] + t * (self._s[k + 1] - self._s[k]), side * math.sqrt(distance))
        return answer

    def heading_at(self, s: float) -> float:
        """Direction of the path [rad]."""
        return self._interpolate(self._headings, s)

    def position_at(self, s: float) -> tuple[float, float]:
        """Point of the path [m]."""
        return self._interpolate(self._x, s), self._interpolate(self._y, s)

    def _interpolate(self, values: list[float], s: float) -> float:
        k = min(self.index_at(s), len(self._s) - 2)
        t = (s - self._s[k]) / (self._s[k + 1] - self._s[k])
        t = min(max(t, 0.0), 1.0)
        return float(values[k] + t * (values[k + 1] - values[k]))


def _sample(lane: Lane, stations: Array) -> Array:
    """Points on the centre line (n, 2) [m]."""
    x = np.interp(stations, lane.stations, lane.points[:, 0])
    y = np.interp(stations, lane.stations, lane.points[:, 1])
    return np.column_stack((x, y))


def _heights(lane: Lane, stations: Array) -> Array:
    return np.interp(stations, lane.stations, lane.points[:, 2])
