"""Lanes and sidewalks in the coordinates of a road: distances along its axis, to the left of it, and widths."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.opendrive.plan_view import Axis
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    pass

# Distance between the samples of a strand [m].
_STEP = 0.5

# Largest distance of the end of a strand from that of its road or of another strand, along the road, which counts as
# the same place; and largest error along the road elsewhere, where the axis turns in a point [m].
_SAME_PLACE, _PROJECTED = 0.008, 0.05

# Smallest distance between the samples of a strand along its road [m].
_ADVANCE = 1e-4

# Largest ratio of the lengths of a sidewalk and of its road, and its largest error along the road [m]; others get roads
# of their own.
_DISTORTION, _OFF = 3.0, 0.002

# Smallest length of a lane relative to that of its axis, inside of a bend: a reader draws a loop where it runs back.
_TIGHTEST = 0.2

# Largest distance of a lane from the axis of its road [m].
_FARTHEST = 60.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Strand:
    """Lane or sidewalk along a road.

    Attributes:
        lane, sidewalk: id of the lane or of the sidewalk; the other is None.
        forward: whether its direction is that of the axis.
        begin, end: distances along the axis where it begins and ends [m].
        stations: distances along the axis (n,), ascending [m].
        aside: distances to the left of the axis (n,) [m].
        heights, widths: (n,) [m].
        given: which of these are points of the line, and not between two (n,).
    """

    lane: int | None = None
    sidewalk: int | None = None
    forward: bool
    begin: float
    end: float
    stations: Array
    aside: Array
    heights: Array
    widths: Array
    given: NDArray[np.bool_]

    def place(self, at: Array) -> tuple[Array, Array]:
        """Returns the distance to the left of the axis and the width at distances along it (n,) [m]."""
        return np.interp(at, self.stations, self.aside), np.interp(at, self.stations, self.widths)

    def shared(self, other: Strand) -> Array:
        """Returns distances along the axis where both strands are (n,); none if they lie behind each other [m]."""
        begin, end = max(self.begin, other.begin), min(self.end, other.end)
        return np.linspace(begin, end, max(2, math.ceil(end - begin) + 1)) if end > begin else np.empty(0)


class LineSamples(NamedTuple):
    """Samples of a line of a town in the frame of OpenDRIVE.

    Attributes:
        along: distances along the line (n,), ascending [m].
        places: (n, 2) [m].
        heights, widths: (n,) [m].
        given: which samples are points of the line (n,).
    """

    along: Array
    places: Array
    heights: Array
    widths: Array
    given: NDArray[np.bool_]


def sample_line(points: Array, widths: Array) -> LineSamples:
    """Returns samples of a smooth curve through the points (n, 3) of a line, with widths there (n,) [m]."""
    own = Axis(points[:, :2] * (1.0, -1.0))
    along = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(points[:, :2], axis=0).T))))
    along *= own.length / along[-1]
    at = np.union1d(np.linspace(0.0, own.length, math.ceil(own.length / _STEP) + 1), along)
    at = at[np.concatenate(([True], np.diff(at) > _ADVANCE))]
    at[-1] = own.length
    return LineSamples(
        along=at,
        places=own.place(at)[:, :2],
        heights=np.interp(at, along, points[:, 2]),
        widths=np.interp(at, along, widths),
        given=np.min(np.abs(at[:, None] - along[None, :]), axis=1) < _ADVANCE,
    )


def own_strand(samples: LineSamples, sidewalk: int) -> Strand:
    """Returns a sidewalk as the axis of a road of its own, whatever its bends are.

    Args:
        samples: samples of the sidewalk, whose curve is the axis.
        sidewalk: id of the sidewalk.
    """
    return Strand(
        lane=None,
        sidewalk=sidewalk,
        forward=True,
        begin=0.0,
        end=float(samples.along[-1]),
        stations=samples.along,
        aside=np.zeros(len(samples.along)),
        heights=samples.heights,
        widths=samples.widths,
        given=samples.given,
    )


def strand_beside(
    axis: Axis, samples: LineSamples, edges: Iterable[float], *, lane: int | None = None, sidewalk: int | None = None
) -> Strand | None:
    """Returns a line of a town in the coordinates of an axis, or None if it does not lie along it.

    Args:
        axis: the axis.
        samples: samples of the line.
        edges: distances along the axis where other strands begin and end [m].
        lane: id of the lane.
        sidewalk: id of the sidewalk.
    """
    stations, aside, ahead = axis.project(samples.places)
    if np.max(np.abs(aside)) > _FARTHEST or np.max(np.abs(ahead[[0, -1]])) > _SAME_PLACE:
        return None
    if np.max(np.abs(ahead[1:-1]), initial=0.0) > _PROJECTED:
        return None
    if sidewalk is not None and _is_distorted(samples, stations, ahead):
        return None
    forward = bool(stations[-1] > stations[0])
    rows = np.column_stack((stations, aside, samples.heights, samples.widths, samples.given.astype(np.float64)))
    rows = rows if forward else rows[::-1]
    reached = np.maximum.accumulate(rows[:, 0])
    if np.max(reached - rows[:, 0]) > _PROJECTED:
        return None
    rows = rows[np.concatenate(([True], np.diff(reached) > _ADVANCE))]
    if len(rows) < 2 or (lane is not None and axis.shortening(rows[:, 0], rows[:, 1]) < _TIGHTEST):
        return None
    places = list(edges)
    begin, end = (_snapped(float(rows[k, 0]), places) for k in (0, -1))
    if end <= begin:
        return None
    return Strand(
        lane=lane,
        sidewalk=sidewalk,
        forward=forward,
        begin=begin,
        end=end,
        stations=rows[:, 0],
        aside=rows[:, 1],
        heights=rows[:, 2],
        widths=rows[:, 3],
        given=rows[:, 4] > 0.0,
    )


def _is_distorted(samples: LineSamples, stations: Array, ahead: Array) -> bool:
    """Returns whether a line winds so much that it is not the same in the coordinates of the axis."""
    steps = pn.hypot(*np.diff(samples.places, axis=0).T)
    share = np.abs(np.diff(stations)) / steps
    return bool(np.min(share) < 1.0 / _DISTORTION or np.max(share) > _DISTORTION or np.max(np.abs(ahead)) > _OFF)


def _snapped(station: float, places: list[float]) -> float:
    nearest = min(places, key=lambda place: abs(place - station))
    return nearest if abs(nearest - station) <= _SAME_PLACE else station
