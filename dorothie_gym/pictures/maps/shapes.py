"""Polygons in world coordinates (outlines of lanes, strokes, discs, dashes), and samples of all lanes of a town."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array, Lane
from dorothie_gym.pictures.palette import Colour
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town


@dataclass(frozen=True, eq=False)
class Shape:
    """Filled polygon: corners (n, 2) [m], colour, and for road markings the height of the road [m]."""

    points: Array
    colour: Colour
    height: float = 0.0

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, y and largest x, y [m]."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def right_of(headings: Array) -> Array:
    """Returns unit vectors (n, 2) to the right of headings (n,) [rad]."""
    return np.stack((-pn.sin(headings), pn.cos(headings)), axis=-1)


def sample(lane: Lane, start: float, end: float, step: float) -> Array:
    """Returns stations (n,) [m] from start to end, both included, at most a step apart; n >= 2."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / step)) + 1))


def side_line(lane: Lane, stations: Array, lateral: Array | float) -> Array:
    """Returns points (n, 2) [m] at stations (n,) along a lane and `lateral` (n,) [m] to its right."""
    headings = np.interp(stations, lane.stations, lane.headings)
    x = np.interp(stations, lane.stations, lane.points[:, 0])
    y = np.interp(stations, lane.stations, lane.points[:, 1])
    return np.stack((x, y), axis=-1) + np.broadcast_to(lateral, stations.shape)[:, None] * right_of(headings)


def widths_at(lane: Lane, stations: Array) -> Array:
    """Returns the widths (n,) [m] of a lane at stations (n,)."""
    return np.asarray(np.interp(stations, lane.stations, lane.widths))


def sparse_stations(lane: Lane, start: float = 0.0, end: float | None = None) -> Array:
    """Returns stations (n,) sufficient to draw a lane: dense where it bends or widens, sparse where it is straight."""
    end = lane.length if end is None else end
    fine = sample(lane, start, end, 1.0)
    headings = np.interp(fine, lane.stations, lane.headings)
    widths = widths_at(lane, fine)
    # 1.5 degrees of turning, 0.1 m of width or 40 m, whichever comes first
    amount = np.abs(np.diff(headings)) / 0.026 + np.abs(np.diff(widths)) / 0.1 + np.diff(fine) / 40.0
    total = np.concatenate(([0.0], np.cumsum(amount)))
    keep = np.flatnonzero(np.diff(np.floor(total)) > 0) + 1
    return np.asarray(fine[np.unique(np.concatenate(([0], keep, [len(fine) - 1])))])


def ribbon(lane: Lane, margin: float = 0.0, start: float = 0.0, end: float | None = None) -> Array:
    """Returns the outline (n, 2) [m] of a lane or a part of it, widened by a margin on both sides."""
    stations = sparse_stations(lane, start, end)
    half = widths_at(lane, stations) / 2.0 + margin
    return np.concatenate((side_line(lane, stations, half), side_line(lane, stations, -half)[::-1]))


