"""How broad the road is, seen from its right kerb: what a name along it may take."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics.borders import Border, BorderKind, Borders
from dorothie_gym.world.graphics.medians import SHORTEST_MEDIAN
from dorothie_gym.world.graphics.shapes import polyline_length, right_of
from dorothie_gym.world.town.model import NO_STREET, Array

_BROADEST = 45.0  # [m]
_AHEAD = 1.5  # [m] that places across the road from each other may lie apart along it
_SAME_LEVEL = 1.5  # [m]
_FEW = 6  # samples without a line in the middle, as where turn lanes begin back to back
_CELL = 64  # nearest places that are looked at: those on the own kerb are among them
_SMOOTHING = 9  # samples


@dataclass(frozen=True, eq=False)
class Roadway:
    """A stretch of road without grass in it, along its right kerb.

    Attributes:
        street: index of the street.
        line: its middle (n, 2) [m].
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
    """Lines of one kind as one set of places, with the number of the line and its length [m] for each."""

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
        """Distance (n,) [m] across the road from a right kerb to the nearest place on its left, and which place.

        Only places count whose heading differs from the kerb's by an angle with a cosine between the two given;
        the distance is infinite where there is none.
        """
        if not len(self.place):
            return np.full(len(line.heading), np.inf), np.zeros(len(line.heading), dtype=np.int64)
        found = cKDTree(self.place[:, :2]).query(
            line.points[:, :2], k=min(_CELL, len(self.place)), distance_upper_bound=_BROADEST
        )
        near, index = (np.reshape(row, (len(line.heading), -1)) for row in found)
        index = np.minimum(index, len(self.place) - 1)
        offset = self.place[index] - line.points[:, None]
        right = right_of(line.heading)[:, None]
        ahead = offset[..., 0] * right[..., 1] - offset[..., 1] * right[..., 0]
        aside = -(offset[..., :2] * right).sum(axis=-1)
        turn = np.cos(self.heading[index] - line.heading[:, None])
        fits = np.isfinite(near) & (np.abs(ahead) < _AHEAD) & (aside > 1.0) & (np.abs(offset[..., 2]) < _SAME_LEVEL)
        fits &= (turn >= cosine[0]) & (turn <= cosine[1])
        width = np.where(fits, aside, np.inf)
        best = np.argmin(width, axis=1)
        rows = np.arange(len(best))
        return width[rows, best], index[rows, best]


def roadways(borders: Borders) -> Iterator[Roadway]:
    """All roadways of a town's streets, from what lies beside its lanes.

    Where nothing but paint lies between the two directions they are one roadway, which is yielded once.
    """
    by_street: dict[int, list[Border]] = {}
    for line in borders.lines:
        if line.street != NO_STREET:
            by_street.setdefault(line.street, []).append(line)
    for _, own in sorted(by_street.items()):
        yield from _of_street(borders, own)


def _of_street(borders: Borders, lines: Sequence[Border]) -> Iterator[Roadway]:
    right = [line for line in lines if line.kind is BorderKind.EDGE and line.sign > 0]
    kerbs = _Lines.of(right)
    left = _Lines.of([line for line in lines if line.kind is BorderKind.EDGE and line.sign < 0])
    paint = _Lines.of([line for line in lines if line.kind is BorderKind.CENTRE])
    grass = _Lines.of([x for x in lines if x.kind is BorderKind.MEDIAN and polyline_length(x.points) > SHORTEST_MEDIAN])
    for number, line in enumerate(right):
        alone, _ = left.across(line, (0.9, 1.0))
        planted, painted = grass.across(line, (0.9, 1.0))[0], paint.across(line, (-1.0, 1.0))[0]
        # What lies beyond the left edge of this road belongs to another one, as beside a ramp.
        planted, painted = (np.where(alone < found, np.inf, found) for found in (planted, painted))
        opposite, index = kerbs.across(line, (-1.0, -0.8))
        # At the mouth of a ramp its left edge is missing, and the next one on the left is another road's.
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
    """Flags (n,), set too where one that is set is a few places away; but not where there is something against it."""
    near = np.convolve(known, np.ones(2 * _FEW + 1), mode="same")[: len(known)] if len(known) > 2 * _FEW else known
    return np.asarray((known | (np.asarray(near) > 0.5)) & ~against)


def _is_second(kerbs: _Lines, number: int, length: float, facing: NDArray[np.int64]) -> bool:
    """Whether the roadway is found from the other kerb, too, which is longer or comes first."""
    other = int(np.bincount(kerbs.owner[facing]).argmax())
    longest = float(kerbs.length[kerbs.owner == other][0])
    return (longest, -other) > (length, -number)


def _filled(width: Array, otherwise: Array) -> Array:
    """Widths (n,) [m] with those in between where they are infinite, and smooth."""
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
            middle = line.points[run, :2] - (part / 2.0)[:, None] * right_of(line.heading[run])
            yield Roadway(line.street, middle, line.heading[run], line.points[run, 2], part)
