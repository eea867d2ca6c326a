"""Plan view and profiles of an OpenDRIVE road: from distances along its reference line to positions in the plane.

Everything is in the frame of OpenDRIVE (x east, y NORTH, headings counter-clockwise, lateral positive LEFT); the
compiler mirrors it. Formulas: ASAM OpenDRIVE 1.4, sections 5.3.4 (geometry) and 5.3.5 (elevation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

# 32 Gauss-Legendre nodes integrate cos and sin of the heading to rounding error up to four full turns per element.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)

# Steps of the table of a polynomial's arc length: 1 cm on a 10 m element, interpolated linearly.
_ARC_LENGTH_STEPS = 1000


class Primitive(Protocol):
    """Element of a plan view in the local frame of its start (u ahead, v to the left)."""

    def place(self, distance: Array, length: float) -> tuple[Array, Array, Array]:
        """Returns the pose at distances along the element.

        Args:
            distance: (n,) [m], from 0 to `length`.
            length: length of the element [m].

        Returns:
            u (n,) [m], v (n,) [m] and heading (n,) [rad] relative to the start.
        """
        ...


@dataclass(frozen=True)
class Arc:
    """Constant curvature [1/m], positive left; a line is an arc of curvature 0."""

    curvature: float = 0.0

    def place(self, distance: Array, length: float) -> tuple[Array, Array, Array]:
        """See `Primitive.place`."""
        half = 0.5 * self.curvature * distance
        chord = _chord(distance, half)
        return chord * pn.cos(half), chord * pn.sin(half), 2.0 * half


@dataclass(frozen=True)
class Spiral:
    """Clothoid: curvature [1/m] that changes linearly from `start` to `end`."""

    start: float
    end: float

    def place(self, distance: Array, length: float) -> tuple[Array, Array, Array]:
        """See `Primitive.place`."""
        rate = (self.end - self.start) / length

        def heading(along: Array) -> Array:
            return along * (self.start + 0.5 * rate * along)

        inner = heading(0.5 * distance[:, None] * (_NODES + 1.0))  # (n, nodes)
        u = 0.5 * distance * (pn.cos(inner) * _WEIGHTS).sum(axis=1)
        v = 0.5 * distance * (pn.sin(inner) * _WEIGHTS).sum(axis=1)
        return u, v, heading(distance)


@dataclass(frozen=True)
class Polynomial:
    """Parametric cubic u(p), v(p) with coefficients from the constant term up.

    Attributes:
        u, v: four coefficients each.
        span: p at the end of the element; None where p is the distance itself (`pRange="arcLength"`).
        by_arc_length: whether p ends where the curve is as long as the element (poly3, with p = u).
    """

    u: tuple[float, float, float, float]
    v: tuple[float, float, float, float]
    span: float | None = None
    by_arc_length: bool = False

    def place(self, distance: Array, length: float) -> tuple[Array, Array, Array]:
        """See `Primitive.place`."""
        p = distance if self.span is None else self._parameter(distance, length, self.span)
        slope_u, slope_v = self._slopes(p)
        return _cubic(self.u, p), _cubic(self.v, p), pn.arctan2(slope_v, slope_u)

    def _slopes(self, p: Array) -> tuple[Array, Array]:
        u, v = ((b, 2.0 * c, 3.0 * d, 0.0) for _, b, c, d in (self.u, self.v))
        return _cubic(u, p), _cubic(v, p)

    def _parameter(self, distance: Array, length: float, span: float) -> Array:
        """Returns the parameters at distances along the curve, by inverting its tabulated arc length."""
        grid = np.linspace(0.0, span, 2 * _ARC_LENGTH_STEPS + 1)
        speed = pn.hypot(*self._slopes(grid))
        steps = (speed[:-2:2] + 4.0 * speed[1::2] + speed[2::2]) * (grid[2] / 6.0)
        along = np.concatenate(([0.0], np.cumsum(steps)))
        # a normalised element has the length of its attribute: rounding must not open a gap at its end
        reach = distance if self.by_arc_length else distance * (along[-1] / length)
        return np.interp(reach, along, grid[::2])


def _cubic(coefficients: tuple[float, float, float, float], p: Array) -> Array:
    a, b, c, d = coefficients
    return a + p * (b + p * (c + p * d))


def _chord(distance: Array, half: Array) -> Array:
    """Returns the chords (n,) of arcs of lengths (n,) [m] that turn by twice the angles (n,) [rad]."""
    turned = np.where(half == 0.0, 1.0, half)
    return np.where(half == 0.0, distance, distance * pn.sin(turned) / turned)


def poly3(a: float, b: float, c: float, d: float, length: float) -> Polynomial:
    """Returns the element v(u) = a + b u + c u^2 + d u^3; u is at most the length of the element."""
    return Polynomial((0.0, 1.0, 0.0, 0.0), (a, b, c, d), span=length, by_arc_length=True)


class ReferenceLine:
    """Plan view of a road as a sequence of elements.

    Args:
        starts: (n, 5) rows of s [m], x [m], y [m], heading [rad] and length [m], in order of s.
        primitives: n elements.
    """

    def __init__(self, starts: Array, primitives: Sequence[Primitive]) -> None:
        self.starts = starts
        self.primitives = tuple(primitives)
        self._curvature = np.array([p.curvature if isinstance(p, Arc) else np.nan for p in primitives])

    def place(self, s: Array, pick: Array | None = None) -> tuple[Array, Array, Array]:
        """Returns the pose of the reference line.

        Args:
            s: distance along the road (n,) [m].
            pick: distances that select the element (n,) [m]; `s` by default.

        Returns:
            x (n,) [m], y (n,) [m], heading (n,) [rad].
        """
        index = _holding(self.starts[:, 0], s if pick is None else pick)
        origin = self.starts[index]
        distance = s - origin[:, 0]
        u, v, turned = Arc().place(distance, 0.0)
        curvature = self._curvature[index]
        round_ = ~np.isnan(curvature)
        half = 0.5 * curvature[round_] * distance[round_]
        chord = _chord(distance[round_], half)
        u[round_], v[round_], turned[round_] = chord * pn.cos(half), chord * pn.sin(half), 2.0 * half
        for k in np.unique(index[~round_]):
            here = index == k
            u[here], v[here], turned[here] = self.primitives[k].place(distance[here], float(self.starts[k, 4]))
        c, n = pn.cos(origin[:, 3]), pn.sin(origin[:, 3])
        return origin[:, 1] + u * c - v * n, origin[:, 2] + u * n + v * c, origin[:, 3] + turned


class Cubics:
    """Profile along a road: a + b ds + c ds^2 + d ds^3 piece by piece (elevation, lane offset, lane width).

    Args:
        rows: (n, 5) rows of start [m], a, b, c, d, in order of start; n = 0 gives 0 everywhere.
    """

    def __init__(self, rows: Array) -> None:
        self.rows = rows
        if len(rows) == 1:  # most profiles
            self._simple = not rows[0, 2:].any()
        else:
            self._simple = len(rows) == 0 or (not rows[:, 2:].any() and bool(np.all(rows[:, 1] == rows[0, 1])))

    def at(self, s: Array, pick: Array | None = None) -> Array:
        """Returns the values (n,) at distances (n,) [m]; `pick` as in `ReferenceLine.place`."""
        if self._simple:
            return np.full(len(s), self.rows[0, 1] if len(self.rows) else 0.0)
        row = self.rows[_holding(self.rows[:, 0], s if pick is None else pick)]
        ds = s - row[:, 0]
        value: Array = row[:, 1] + ds * (row[:, 2] + ds * (row[:, 3] + ds * row[:, 4]))
        return value


NO_CUBICS = Cubics(np.empty((0, 5)))
"""Profile that is 0 everywhere, for profiles missing in a file."""


def _holding(starts: Array, s: Array) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Returns the index of the piece at each s: the last one that starts at or before it."""
    index: np.ndarray[tuple[int], np.dtype[np.intp]] = np.searchsorted(starts, s, side="right") - 1
    return np.maximum(index, 0)
