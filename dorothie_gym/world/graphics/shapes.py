"""Polygons in world coordinates: outlines of lanes, strokes, discs, dashes, arrows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dorothie_gym.world.graphics.palette import Colour
from dorothie_gym.world.town.model import Array, Lane, LinkType


@dataclass(frozen=True, eq=False)
class Shape:
    """A filled polygon: its corners (n, 2) [m] and its colour."""

    points: Array
    colour: Colour

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, y and largest x, y [m]."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def right_of(headings: Array) -> Array:
    """Unit vectors (n, 2) to the right of headings (n,) [rad]."""
    return np.stack((-np.sin(headings), np.cos(headings)), axis=-1)


def sample(lane: Lane, start: float, end: float, step: float) -> Array:
    """Stations (n,) [m] from start to end, both included, at most a step apart; n >= 2."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / step)) + 1))


def side_line(lane: Lane, stations: Array, lateral: Array | float) -> Array:
    """Points (n, 2) [m] at stations (n,) along a lane, `lateral` (n,) [m] to its right."""
    headings = np.interp(stations, lane.stations, lane.headings)
    x = np.interp(stations, lane.stations, lane.points[:, 0])
    y = np.interp(stations, lane.stations, lane.points[:, 1])
    return np.stack((x, y), axis=-1) + np.broadcast_to(lateral, stations.shape)[:, None] * right_of(headings)


def widths_at(lane: Lane, stations: Array) -> Array:
    """Widths (n,) [m] of a lane at stations (n,)."""
    return np.asarray(np.interp(stations, lane.stations, lane.widths))


def sparse_stations(lane: Lane, start: float = 0.0, end: float | None = None) -> Array:
    """Stations (n,) that suffice to draw a lane: more where it bends or widens, few where it is straight."""
    end = lane.length if end is None else end
    fine = sample(lane, start, end, 1.0)
    headings = np.interp(fine, lane.stations, lane.headings)
    widths = widths_at(lane, fine)
    # A degree and a half of turning, a decimetre of width or 40 m, whichever comes first.
    amount = np.abs(np.diff(headings)) / 0.026 + np.abs(np.diff(widths)) / 0.1 + np.diff(fine) / 40.0
    total = np.concatenate(([0.0], np.cumsum(amount)))
    keep = np.flatnonzero(np.diff(np.floor(total)) > 0) + 1
    return np.asarray(fine[np.unique(np.concatenate(([0], keep, [len(fine) - 1])))])


def ribbon(lane: Lane, margin: float = 0.0, start: float = 0.0, end: float | None = None) -> Array:
    """Outline (n, 2) [m] of a lane, or of a stretch of it, widened by a margin on both sides."""
    stations = sparse_stations(lane, start, end)
    half = widths_at(lane, stations) / 2.0 + margin
    return np.concatenate((side_line(lane, stations, half), side_line(lane, stations, -half)[::-1]))


def disc(centre: Sequence[float] | Array, radius: float, corners: int = 20) -> Array:
    """A circle (corners, 2) [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    return np.asarray(centre, dtype=float)[:2] + radius * np.stack((np.cos(angles), np.sin(angles)), axis=-1)


def stroke(line: Array, width: float) -> Array:
    """Outline of a line (n, 2) [m] drawn with a pen of a width [m] and butt ends."""
    steps = np.diff(line, axis=0)
    angle = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    headings = np.concatenate((angle[:1], (angle[:-1] + angle[1:]) / 2.0, angle[-1:]))
    side = right_of(headings) * width / 2.0
    return np.concatenate((line + side, (line - side)[::-1]))


def dashes(line: Array, width: float, dash: float, gap: float) -> list[Array]:
    """Outlines of the dashes [m] along a line (n, 2), cut so that it starts and ends with a half dash."""
    lengths = np.hypot(*np.diff(line, axis=0).T)
    stations = np.concatenate(([0.0], np.cumsum(lengths)))
    total = float(stations[-1])
    if total < dash:
        return []
    count = max(1, round(total / (dash + gap)))
    period = total / count
    share = dash / (dash + gap) * period
    out = []
    for k in range(count):
        s = np.array([0.0, 0.5, 1.0]) * share + k * period + (period - share) / 2.0
        points = np.stack((np.interp(s, stations, line[:, 0]), np.interp(s, stations, line[:, 1])), axis=-1)
        out.append(stroke(points, width))
    return out


def place(points: Array, origin: Array, heading: float) -> Array:
    """Points given as (forward, right) [m] seen from an origin with a heading, in world coordinates (n, 2)."""
    forward = np.array([np.cos(heading), np.sin(heading)])
    right = np.array([-np.sin(heading), np.cos(heading)])
    return np.asarray(origin + points[:, :1] * forward + points[:, 1:] * right)


_SHAFT = {
    LinkType.STRAIGHT: np.array([[0.0, 0.0], [3.2, 0.0]]),
    LinkType.LEFT: np.array([[0.0, 0.0], [1.5, 0.0], [2.1, -0.12], [2.4, -0.45], [2.5, -0.7]]),
    LinkType.U_TURN: np.array([[0.0, 0.0], [2.2, 0.0], [2.6, -0.3], [2.6, -0.7], [2.2, -0.95], [1.7, -0.95]]),
}
_HEAD = {
    LinkType.STRAIGHT: np.array([[3.0, -0.7], [3.0, 0.7], [5.0, 0.0]]),
    LinkType.LEFT: np.array([[1.7, -0.6], [3.3, -0.6], [2.5, -1.65]]),
    LinkType.U_TURN: np.array([[1.8, -1.45], [1.8, -0.45], [0.6, -0.95]]),
}
_MIRROR = np.array([1.0, -1.0])


def turn_arrow(kinds: Sequence[LinkType], origin: Array, heading: float, pen: float = 0.4) -> list[Array]:
    """Outlines of the arrow painted on a lane that may be left in these ways; its tail is at the origin."""
    out = []
    for kind in kinds:
        mirrored = kind is LinkType.RIGHT
        base = LinkType.LEFT if mirrored else kind
        if base not in _SHAFT:
            continue
        shaft, head = _SHAFT[base], _HEAD[base]
        if mirrored:
            shaft, head = shaft * _MIRROR, head * _MIRROR
        out += [place(stroke(shaft, pen), origin, heading), place(head, origin, heading)]
    return out


def zebra(outline: Array, bar: float = 0.5, gap: float = 0.55) -> list[Array]:
    """Bars of a marked crossing, across its long axis; the outline is any convex polygon (n, 2) [m]."""
    corners = outline[:-1] if np.allclose(outline[0], outline[-1]) else outline
    centre = corners.mean(axis=0)
    edges = np.roll(corners, -1, axis=0) - corners
    longest = edges[int(np.argmax(np.hypot(*edges.T)))]
    along = longest / np.hypot(*longest)
    across = np.array([-along[1], along[0]])
    u, v = (corners - centre) @ along, (corners - centre) @ across
    start, end, half = u.min() + gap / 2, u.max() - gap / 2, (v.max() - v.min()) / 2.0
    count = max(1, int((end - start + gap) // (bar + gap)))
    period = (end - start + gap) / count
    bars = []
    for k in range(count):
        a = start + k * period
        quad = np.array([[a, -half], [a + bar, -half], [a + bar, half], [a, half]])
        bars.append(centre + quad[:, :1] * along + quad[:, 1:] * across)
    return bars
