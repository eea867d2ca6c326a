"""Plane curves of straight lines and circular arcs: exact offsets, cuts and connections, sampled at the end.

Frame of the town: x east, y south, headings clockwise, curvature positive to the right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

Point: TypeAlias = tuple[float, float]
Pose: TypeAlias = tuple[float, float, float]
"""x, y [m], heading [rad]."""

CHORD_ERROR = 0.01
"""Largest distance between a sampled curve and the exact one [m]."""
CURVE_SPACING, LINE_SPACING = 2.0, 20.0
"""Largest distance between samples on arcs and on straights [m]."""
LINE_GUARD = 1.0
"""Distance of the second sample of a straight from its ends [m], so that sampled headings stay exact there."""
CLOSEST = 0.1
"""Smallest distance between samples [m]: rounding errors at joints must not change the direction of the last step."""
_STRAIGHT = 1e-9  # [1/m] smaller curvatures are lines; at 1 km they deviate by 0.5 mm
_SHORTEST_SEGMENT = 1e-6  # [m] shorter segments are omitted


@dataclass(frozen=True, slots=True)
class CurveSegment:
    """Line or arc: start pose [m, m, rad], length [m] and curvature [1/m]."""

    x: float
    y: float
    heading: float
    length: float
    curvature: float = 0.0

    def at(self, s: float) -> Pose:
        """Returns the pose at a distance along the segment [m]."""
        heading = self.heading + self.curvature * s
        if abs(self.curvature) < _STRAIGHT:
            return self.x + s * pm.cos(self.heading), self.y + s * pm.sin(self.heading), heading
        return (
            self.x + (pm.sin(heading) - pm.sin(self.heading)) / self.curvature,
            self.y - (pm.cos(heading) - pm.cos(self.heading)) / self.curvature,
            heading,
        )

    def reversed(self) -> CurveSegment:
        """Returns the segment in the opposite direction."""
        x, y, heading = self.at(self.length)
        return CurveSegment(x, y, heading + math.pi, self.length, -self.curvature)

    def offset(self, right: float) -> CurveSegment:
        """Returns the parallel segment at a distance to the right [m], less than the radius on that side."""
        scale = 1.0 - self.curvature * right
        x = self.x - right * pm.sin(self.heading)
        y = self.y + right * pm.cos(self.heading)
        return CurveSegment(x, y, self.heading, self.length * scale, self.curvature / scale)

    def points(self, s: Array) -> Array:
        """Returns positions (n, 2) [m] at distances (n,) along the segment [m]."""
        if abs(self.curvature) < _STRAIGHT:
            return np.column_stack((self.x + s * pm.cos(self.heading), self.y + s * pm.sin(self.heading)))
        heading = self.heading + self.curvature * s
        x = self.x + (pn.sin(heading) - pm.sin(self.heading)) / self.curvature
        y = self.y - (pn.cos(heading) - pm.cos(self.heading)) / self.curvature
        return np.column_stack((x, y))

    def samples(self, line_spacing: float) -> Array:
        """Returns distances (n,) along the segment [m], both ends included, dense enough for the limits above."""
        if abs(self.curvature) >= _STRAIGHT:
            spacing = min(CURVE_SPACING, math.sqrt(8.0 * CHORD_ERROR / abs(self.curvature)))
            return np.linspace(0.0, self.length, max(3, math.ceil(self.length / spacing) + 1))
        if self.length <= 3.0 * LINE_GUARD:
            return np.array([0.0, self.length / 2.0, self.length])
        inner = self.length - 2.0 * LINE_GUARD
        steps = np.linspace(LINE_GUARD, self.length - LINE_GUARD, math.ceil(inner / line_spacing) + 1)
        return np.concatenate(([0.0], steps, [self.length]))


@dataclass(frozen=True)
class Curve:
    """Sequence of segments, each starting at the end of the previous one with its heading."""

    pieces: tuple[CurveSegment, ...]

    @property
    def length(self) -> float:
        """Length [m]."""
        return sum(piece.length for piece in self.pieces)

    @property
    def start(self) -> Pose:
        """Pose at the start."""
        return self.pieces[0].at(0.0)

    @property
    def end(self) -> Pose:
        """Pose at the end."""
        return self.pieces[-1].at(self.pieces[-1].length)

    @property
    def smallest_radius(self) -> float:
        """Radius of the tightest arc [m], very large without arcs."""
        return 1.0 / max(max((abs(piece.curvature) for piece in self.pieces), default=0.0), 1e-12)

    def part(self, start: float, end: float) -> Curve:
        """Returns the part between two distances along the curve [m]."""
        pieces, begin = [], 0.0
        for piece in self.pieces:
            low, high = max(start - begin, 0.0), min(end - begin, piece.length)
            if high - low > _SHORTEST_SEGMENT:
                pieces.append(CurveSegment(*piece.at(low), high - low, piece.curvature))
            begin += piece.length
        return Curve(tuple(pieces))

    def sample(self, right: float = 0.0, *, line_spacing: float = LINE_SPACING) -> tuple[Array, Array]:
        """Samples the parallel curve at a distance to the right, both ends included.

        Args:
            right: distance [m]; less than all radii on that side.
            line_spacing: largest distance between points on straights [m].

        Returns:
            The points (n, 2) [m], and their distances along this curve (n,) [m].
        """
        points, stations, begin = [], [], 0.0
        for k, piece in enumerate(self.pieces):
            beside = piece.offset(right)
            s = beside.samples(line_spacing)[min(k, 1) :]
            points.append(beside.points(s))
            stations.append(begin + s * (piece.length / beside.length))
            begin += piece.length
        table = np.column_stack((np.concatenate(points), np.concatenate(stations)))
        table = table[_apart(table[:, :2])]
        return table[:, :2], table[:, 2]

    def every(self, spacing: float, right: float = 0.0) -> tuple[Array, Array]:
        """Samples like `sample`, with points at most `spacing` apart on this curve [m]."""
        points, stations, begin = [], [], 0.0
        for piece in self.pieces:
            s = np.linspace(0.0, piece.length, math.ceil(piece.length / spacing) + 1)
            beside = piece.offset(right)
            points.append(beside.points(s * (beside.length / piece.length)))
            stations.append(begin + s)
            begin += piece.length
        return np.concatenate(points), np.concatenate(stations)


def _apart(points: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Returns which points (n, 2) to keep so that only the ends are close to their predecessors (n,)."""
    close = pn.hypot(*np.diff(points, axis=0).T) < CLOSEST
    keep = np.concatenate(([True], ~close))
    keep[-1] = True
    if close[-1] and len(points) > 2:
        keep[-2] = False
    return keep


