"""Centre lines of street segments between the edges of their crossings, with rounded bends and heights."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.yaml.geometry import LINE_SPACING, Curve, Point, bend_stations, line, rounded, turn_at
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.segments import StreetSegment

STEEPEST = 0.12
"""Largest slope of a street."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HeightProfile:
    """Piecewise cubic interpolation of given heights.

    Attributes:
        stations: ascending distances along the street with given heights (n,) [m].
        heights: heights there (n,) [m].
        slopes: slopes there (n,).
    """

    stations: Array
    heights: Array
    slopes: Array

    @property
    def is_flat(self) -> bool:
        """Whether the height is constant."""
        return bool(np.ptp(self.heights) == 0.0)

    def at(self, station: Array) -> Array:
        """Returns the heights (n,) at distances (n,) along the street [m]."""
        if self.is_flat:
            return np.full(len(station), self.heights[0])
        k = np.clip(np.searchsorted(self.stations, station, side="right") - 1, 0, len(self.stations) - 2)
        span = self.stations[k + 1] - self.stations[k]
        t = np.clip((station - self.stations[k]) / span, 0.0, 1.0)
        # Cubic Hermite basis.
        result: Array = (
            (1.0 + 2.0 * t) * (1.0 - t) ** 2 * self.heights[k]
            + t * (1.0 - t) ** 2 * span * self.slopes[k]
            + t**2 * (3.0 - 2.0 * t) * self.heights[k + 1]
            - t**2 * (1.0 - t) * span * self.slopes[k + 1]
        )
        return result

    def steepest(self) -> float:
        """Returns the largest slope, up or down."""
        if self.is_flat:
            return 0.0
        grid = np.linspace(self.stations[0], self.stations[-1], max(3, int(self.stations[-1] - self.stations[0])))
        return float(np.max(np.abs(np.diff(self.at(grid))) / np.diff(grid)))


def height_profile(stations: Sequence[float], heights: Sequence[float | None]) -> HeightProfile:
    """Returns the profile through given heights, flat at both ends and at local extremes.

    Inner slopes are the harmonic mean of the adjacent secants, which keeps every piece monotone (Fritsch and Butland,
    "A method for constructing local monotone piecewise cubic interpolants", SIAM J. Sci. Stat. Comput. 5(2), 1984).

    Args:
        stations: ascending distances along the street [m].
        heights: heights there, or None to interpolate; the first and the last must be given [m].
    """
    given = [(s, height) for s, height in zip(stations, heights, strict=True) if height is not None]
    s, z = (np.array(column, dtype=float) for column in zip(*given, strict=True))
    steps = np.diff(s)
    secants = np.diff(z) / steps
    slopes = np.zeros(len(s))
    for k in range(1, len(s) - 1):
        before, after = secants[k - 1], secants[k]
        if before * after > 0.0:
            weight = (1.0 + steps[k] / (steps[k - 1] + steps[k])) / 3.0
            slopes[k] = before * after / (weight * after + (1.0 - weight) * before)
    return HeightProfile(stations=s, heights=z, slopes=slopes)


# --- Lines -----------------------------------------------------------------------------------------------------------

SMALLEST_BEND = 5.5
"""Smallest radius of the centre line of a lane [m]."""
SHORTEST_SEGMENT = 10.0
"""Shortest street between two junctions [m]."""
SHORTEST_RING_SEGMENT = 6.0
"""The same on the ring of a roundabout [m]."""
SLOPE_SPACING = 5.0
"""Largest distance between the points of a sloping line [m]."""
_SLOPE_SLACK = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Centreline:
    """Centre line of a street segment from the edge of one crossing to that of the next, with its heights."""

    path: Curve
    heights: HeightProfile

    def beside(self, offset: float, span: tuple[float, float] | None = None) -> Array:
        """Returns points (n, 3) of the parallel line at a distance to the right, optionally of a part only [m]."""
        path = self.path if span is None else self.path.part(*span)
        spacing = LINE_SPACING if self.heights.is_flat else SLOPE_SPACING
        plane, stations = path.sample(offset, line_spacing=spacing)
        return np.column_stack((plane, self.heights.at(stations + (0.0 if span is None else span[0]))))


