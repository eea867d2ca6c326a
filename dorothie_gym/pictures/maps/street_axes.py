"""Axes of streets, along which their names can be placed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import NO_STREET, Array
from dorothie_gym.pictures.maps.borders import SAME_SURFACE, Border, BorderKind, Borders
from dorothie_gym.pictures.maps.medians import SHORTEST_MEDIAN
from dorothie_gym.pictures.maps.shapes import longer, polyline_length, polyline_stations, right_of
from dorothie_gym.support import portable_arrays as pn

_BROADEST_STREET = 45.0  # [m]
_AHEAD = 1.5  # [m] largest longitudinal offset of points opposite each other
_FEW = 6  # samples without a centre line, as where turn lanes begin back to back
_NEAREST_POINTS = 64  # nearest points to consider, which include those on the same kerb
_SMOOTHING = 9  # samples


@dataclass(frozen=True, eq=False)
class Roadway:
    """Part of a road without a planted median, along its kerb.

    Attributes:
        street: index of the street.
        line: centre line (n, 2) [m].
        heading: (n,) [rad], unwrapped.
        height: (n,) [m].
        width: (n,) [m].
    """

    street: int
    line: Array
    heading: Array
    height: Array
    width: Array


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines of one kind as one set of points, with the line number and its length [m] for each point."""

    place: Array
    heading: Array
    owner: NDArray[np.int64]
    length: Array

    @classmethod
    def of(cls, lines: Sequence[Border]) -> _Lines:
        counts = [len(line.heading) for line in lines]
        return cls(
            np.concatenate([np.zeros((0, 3)), *(line.points for line in lines)]),
            np.concatenate([np.zeros(0), *(line.heading for line in lines)]),
            np.repeat(np.arange(len(lines)), counts),
            np.repeat([polyline_length(line.points) for line in lines], counts),
        )

    def across(self, line: Border, cosine: tuple[float, float]) -> tuple[Array, NDArray[np.int64]]:
        """Returns the distance (n,) [m] from a kerb to the nearest point across the road, and its index.

        Only points count whose heading differs from that of the kerb by an angle with a cosine in the given range;
        the distance is infinite without such a point.
        """
        if not len(self.place):
            return np.full(len(line.heading), np.inf), np.zeros(len(line.heading), dtype=np.int64)
        found = cKDTree(self.place[:, :2]).query(
            line.points[:, :2], k=min(_NEAREST_POINTS, len(self.place)), distance_upper_bound=_BROADEST_STREET
        )
        near, index = (np.reshape(row, (len(line.heading), -1)) for row in found)
        index = np.minimum(index, len(self.place) - 1)
        offset = self.place[index] - line.points[:, None]
        out = line.sign * right_of(line.heading)[:, None]
        ahead = offset[..., 0] * out[..., 1] - offset[..., 1] * out[..., 0]
        aside = -(offset[..., :2] * out).sum(axis=-1)
        turn = pn.cos(self.heading[index] - line.heading[:, None])
        fits = np.isfinite(near) & (np.abs(ahead) < _AHEAD) & (aside > 1.0) & (np.abs(offset[..., 2]) < SAME_SURFACE)
        fits &= (turn >= cosine[0]) & (turn <= cosine[1])
        width = np.where(fits, aside, np.inf)
        best = np.argmin(width, axis=1)
        rows = np.arange(len(best))
        return width[rows, best], index[rows, best]


def roadways(borders: Borders) -> Iterator[Roadway]:
    """Yields all roadways of the streets of a town, from the borders of its lanes.

    Two directions with only paint between them are one roadway, yielded once.
    """
    by_street: dict[int, list[Border]] = {}
    for line in borders.lines:
        if line.street != NO_STREET:
            by_street.setdefault(line.street, []).append(line)
    for _, own in sorted(by_street.items()):
        yield from _of_street(borders, own)