def line(a: Point, b: Point) -> CurveSegment:
    """Returns the straight from one point to another."""
    return CurveSegment(a[0], a[1], pm.atan2(b[1] - a[1], b[0] - a[0]), pm.dist(a, b))


def turn_at(a: Point, b: Point, c: Point) -> float:
    """Returns the change of heading at the second of three points [rad], positive to the right."""
    return wrap_radians(line(b, c).heading - line(a, b).heading)


def rounded(points: Sequence[Point], radii: Sequence[float]) -> Curve:
    """Returns the polyline through `points` with each inner point replaced by an arc.

    Args:
        points: at least two, no two successive ones equal [m].
        radii: radius of the arc at each inner point [m]; the arcs must fit into the legs.
    """
    pieces: list[CurveSegment] = []
    here = points[0]
    for k, radius in enumerate(radii, start=1):
        turn = turn_at(points[k - 1], points[k], points[k + 1])
        tangent = radius * pm.tan(abs(turn) / 2.0)
        leg = line(here, points[k])
        pieces.append(CurveSegment(leg.x, leg.y, leg.heading, leg.length - tangent))
        x, y, heading = pieces[-1].at(pieces[-1].length)
        pieces.append(CurveSegment(x, y, heading, radius * abs(turn), math.copysign(1.0 / radius, turn)))
        here = pieces[-1].at(pieces[-1].length)[:2]
    pieces.append(line(here, points[-1]))
    return Curve(tuple(piece for piece in pieces if piece.length > _SHORTEST_SEGMENT))