def centreline_of(segment: StreetSegment, trim_start: float, trim_end: float) -> Centreline:
    """Computes the centre line of a street segment.

    Args:
        segment: the segment.
        trim_start: distance from the centre of its first crossing to its start [m].
        trim_end: the same at its end [m].

    Raises:
        TownError: there is no room between the crossings, a bend is too tight, or the slope too steep.
    """
    if segment.arc is not None:
        path = _on_ring(segment, trim_start, trim_end)
        stations = [0.0, path.length]
    else:
        points = _between(segment, trim_start, trim_end)
        radii = _radii(segment, points)
        path = rounded(points, radii)
        _check_length(segment, path.length)
        stations = [0.0, *bend_stations(points, radii), path.length]
    heights = height_profile(stations, segment.heights)
    slope = heights.steepest()
    if slope > STEEPEST + _SLOPE_SLACK:
        segment.street.entry.fail(
            f"{segment.label()} it climbs too steeply: {100.0 * slope:.0f} %, at most {100.0 * STEEPEST:.0f} % are"
            " possible; make the way longer or the difference of heights smaller"
        )
    return Centreline(path=path, heights=heights)


def _on_ring(segment: StreetSegment, trim_start: float, trim_end: float) -> Curve:
    arc = segment.arc
    left = 0.0 if arc is None else arc.length - trim_start - trim_end
    if arc is None or left < SHORTEST_RING_SEGMENT:
        segment.street.entry.fail(
            f"the streets that meet its ring at {segment.start.name!r} and {segment.end.name!r} are too close together:"
            f" {SHORTEST_RING_SEGMENT - left:.1f} m of ring are missing between them; give it a larger radius or let"
            " them arrive from directions further apart"
        )
    return Curve((arc,)).part(trim_start, arc.length - trim_end)


def _between(segment: StreetSegment, trim_start: float, trim_end: float) -> list[Point]:
    """Returns the corners of a segment with its ends moved to the edges of its crossings."""
    corners, street = segment.corners, segment.street
    legs = [pm.dist(a, b) for a, b in itertools.pairwise(corners)]
    room = legs[0] - trim_start - trim_end if len(legs) == 1 else min(legs[0] - trim_start, legs[-1] - trim_end)
    if room < (SHORTEST_SEGMENT if len(legs) == 1 else 0.5):
        street.entry.fail(
            f"{segment.label()} there is no room: the junctions take {trim_start:.1f} m and {trim_end:.1f} m of it;"
            " move the junctions or the bends next to them further apart"
        )
    first, last = line(corners[0], corners[1]), line(corners[-1], corners[-2])
    return [first.at(trim_start)[:2], *corners[1:-1], last.at(trim_end)[:2]]


def _check_length(segment: StreetSegment, length: float) -> None:
    if length < SHORTEST_SEGMENT:
        segment.street.entry.fail(
            f"{segment.label()} only {length:.1f} m of street are left; {SHORTEST_SEGMENT:g} m are needed:"
            " move the junctions apart"
        )


def _radii(segment: StreetSegment, points: Sequence[Point]) -> list[float]:
    """Returns the radius of each bend [m]: that of the street, else the largest if bends share their leg evenly."""
    legs = [pm.dist(a, b) for a, b in itertools.pairwise(points)]
    rooms = [leg if k in (0, len(legs) - 1) else leg / 2.0 for k, leg in enumerate(legs)]
    street, radii = segment.street, list[float]()
    for k in range(1, len(points) - 1):
        signed = turn_at(points[k - 1], points[k], points[k + 1])
        turn = max(abs(signed), 1e-6)
        fits = min(rooms[k - 1], rooms[k]) / pm.tan(min(turn, math.radians(179.0)) / 2.0)
        radius = fits if street.radius is None else street.radius
        tightest = segment.section.tightest(signed > 0.0, SMALLEST_BEND)
        place = [round(points[k][0], 2), round(street.traffic.sign * points[k][1], 2)]
        where = f"the bend at {place} {segment.label()}"
        if radius < tightest:
            street.entry.fail(
                f"{where} is tighter than its lanes are wide: radius {radius:.1f} m, at least {tightest:.1f} m are"
                " needed; move its points apart, make the turn gentler, or give a larger radius"
            )
        if radius > fits * (1.0 + 1e-9):
            street.entry.fail(f"{where} has no room for radius {radius:g} m; at most {fits:.1f} m fit")
        radii.append(radius)
    return radii