def _of_street(borders: Borders, lines: Sequence[Border]) -> Iterator[Roadway]:
    outer = [line for line in lines if line.kind is BorderKind.EDGE and line.outer]
    kerbs = _Lines.of(outer)
    inner = _Lines.of([line for line in lines if line.kind is BorderKind.EDGE and not line.outer])
    paint = _Lines.of([line for line in lines if line.kind is BorderKind.CENTRE])
    grass = _Lines.of([x for x in lines if x.kind is BorderKind.MEDIAN and polyline_length(x.points) > SHORTEST_MEDIAN])
    for number, line in enumerate(outer):
        alone, _ = inner.across(line, (0.9, 1.0))
        planted, painted = grass.across(line, (0.9, 1.0))[0], paint.across(line, (-1.0, 1.0))[0]
        # beyond the inner edge another road begins, as beside a ramp
        planted, painted = (np.where(alone < found, np.inf, found) for found in (planted, painted))
        opposite, index = kerbs.across(line, (-1.0, -0.8))
        # at the mouth of a ramp the inner edge is missing, and the next one belongs to another road
        most = max(borders.abreast(lane) for lane in line.lanes) * line.width
        shared = _spread(np.isfinite(painted) & (painted < planted) & np.isfinite(opposite), np.isfinite(planted))
        own = np.where(
            np.isfinite(planted),
            planted,
            np.where(np.isfinite(alone), np.minimum(alone, most), line.width),
        )
        if shared.any() and not _is_second(kerbs, number, polyline_length(line.points), index[shared]):
            yield from _runs(line, shared, _filled(np.where(shared, opposite, np.inf), line.width))
        yield from _runs(line, ~shared, own)


