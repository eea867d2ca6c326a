"""Lane sections of a road: numbers and widths of its lanes, of the gaps between them, and the offset of lane 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.opendrive.strands import Strand

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.road_layout import RoadLayout

# Largest error of the edges of lanes, and of the height of a level road [m].
_EDGE_ERROR, _HEIGHT_ERROR = 0.001, 0.001

# Largest distance of a height profile from the chords between its points [m].
_HEIGHT_BEND = 0.004

# Largest distance of the lanes of an axis from it, more than that of the nearest [m].
_ON_AXIS = 0.01

# Gaps between lanes up to this width belong to the lanes [m].
_SMALLEST_GAP = 0.05

# Smallest distance between places where widths are given [m].
_STEP = 0.2


@dataclass(frozen=True, kw_only=True, eq=False)
class SectionLane:
    """Lane of a lane section.

    Attributes:
        number: its number; negative to the right of the reference line.
        strand: what it is; None for a gap between lanes.
        widths: rows of offset from the start of the section, width [m] and slope (n, 3).
    """

    number: int
    strand: Strand | None
    widths: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class CrossSection:
    """Lane section.

    Attributes:
        start, end: distances along the road [m].
        offset: rows of distance along the road, lateral offset of lane 0 [m] and slope (n, 3).
        lanes: lanes from left to right, lane 0 excepted.
    """

    start: float
    end: float
    offset: Array
    lanes: tuple[SectionLane, ...]

    def number(self, strand: Strand) -> int:
        """Returns the number of a lane or sidewalk of the section."""
        return next(lane.number for lane in self.lanes if lane.strand is strand)


def cross_sections(
    road: RoadLayout, changes: frozenset[tuple[int, int]], *, keeps_left: bool
) -> tuple[CrossSection, ...]:
    """Returns the lane sections of a road; a new one begins wherever a lane or sidewalk begins or ends.

    Args:
        road: the road.
        changes: pairs of lanes with a lane change from the first to the second.
        keeps_left: whether traffic keeps to the left.
    """
    return tuple(_section(road, span, changes, keeps_left) for span in pairwise(road.edges))


def height_rows(road: RoadLayout) -> Array:
    """Returns rows of distance along a road, height [m] and three coefficients (n, 5): cubics through its points."""
    away = [float(np.max(np.abs(strand.aside))) for strand in road.strands]
    lanes = [strand for strand, most in zip(road.strands, away, strict=True) if most <= min(away) + _ON_AXIS]
    points = np.concatenate([np.column_stack((s.stations, s.heights))[s.given] for s in lanes])
    points = points[np.argsort(points[:, 0], kind="stable")]
    points = points[np.concatenate(([True], np.diff(points[:, 0]) > _STEP))]
    points[0, 0] = 0.0
    if len(points) < 2 or np.ptp(points[:, 1]) < _HEIGHT_ERROR:
        return np.array([[0.0, points[0, 1], 0.0, 0.0, 0.0]])
    s, z = points.T
    steps = np.diff(s)
    rise = np.diff(z) / steps
    inner = (rise[:-1] * steps[1:] + rise[1:] * steps[:-1]) / (steps[:-1] + steps[1:])  # exact on a parabola
    slopes = np.concatenate((rise[:1], inner, rise[-1:]))
    first, last = slopes[:-1] - rise, slopes[1:] - rise  # relative to the chords
    p = np.linspace(0.0, 1.0, 17)[:, None]
    bend = steps * np.max(np.abs(p * (1.0 - p) ** 2 * first - p**2 * (1.0 - p) * last), axis=0)
    share = np.minimum(1.0, _HEIGHT_BEND / np.maximum(bend, _HEIGHT_BEND))
    first, last = share * first, share * last
    return np.column_stack((s[:-1], z[:-1], rise + first, -(2.0 * first + last) / steps, (first + last) / steps**2))


def _section(
    road: RoadLayout, span: tuple[float, float], changes: frozenset[tuple[int, int]], keeps_left: bool
) -> CrossSection:
    start, end = span
    present = [strand for strand in road.strands if strand.begin <= start and strand.end >= end]
    at = _places(present, start, end)
    present.sort(key=lambda strand: -float(strand.place(at)[0].mean()))
    split = _first_on_the_right(present, at, keeps_left)
    left, right = present[:split][::-1], present[split:]
    middle = _middle(road, (left, right), at, keeps_left)
    sides = [_edges(strands, middle, at, sign, changes) for strands, sign in ((left, 1.0), (right, -1.0))]
    columns = [middle, *(edge for side in sides for _, edge in side)]
    stations, values = _simplified(at, np.column_stack(columns), _EDGE_ERROR)
    lanes, column = [], 1
    for side, sign in zip(sides, (1, -1), strict=True):
        inner = values[:, 0]
        for number, (strand, _) in enumerate(side, start=1):
            width = np.maximum(sign * (values[:, column] - inner), 0.0)
            rows = _sloped(stations - start, width)
            lanes.append(SectionLane(number=sign * number, strand=strand, widths=rows))
            inner, column = values[:, column], column + 1
    lanes.sort(key=lambda lane: -lane.number)
    return CrossSection(start=start, end=end, offset=_sloped(stations, values[:, 0]), lanes=tuple(lanes))


def _places(present: Sequence[Strand], start: float, end: float) -> Array:
    """Returns the places of a section where its lanes are compared (n,) [m]."""
    inner = np.concatenate([strand.stations for strand in present]) if present else np.empty(0)
    inner = np.unique(inner[(inner > start + _STEP) & (inner < end - _STEP)])
    cells = np.floor(inner / _STEP)
    inner = inner[np.concatenate(([True], np.diff(cells) > 0))] if len(inner) else inner
    return np.concatenate(([start], inner, [end]))


def _first_on_the_right(present: Sequence[Strand], at: Array, keeps_left: bool) -> int:
    """Returns how many strands, from left to right, lie to the left of lane 0."""
    drives = [k for k, strand in enumerate(present) if strand.lane is not None]
    if not drives:
        return sum(float(strand.place(at)[0].mean()) > 0.0 for strand in present)
    right = [k for k in drives if present[k].forward != keeps_left]
    return right[0] if right else drives[-1] + 1


def _middle(road: RoadLayout, sides: tuple[Sequence[Strand], Sequence[Strand]], at: Array, keeps_left: bool) -> Array:
    """Returns the place of lane 0 (n,) [m].

    It keeps to the inner edge of the lanes on the right, also where the innermost of them has not begun: it does not
    jump where a turn lane opens.
    """
    left, right = ([strand for strand in side if strand.lane is not None] for side in sides)
    all_right = [strand for strand in road.strands if strand.lane is not None and strand.forward != keeps_left]
    bounds = [_inner_edge(side[0], at, sign) for side, sign in ((left, 1.0), (right, -1.0)) if side]
    if not all_right or not bounds:
        strands = [(side[0], sign) for side, sign in zip(sides, (1.0, -1.0), strict=True) if side]
        return (
            bounds[0] if bounds else _inner_edge(strands[-1][0], at, strands[-1][1]) if strands else np.zeros(len(at))
        )
    middle: Array = np.max([_inner_edge(strand, at, -1.0) for strand in all_right], axis=0)
    if left:
        middle = np.minimum(middle, bounds[0])
    return np.maximum(middle, bounds[-1]) if right else middle


def _inner_edge(strand: Strand, at: Array, sign: float) -> Array:
    """Returns the edge (n,) of a strand towards the middle of the road; the sign is 1 on the left, -1 on the right."""
    aside, width = strand.place(at)
    edge: Array = aside - 0.5 * sign * width
    return edge


def _edges(
    strands: Sequence[Strand], middle: Array, at: Array, sign: float, changes: frozenset[tuple[int, int]]
) -> list[tuple[Strand | None, Array]]:
    """Returns the lanes and gaps of a side, innermost first, with their outer edges (n,) [m].

    The centre of each lane stays where it is: where lanes overlap a little, they are narrower.

    Args:
        strands: lanes of the side, innermost first.
        middle: place of lane 0 (n,) [m].
        at: distances along the road (n,) [m].
        sign: 1 on the left, -1 on the right.
        changes: pairs of lanes with a lane change.
    """
    found: list[tuple[Strand | None, Array]] = []
    edge = middle
    for strand in strands:
        aside, width = strand.place(at)
        inner = aside - 0.5 * sign * width
        before = found[-1][0] if found else None
        beside = before is not None and _change(before, strand, changes)
        if float(np.max(sign * (inner - edge))) > _SMALLEST_GAP and not beside:
            inner = np.where(sign * (inner - edge) > 0.0, inner, edge)
            found.append((None, inner))
            edge = inner
        edge = 2.0 * aside - edge
        found.append((strand, edge))
    return found


def _change(a: Strand, b: Strand, changes: frozenset[tuple[int, int]]) -> bool:
    return a.lane is not None and b.lane is not None and bool({(a.lane, b.lane), (b.lane, a.lane)} & changes)


# --- Profiles --------------------------------------------------------------------------------------------------------


def _sloped(stations: Array, values: Array) -> Array:
    slopes = np.diff(values) / np.diff(stations)
    return np.column_stack((stations[:-1], values[:-1], slopes))


def _simplified(at: Array, values: Array, error: float) -> tuple[Array, Array]:
    """Returns as few of the places (n,) with values (n, k) as give the others by linear interpolation."""
    keep = np.zeros(len(at), dtype=bool)
    keep[[0, -1]] = True
    todo = [(0, len(at) - 1)]
    while todo:
        first, last = todo.pop()
        if last - first < 2:
            continue
        share = ((at[first + 1 : last] - at[first]) / (at[last] - at[first]))[:, None]
        line = (1.0 - share) * values[first] + share * values[last]
        gaps = np.max(np.abs(values[first + 1 : last] - line), axis=1)
        worst = int(np.argmax(gaps))
        if gaps[worst] > error:
            keep[first + 1 + worst] = True
            todo += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return at[keep], values[keep]
