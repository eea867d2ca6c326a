"""Plan view for a given line: straights, arcs and parametric cubics through its points."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import Lane
from dorothie_gym.maps.opendrive.geometry import Arc, Polynomial, Primitive, ReferenceLine
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

# Largest distance of the points of the line from the plan view, and of the middles between them [m]. The points of a
# town lie on a curve, and the middles of their chords up to 10 mm inside of it.
_POINT_ERROR, _MIDDLE_ERROR = 0.001, 0.0115

# A line whose chords are farther inside of its curve than this is moved inwards by a share of the rest, up to a limit
# [m]: the reader draws chords of its own, those of sharp bends as short as these.
_INSIDE, _MOVED, _FARTHEST, _SHORT = 0.004, 0.4, 0.0025, 0.5

# Largest change of direction of an arc, and of a parametric cubic [rad].
_WIDEST_ARC, _WIDEST_CUBIC = 2.5, 1.2

# Largest difference between the angles at both ends of a chord for which an arc is drawn, within a line and at its
# ends, where lanes far aside must end at one place [rad].
_ARC_SKEW, _END_SKEW = 0.002, 1e-5

# Angles between chord and line [rad], and distances between them [m], below which an element is straight; and the
# smallest change of direction of an arc [rad]. Others compute the centres of arcs in single precision.
_STRAIGHT, _STRAIGHT_ERROR, _FLATTEST = 1e-4, 0.0005, 1e-4

# Most points of one element, and distance between the samples of an axis [m].
_LONGEST, _STEP = 256, 0.5

# Steps of the projection on an axis, and distance at which it has converged [m].
_ITERATIONS, _CONVERGED = 30, 1e-9

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)


class Axis:
    """Line of a road or lane with its distances, in the frame of OpenDRIVE (y north, lateral positive LEFT).

    Args:
        points: points (n, 2) of the line [m], n >= 2.
        ends: directions at both ends [rad]; None for those of the points.

    Attributes:
        line: elements of the plan view.
        length: [m].
    """

    def __init__(self, points: Array, ends: tuple[float | None, float | None] = (None, None)) -> None:
        self.line = fit_plan_view(points, ends)
        self.length = float(self.line.starts[-1, 0] + self.line.starts[-1, 4])
        count = max(3, math.ceil(self.length / _STEP) + 1)
        self._stations = np.linspace(0.0, self.length, count)
        x, y, heading = self.line.place(self._stations)
        heading = np.unwrap(heading)
        self._curvature = np.gradient(heading, self._stations)
        self._tree = cKDTree(np.column_stack((x, y)))
        self._is_ring = bool(pn.hypot(x[0] - x[-1], y[0] - y[-1]) < _STEP)

    def place(self, stations: Array) -> Array:
        """Returns x, y and heading (n, 3) at distances (n,) along the line [m, rad]."""
        return np.column_stack(self.line.place(stations))

    def project(self, points: Array) -> tuple[Array, Array, Array]:
        """Returns the coordinates of points (n, 2) of a line beside it.

        Returns:
            Distance along the axis (n,), between 0 and its length, distance to the LEFT of it (n,), and the distance
            ahead of (or, negative, behind) the place at that distance (n,), which is 0 but beyond its ends [m].
        """
        station = self._stations[self._tree.query(points)[1]]
        if self._is_ring and len(points) > 2:  # the ends are at one place
            away = 0.5 * self.length
            forward = station[len(points) // 2] > station[1] if station[1] != station[-2] else True
            station[0] = _end(station[0], 0.0 if forward else self.length, away)
            station[-1] = _end(station[-1], self.length if forward else 0.0, away)
        for _ in range(_ITERATIONS):
            ahead, aside = self._local(points, station)
            curvature = np.interp(station, self._stations, self._curvature)
            step = ahead / np.maximum(1.0 - curvature * aside, 0.2)
            moved = np.clip(station + step, 0.0, self.length)
            done = float(np.max(np.abs(moved - station))) < _CONVERGED
            station = moved
            if done:
                break
        ahead, aside = self._local(points, station)
        return station, aside, ahead

    def shortening(self, stations: Array, aside: Array) -> float:
        """Returns the smallest length of a line relative to that of the axis beside it, negative where it runs back.

        Args:
            stations: distances along the axis (n,), ascending [m].
            aside: distances of the line to the LEFT of the axis there (n,) [m].
        """
        beside = (self._stations >= stations[0]) & (self._stations <= stations[-1])
        away = np.interp(self._stations[beside], stations, aside)
        return float(np.min(1.0 - self._curvature[beside] * away, initial=1.0))

    def _local(self, points: Array, station: Array) -> tuple[Array, Array]:
        x, y, heading = self.line.place(station)
        dx, dy = points[:, 0] - x, points[:, 1] - y
        c, n = pn.cos(heading), pn.sin(heading)
        return dx * c + dy * n, dy * c - dx * n


def _end(station: float, end: float, away: float) -> float:
    return end if abs(station - end) > away else station


def fit_plan_view(points: Array, ends: tuple[float | None, float | None] = (None, None)) -> ReferenceLine:
    """Returns straights, arcs and parametric cubics through the points (n, 2) of a line [m].

    An element is as long as the points allow; a line that turns in a point has straights there.

    Args:
        points: the points.
        ends: directions at both ends [rad]; None for those of the points.
    """
    points, headings = _moved_inwards(points)
    for k, end in zip((0, -1), ends, strict=True):
        if end is not None:
            headings[k] = end
    rows, primitives, k, station = [], [], 0, 0.0
    while k < len(points) - 1:
        last, found = _longest(points, headings, k)
        heading, length, primitive = found
        rows.append([station, points[k, 0], points[k, 1], heading, length])
        primitives.append(primitive)
        k, station = last, station + length
    return ReferenceLine(np.array(rows), primitives)


def _moved_inwards(points: Array) -> tuple[Array, Array]:
    """Returns the points (n, 2) between the chords and the curve that they approximate, and the headings (n,)."""
    flat = np.column_stack((points, np.zeros(len(points))))
    headings = Lane(id=0, road_id=0, lane_id=0, points=flat, widths=flat[:, 2], speed_limit=0.0).headings
    step = pn.hypot(*np.diff(points, axis=0).T)
    inside = np.where(step > _SHORT, np.diff(headings) * step / 8.0, 0.0)  # of each chord, signed
    mean = np.concatenate(([0.0], 0.5 * (inside[1:] + inside[:-1]), [0.0]))  # the ends stay
    aside = np.sign(mean) * np.clip(_MOVED * (np.abs(mean) - _INSIDE), 0.0, _FARTHEST)
    return points + aside[:, None] * np.column_stack((-pn.sin(headings), pn.cos(headings))), headings


_Element = tuple[float, float, Primitive]  # heading at its start [rad], length [m], shape


def _longest(points: Array, headings: Array, first: int) -> tuple[int, _Element]:
    """Returns the last point of the longest element from a point, and the element."""
    most = min(len(points) - 1 - first, _LONGEST)
    count, found = 1, _element(points, headings, first, first + 1) or _straight(points, first)
    step = 1
    while step:
        more = _element(points, headings, first, first + count + step) if count + step <= most else None
        if more is not None:
            count, found, step = count + step, more, 2 * step
        else:
            step //= 2
    return first + count, found


def _straight(points: Array, first: int) -> _Element:
    dx, dy = (float(v) for v in points[first + 1] - points[first])
    return pm.atan2(dy, dx), pm.hypot(dx, dy), Arc()


def _element(points: Array, headings: Array, first: int, last: int) -> _Element | None:
    """Returns the element between two points, or None if it would not pass those between."""
    dx, dy = (float(v) for v in points[last] - points[first])
    chord, way = pm.hypot(dx, dy), pm.atan2(dy, dx)
    begin, end = (math.remainder(float(headings[k]) - way, math.tau) for k in (first, last))
    turn = end - begin
    c, n = dx / chord, dy / chord
    rel = points[first : last + 1] - points[first]
    u, v = rel[:, 0] * c + rel[:, 1] * n, rel[:, 1] * c - rel[:, 0] * n
    if np.any(np.diff(u) <= 0.0):
        return None
    if max(abs(begin), abs(end)) < _STRAIGHT and float(np.max(np.abs(v))) < _STRAIGHT_ERROR:
        return way, chord, Arc()
    skew = _END_SKEW if first == 0 or last == len(points) - 1 else _ARC_SKEW
    if abs(begin + end) < skew and abs(turn) < _WIDEST_ARC:
        if abs(turn) < _FLATTEST:
            return None
        radius = 0.5 * chord / pm.sin(0.5 * turn)  # signed, positive for a turn to the left
        on_arc = _arc_aside(u, chord, radius, turn)
        middles = 0.5 * (u[1:] + u[:-1])
        if _within(v, on_arc) and _near(u, v, middles, _arc_aside(middles, chord, radius, turn)):
            return way - 0.5 * turn, radius * turn, Arc(1.0 / radius)
    return _cubic(u, v, (chord, way, begin, turn))


def _arc_aside(u: Array, chord: float, radius: float, turn: float) -> Array:
    root = np.sqrt(np.maximum(radius * radius - (u - 0.5 * chord) ** 2, 0.0))
    return radius * pm.cos(0.5 * turn) - math.copysign(1.0, radius) * root


def _cubic(u: Array, v: Array, shape: tuple[float, float, float, float]) -> _Element | None:
    """Returns the parametric cubic with given directions at its ends.

    Args:
        u: points along the chord (n,) [m].
        v: the same points across it (n,) [m].
        shape: length [m] and direction of the chord, and, relative to it, the direction at the start, and the turn.
    """
    chord, way, begin, turn = shape
    if max(abs(begin), abs(turn), abs(begin + turn)) > _WIDEST_CUBIC:
        return None
    half = 0.5 * abs(turn)
    speed = chord if half < 1e-4 else 2.0 * chord * pm.tan(0.5 * half) / pm.sin(half)  # that of an arc
    end = np.array((chord * pm.cos(begin), -chord * pm.sin(begin)))  # in the frame of the first direction
    first, last = np.array((speed, 0.0)), speed * np.array((pm.cos(turn), pm.sin(turn)))
    c, d = 3.0 * end - 2.0 * first - last, first + last - 2.0 * end
    p = np.linspace(0.0, 1.0, 24 * len(u) + 1)[:, None]
    along = p * (first + p * (c + p * d))
    x = along[:, 0] * pm.cos(begin) - along[:, 1] * pm.sin(begin)
    y = along[:, 0] * pm.sin(begin) + along[:, 1] * pm.cos(begin)
    if np.any(np.diff(x) <= 0.0) or not _fits(u, v, x, y):
        return None
    q = 0.5 * (_NODES[:, None] + 1.0)
    slope = first + q * (2.0 * c + 3.0 * q * d)
    length = 0.5 * float((pn.hypot(slope[:, 0], slope[:, 1]) * _WEIGHTS).sum())
    rows = [(0.0, float(first[k]), float(c[k]), float(d[k])) for k in (0, 1)]
    return way + begin, length, Polynomial(rows[0], rows[1], span=1.0)


def _fits(u: Array, v: Array, x: Array, y: Array) -> bool:
    """Returns whether a curve (x, y) passes points (u, v) and the middles between them."""
    middles = 0.5 * (u[1:] + u[:-1])
    return _within(v, np.interp(u, x, y)) and _near(u, v, middles, np.interp(middles, x, y))


def _within(v: Array, curve: Array) -> bool:
    return float(np.max(np.abs(v - curve))) <= _POINT_ERROR


def _near(u: Array, v: Array, middles: Array, curve: Array) -> bool:
    return float(np.max(np.abs(np.interp(middles, u, v) - curve))) <= _MIDDLE_ERROR