def disc(centre: Sequence[float] | Array, radius: float, corners: int = 20) -> Array:
    """Returns a circle (corners, 2) [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    return np.asarray(centre, dtype=float)[:2] + radius * np.stack((pn.cos(angles), pn.sin(angles)), axis=-1)


def stroke(line: Array, width: float) -> Array:
    """Returns the outline of a line (n, 2) [m] with a width [m] and butt ends."""
    steps = np.diff(line, axis=0)
    if len(steps) == 1:  # most strokes are straight
        (along, aside), length = steps[0], pm.hypot(*steps[0])
        side = np.array([-aside, along]) * (width / 2.0 / length if length > 0.0 else 0.0)
        return np.stack((line[0] + side, line[1] + side, line[1] - side, line[0] - side))
    angle = np.unwrap(pn.arctan2(steps[:, 1], steps[:, 0]))
    headings = np.concatenate((angle[:1], (angle[:-1] + angle[1:]) / 2.0, angle[-1:]))
    side = right_of(headings) * width / 2.0
    return np.concatenate((line + side, (line - side)[::-1]))


def polyline_stations(line: Array) -> Array:
    """Returns the distances (n,) [m] from the start of a line (n, k) to its points, in the plane."""
    return np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(line[:, :2], axis=0).T))))


def polyline_length(line: Array) -> float:
    """Returns the length [m] of a line (n, k) in the plane."""
    return float(pn.hypot(*np.diff(line[:, :2], axis=0).T).sum())


def cut(line: Array, pieces: Sequence[tuple[float, float]], step: float = 2.0) -> list[Array]:
    """Returns parts (n, k) of a line (m, k) between pairs of distances along it [m]."""
    stations = polyline_stations(line)
    parts = []
    for start, end in pieces:
        s = np.linspace(start, end, max(2, int(np.ceil((end - start) / step)) + 1))
        parts.append(np.stack([np.interp(s, stations, column) for column in line.T], axis=-1))
    return parts


def dash_pattern(total: float, dash: float, gap: float) -> list[tuple[float, float]]:
    """Returns start and end of each dash along a line of a length [m]; the line begins and ends with half a gap."""
    if total < dash:
        return []
    count = max(1, round(total / (dash + gap)))
    period = total / count
    share = dash / (dash + gap) * period
    return [(k * period + (period - share) / 2.0, k * period + (period + share) / 2.0) for k in range(count)]


def place(points: Array, origin: Array, heading: float) -> Array:
    """Transforms points (forward, right) (n, 2) [m] relative to a pose into world coordinates (n, 2)."""
    forward = np.array([pn.cos(heading), pn.sin(heading)])
    right = np.array([-pn.sin(heading), pn.cos(heading)])
    return np.asarray(origin + points[:, :1] * forward + points[:, 1:] * right)


def zebra(outline: Array, bar: float = 0.5, gap: float = 0.55) -> list[Array]:
    """Returns the bars of a crosswalk, across its long axis; the outline is a convex polygon (n, 2) [m]."""
    corners = outline[:-1] if np.allclose(outline[0], outline[-1]) else outline
    centre = corners.mean(axis=0)
    edges = np.roll(corners, -1, axis=0) - corners
    longest = edges[int(np.argmax(pn.hypot(*edges.T)))]
    along = longest / pn.hypot(*longest)
    across = np.array([-along[1], along[0]])
    u, v = pn.dot(corners - centre, along), pn.dot(corners - centre, across)
    start, end, half = u.min() + gap / 2, u.max() - gap / 2, (v.max() - v.min()) / 2.0
    count = max(1, int((end - start + gap) // (bar + gap)))
    period = (end - start + gap) / count
    bars = []
    for k in range(count):
        a = start + k * period
        quad = np.array([[a, -half], [a + bar, -half], [a + bar, half], [a, half]])
        bars.append(centre + quad[:, :1] * along + quad[:, 1:] * across)
    return bars


def strokes(line: Array, width: float, segments: int = 8) -> Iterator[Array]:
    """Yields outlines of short parts of a line (n, 2) [m]: a single polygon that crosses itself would have holes."""
    for k in range(0, len(line) - 1, segments):
        yield stroke(line[k : k + segments + 1], width)


def simplified(line: Array, tolerance: float) -> Array:
    """Simplifies a line (n, 2) with the algorithm of Douglas and Peucker.

    Omitted points are at most `tolerance` from the straight line through the ends of their part.
    """
    keep = np.zeros(len(line), dtype=bool)
    keep[[0, -1]] = True
    todo = [(0, len(line) - 1)]
    while todo:
        a, b = todo.pop()
        if b - a < 2:
            continue
        along = line[b] - line[a]
        offset = line[a + 1 : b] - line[a]
        length = float(pn.hypot(*along))
        if length < 1e-9:
            away = pn.hypot(*offset.T)
        else:
            away = np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]) / length
        far = int(np.argmax(away))
        if away[far] > tolerance:
            middle = a + 1 + far
            keep[middle] = True
            todo += [(a, middle), (middle, b)]
    return np.asarray(line[keep])


def longer(path: Array, more: float) -> Array:
    """Extends a path (n, 2) straight at both ends by a length."""
    first, last = path[0] - path[1], path[-1] - path[-2]
    ends = path[0] + first / pn.hypot(*first) * more, path[-1] + last / pn.hypot(*last) * more
    return np.concatenate((ends[0][None], path, ends[1][None]))


# --- Samples of all lanes --------------------------------------------------------------------------------------------

SAMPLE_STEP = 2.0  # [m] between samples, at most


@dataclass(frozen=True, eq=False)
class TownSamples:
    """Samples of all lanes, lane by lane in driving direction.

    Attributes:
        lane: id of the lane (n,).
        station: distance along it (n,) [m].
        heading: (n,) [rad].
        half_width: half width of the lane (n,) [m].
        centre: position on the centre line (n, 3) [m].
        bounds: range of samples of each lane (lanes, 2), end excluded.
    """

    lane: NDArray[np.int64]
    station: Array
    heading: Array
    half_width: Array
    centre: Array
    bounds: NDArray[np.int64]

    @classmethod
    def of(cls, town: Town) -> TownSamples:
        """Samples every lane of a town at most every two metres, both ends included."""
        columns: list[list[Array]] = [[], [], [], []]
        owners, bounds, count = [], [], 0
        for lane in town.lanes:
            s = sample(lane, 0.0, lane.length, SAMPLE_STEP)
            xyz = np.column_stack((side_line(lane, s, 0.0), np.interp(s, lane.stations, lane.points[:, 2])))
            heading = np.interp(s, lane.stations, lane.headings)
            for column, value in zip(columns, (s, heading, widths_at(lane, s) / 2.0, xyz), strict=True):
                column.append(value)
            owners.append(np.full(len(s), lane.id, dtype=np.int64))
            bounds.append((count, count + len(s)))
            count += len(s)
        station, heading, half, centre = (np.concatenate(column) for column in columns)
        return cls(np.concatenate(owners), station, heading, half, centre, np.array(bounds, dtype=np.int64))

    def edge(self, sign: float) -> Array:
        """Returns the points (n, 2) [m] on the right (+1) or left (-1) edges."""
        return np.asarray(self.centre[:, :2] + sign * self.half_width[:, None] * right_of(self.heading))

    def of_lanes(self, wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Returns the indices of the samples of the selected lanes (lanes,)."""
        return np.flatnonzero(wanted[self.lane])