def bend_stations(points: Sequence[Point], radii: Sequence[float]) -> list[float]:
    """Returns the distances of the centres of the bends along the `rounded` polyline [m]."""
    stations, here = list[float](), 0.0
    shortened = 0.0  # the share of the leg that the previous bend uses
    for k, radius in enumerate(radii, start=1):
        turn = abs(turn_at(points[k - 1], points[k], points[k + 1]))
        tangent = radius * pm.tan(turn / 2.0)
        here += pm.dist(points[k - 1], points[k]) - shortened - tangent
        stations.append(here + radius * turn / 2.0)
        here, shortened = here + radius * turn, tangent
    return stations


def connect(entry: Pose, exit_: Pose) -> Curve:
    """Returns a smooth curve between two poses: line-arc-line if it exists, else two arcs.

    Of all curves that turn to one side only, the single arc is the gentlest; two arcs may be gentler, but if there is
    a single arc they first swing out to the other side.
    """
    return _fillet(entry, exit_) or _biarc(entry, exit_)


def _fillet(entry: Pose, exit_: Pose) -> Curve | None:
    """Returns one arc between the lines through both poses if they meet ahead of the first and behind the second."""
    turn = wrap_radians(exit_[2] - entry[2])
    if abs(pm.sin(turn)) < 1e-3:  # as good as parallel
        return None
    dx, dy = exit_[0] - entry[0], exit_[1] - entry[1]
    before = (dx * pm.sin(exit_[2]) - dy * pm.cos(exit_[2])) / pm.sin(turn)
    after = (dy * pm.cos(entry[2]) - dx * pm.sin(entry[2])) / pm.sin(turn)
    if min(before, after) < _SHORTEST_SEGMENT:
        return None
    corner = (entry[0] + before * pm.cos(entry[2]), entry[1] + before * pm.sin(entry[2]))
    radius = min(before, after) / pm.tan(abs(turn) / 2.0)
    return rounded((entry[:2], corner, exit_[:2]), (radius,))


def _biarc(entry: Pose, exit_: Pose) -> Curve:
    """Returns two arcs with equal tangent lengths (Bolton, "Biarc curves", Computer-Aided Design 7(2), 1975)."""
    dx, dy = exit_[0] - entry[0], exit_[1] - entry[1]
    tx, ty, ux, uy = pm.cos(entry[2]), pm.sin(entry[2]), pm.cos(exit_[2]), pm.sin(exit_[2])
    along, bend, square = dx * (tx + ux) + dy * (ty + uy), 2.0 * (1.0 - tx * ux - ty * uy), dx * dx + dy * dy
    if bend < 1e-9:
        tangent = square / (2.0 * along)
    else:
        tangent = (-along + math.sqrt(along * along + bend * square)) / bend
    middle = (
        (entry[0] + exit_[0] + tangent * (tx - ux)) / 2.0,
        (entry[1] + exit_[1] + tangent * (ty - uy)) / 2.0,
    )
    first = _arc_to(entry, middle)
    second = _arc_to(first.at(first.length), exit_[:2])
    return Curve((first, second))


def _arc_to(start: Pose, end: Point) -> CurveSegment:
    """Returns the arc from a pose to a point."""
    chord = line(start[:2], end)
    half = wrap_radians(chord.heading - start[2])
    if abs(half) < 1e-9:
        return CurveSegment(*start, chord.length)
    return CurveSegment(*start, chord.length * half / pm.sin(half), 2.0 * pm.sin(half) / chord.length)