def _spread(known: NDArray[np.bool_], against: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Sets flags (n,) also within a few samples of a set flag, except where `against` is set."""
    near = np.convolve(known, np.ones(2 * _FEW + 1), mode="same")[: len(known)] if len(known) > 2 * _FEW else known
    return np.asarray((known | (np.asarray(near) > 0.5)) & ~against)


def _is_second(kerbs: _Lines, number: int, length: float, facing: NDArray[np.int64]) -> bool:
    """Returns whether the roadway is also found from the other kerb, which takes precedence: it is longer or first."""
    other = int(np.bincount(kerbs.owner[facing]).argmax())
    longest = float(kerbs.length[kerbs.owner == other][0])
    return (longest, -other) > (length, -number)


def _filled(width: Array, otherwise: Array) -> Array:
    """Interpolates infinite widths (n,) [m] and smooths the result."""
    good = np.isfinite(width)
    if not good.any():
        return otherwise
    whole = np.interp(np.arange(len(width)), np.flatnonzero(good), width[good])
    if len(whole) < _SMOOTHING:
        return np.full(len(whole), float(np.median(whole)))
    padded = np.pad(whole, _SMOOTHING // 2, mode="edge")
    return np.convolve(padded, np.full(_SMOOTHING, 1.0 / _SMOOTHING), mode="valid")


def _runs(line: Border, wanted: NDArray[np.bool_], width: Array) -> Iterator[Roadway]:
    for run in np.split(np.arange(len(wanted)), np.flatnonzero(np.diff(wanted.astype(int)) != 0) + 1):
        if wanted[run[0]] and len(run) > 2:
            part = _filled(width[run], width[run])
            middle = line.points[run, :2] - line.sign * (part / 2.0)[:, None] * right_of(line.heading[run])
            yield Roadway(line.street, middle, line.heading[run], line.points[run, 2], part)


# --- Axes ------------------------------------------------------------------------------------------------------------

_AXIS_STEP = 5.0  # [px]
_WIDEST_JUNCTION = 50.0  # [m] that a label may span
_STRAIGHT_ON = 0.3  # [rad]


@dataclass(eq=False)
class Axis:
    """Line along a street with equidistant points.

    Attributes:
        street: index of the street.
        line: points (n, 2) [px].
        height: height of the road (n,) [m].
        heading: direction of the line (n,) [rad], unwrapped.
        room: width of the road (n,) [px].
        step: distance between the points [px].
        beside: whether it runs beside the road instead of on it.
        clear: cached distance to the obstacles of each level (n,) [px].
        taken: distance to the labels placed so far (n,) [px].
    """

    street: int
    line: Array
    height: Array
    heading: Array
    room: Array
    step: float
    beside: bool = False
    clear: dict[int, Array] = field(default_factory=dict)
    taken: Array = field(init=False)

    def __post_init__(self) -> None:
        self.taken = np.full(len(self.line), np.inf)

    @property
    def length(self) -> float:
        """Length [px]."""
        return (len(self.line) - 1) * self.step

    def keep_off(self, places: cKDTree, radius: float) -> None:
        """Registers a label, given by a tree of its points and its half width [px]."""
        near, _ = places.query(self.line)
        self.taken = np.minimum(self.taken, near - radius)

    def along(self, start: float, length: float, points: int) -> Array:
        """Returns points (points, 2) [px] of the part that begins at a station and has a length [px]."""
        s = np.linspace(start, start + length, points)
        stations = np.arange(len(self.line)) * self.step
        return np.stack([np.interp(s, stations, column) for column in self.line.T], axis=-1)

    def reversed(self) -> Axis:
        """Returns the axis in the opposite direction."""
        back = slice(None, None, -1)
        return replace(
            self,
            line=self.line[back],
            height=self.height[back],
            heading=self.heading[back] + np.pi,
            room=self.room[back],
            clear={},
        )


def street_axes(borders: Borders, scale: float, origin: Array) -> list[Axis]:
    """Returns the centre lines of all roadways of a town, sorted by street and length.

    Args:
        borders: borders of the lanes.
        scale: [px/m].
        origin: world position of pixel (0, 0) [m].
    """
    found = [
        _axis(way.street, (way.line - origin) * scale, way.heading, way.height, way.width * scale)
        for way in roadways(borders)
    ]
    return sorted((axis for axis in found if axis is not None), key=lambda axis: (axis.street, -axis.length))


def _axis(street: int, pixels: Array, heading: Array, height: Array, room: Array, beside: bool = False) -> Axis | None:
    stations = polyline_stations(pixels)
    count = int(stations[-1] // _AXIS_STEP) + 1
    if count < 4:
        return None
    s = np.linspace(0.0, stations[-1], count)
    even = np.stack([np.interp(s, stations, column) for column in pixels.T], axis=-1)
    return Axis(
        street=street,
        line=even,
        height=np.interp(s, stations, height),
        heading=np.interp(s, stations, heading),
        room=np.interp(s, stations, room),
        step=float(s[1]),
        beside=beside,
    )


def across_junctions(axes: Sequence[Axis], scale: float) -> Iterator[Axis]:
    """Yields pairs of axes of a street that continue straight across a junction, joined; `scale` in px/m."""
    for k, first in enumerate(axes):
        for second in axes[k + 1 :]:
            for a in (first, first.reversed()):
                for b in (second, second.reversed()):
                    if _goes_on(a, b, scale) and (joined := _joined(a, b)) is not None:
                        yield joined


def _goes_on(a: Axis, b: Axis, scale: float) -> bool:
    between = b.line[0] - a.line[-1]
    gap = float(pn.hypot(*between))
    if not 2.0 * _AXIS_STEP < gap < _WIDEST_JUNCTION * scale or abs(a.height[-1] - b.height[0]) > SAME_SURFACE:
        return False
    way = pn.arctan2(between[1], between[0])
    return bool(pn.cos(np.array([a.heading[-1], b.heading[0]]) - way).min() > pn.cos(_STRAIGHT_ON))


def _joined(a: Axis, b: Axis) -> Axis | None:
    heading = np.unwrap(np.concatenate((a.heading, b.heading)))
    height, room = np.concatenate((a.height, b.height)), np.concatenate((a.room, b.room))
    return _axis(a.street, np.concatenate((a.line, b.line)), heading, height, room)


def beside_axes(
    lines: Sequence[Border], street: int, scale: float, origin: Array, aside: float, more: float
) -> Iterator[Axis]:
    """Yields lines beside the edges of a street at a distance `aside` [px], extended by `more` [px] at both ends."""
    for line in lines:
        if line.street != street or line.kind is not BorderKind.EDGE:
            continue
        pixels = (line.shifted(-aside / scale) - origin) * scale
        pixels = pixels[np.concatenate(([True], pn.hypot(*np.diff(pixels, axis=0).T) > 1e-6))]
        if len(pixels) < 2:
            continue
        along = longer(pixels, more)
        steps = np.diff(along, axis=0)
        angle = np.unwrap(pn.arctan2(steps[:, 1], steps[:, 0]))
        heading = np.concatenate((angle[:1], (angle[1:] + angle[:-1]) / 2.0, angle[-1:]))
        height = np.full(len(along), float(line.points[:, 2].mean()))
        axis = _axis(street, along, heading, height, np.full(len(along), np.inf), beside=True)
        if axis is not None:
            yield axis
