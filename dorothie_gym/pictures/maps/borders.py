"""Borders at the sides of lanes: another lane, oncoming traffic, a median or the edge of the road."""

from __future__ import annotations

import enum
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import Array
from dorothie_gym.pictures.maps.shapes import TownSamples, right_of
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

NARROWEST_MEDIAN = 1.2
"""Smallest width of a median between the two directions [m]; below it there is only paint."""

_WIDEST_MEDIAN = 14.0  # [m]
_TOUCH = 1.0  # [m] between the edges of lanes side by side, at most
SAME_SURFACE = 1.5  # [m] difference of height of points on one surface, at most
_THIN = 1.6  # [m] a narrower lane is still opening: the line beside it would form a wedge
_INSIDE = 0.4  # [m] an edge this far inside another lane is no edge
_SHORTEST_BORDER = 4.0  # [m] length of a line
_JOIN = 0.8  # [m] between the ends of two lines that are joined

_Run: TypeAlias = tuple[int, int, int]  # first sample, the one after the last, kind


class BorderKind(enum.IntEnum):
    """Kind of the area beyond the side of a lane."""

    NONE = 0
    LANE = 1
    CENTRE = 2
    MEDIAN = 3
    EDGE = 4


@dataclass(frozen=True, eq=False)
class Border:
    """Line along the sides of successive lanes.

    Attributes:
        kind: kind of the area beyond it.
        sign: side of the lanes: -1 left, +1 right.
        outer: whether that is the side of the kerb, not that of oncoming traffic.
        lanes: ids of the lanes, in driving direction.
        street: street of the first lane, or -1.
        points: line on the edge of the lanes in driving direction (n, 3) [m].
        heading: (n,) [rad].
        gap: distance between the edge and the lane beyond it (n,) [m]; 0 without such a lane.
        width: width of the lane (n,) [m].
    """

    kind: BorderKind
    sign: int
    outer: bool
    lanes: tuple[int, ...]
    street: int
    points: Array
    heading: Array
    gap: Array
    width: Array

    def shifted(self, inwards: Array | float) -> Array:
        """Returns the line (n, 2) [m] shifted into its lane by (n,) [m]; negative values shift it out of the lane."""
        shift = np.broadcast_to(np.asarray(-self.sign * np.asarray(inwards)), self.heading.shape)
        return np.asarray(self.points[:, :2] + shift[:, None] * right_of(self.heading))

    def part(self, run: NDArray[np.int64]) -> Border:
        """Returns the part of the border with the given indices."""
        return replace(
            self, points=self.points[run], heading=self.heading[run], gap=self.gap[run], width=self.width[run]
        )


@dataclass(frozen=True, eq=False)
class Borders:
    """All borders of a town.

    Attributes:
        lines: all lines, each once.
        outer_neighbour: lane in the same direction beside each lane that has one on the side of the kerb.
        divided: lanes with oncoming traffic beside them, beyond a line or a median.
    """

    lines: tuple[Border, ...]
    outer_neighbour: dict[int, int]
    divided: frozenset[int]

    @cached_property
    def inner_neighbour(self) -> dict[int, int]:
        """Lane in the same direction beside each lane that has one on the side of oncoming traffic."""
        return {outer: lane for lane, outer in self.outer_neighbour.items()}

    def abreast(self, lane: int) -> int:
        """Returns the number of lanes from a lane to the inner edge of its carriageway."""
        seen = {lane}
        while (beside := self.inner_neighbour.get(lane, lane)) not in seen:
            seen.add(beside)
            lane = beside
        return len(seen)

    def outermost(self, lane: int) -> int:
        """Returns the lane at the kerb of the carriageway of a lane."""
        seen = {lane}
        while (beside := self.outer_neighbour.get(lane, lane)) not in seen:
            seen.add(beside)
            lane = beside
        return lane


def find_borders(town: Town, samples: TownSamples) -> Borders:
    """Finds the borders of all lanes outside junctions."""
    outside = samples.of_lanes(np.array([not lane.in_junction for lane in town.lanes], dtype=bool))
    if not len(outside):
        return Borders((), {}, frozenset())
    out = town.traffic.sign  # row 0 of the kinds is the side of oncoming traffic, row 1 that of the kerb
    inner = _beside(samples, outside, -out)
    outer = _beside(samples, outside, out)
    facing, gap = _facing(samples, outside[inner[outside] < 0], out)
    hidden = _inside_others(samples, outside, out)
    thin = samples.half_width < _THIN / 2.0
    kinds = np.zeros((2, len(samples.lane)), dtype=np.int64)
    kinds[:, outside] = BorderKind.EDGE
    kinds[1][outer >= 0] = BorderKind.NONE  # drawn from the other lane, whose inner side it is
    kinds[0][inner >= 0] = BorderKind.LANE
    kinds[0][inner >= 0] *= ~(thin | thin[np.maximum(inner, 0)])[inner >= 0]
    met = facing >= 0
    kinds[0][met] = np.where(gap[met] < NARROWEST_MEDIAN, BorderKind.CENTRE, BorderKind.MEDIAN)
    yielding = met & (kinds[0] == BorderKind.CENTRE) & ~_owns(town, samples, facing)
    kinds[0][yielding] = BorderKind.NONE
    kinds[hidden & np.isin(kinds, (BorderKind.EDGE, BorderKind.LANE, BorderKind.MEDIAN))] = BorderKind.NONE
    kinds[:, thin] *= kinds[:, thin] != BorderKind.EDGE
    lines = [
        line
        for sign, row in ((-out, kinds[0]), (out, kinds[1]))
        for line in _lines(town, samples, row, gap if sign != out else np.zeros_like(gap), sign)
    ]
    divided = np.unique(samples.lane[met]).tolist()
    return Borders(tuple(lines), _majority(samples, outer), frozenset(divided))


def _beside(samples: TownSamples, outside: NDArray[np.int64], sign: int) -> NDArray[np.int64]:
    """Returns the sample of the adjacent lane in the same direction on a side (n,), or -1."""
    own, other = samples.edge(sign)[outside], samples.edge(-sign)[outside]
    near, where = cKDTree(other).query(own, k=6, distance_upper_bound=pn.hypot(_TOUCH, 1.5))
    candidate = outside[np.minimum(where, len(outside) - 1)]  # (m, 6)
    fits = np.isfinite(near) & (samples.lane[candidate] != samples.lane[outside][:, None])
    fits &= pn.cos(samples.heading[candidate] - samples.heading[outside][:, None]) > 0.9
    fits &= np.abs(samples.centre[candidate, 2] - samples.centre[outside, 2][:, None]) < SAME_SURFACE
    ahead, aside = _frame(samples, outside, samples.edge(-sign)[candidate] - own[:, None])
    fits &= (np.abs(aside) < _TOUCH) & (np.abs(ahead) < 1.5)
    found = np.full(len(samples.lane), -1, dtype=np.int64)
    first = candidate[np.arange(len(outside)), np.argmax(fits, axis=1)]
    found[outside] = np.where(fits.any(axis=1), first, -1)
    return found


def _facing(samples: TownSamples, innermost: NDArray[np.int64], out: int) -> tuple[NDArray[np.int64], Array]:
    """Returns the sample of the oncoming lane (n,), or -1, and the gap between the inner edges of both (n,) [m]."""
    found, gap = np.full(len(samples.lane), -1, dtype=np.int64), np.zeros(len(samples.lane))
    if not len(innermost):
        return found, gap
    edge = samples.edge(-out)[innermost]
    near, where = cKDTree(edge).query(edge, k=40, distance_upper_bound=_WIDEST_MEDIAN + 1.0)
    candidate = innermost[np.minimum(where, len(innermost) - 1)]
    fits = np.isfinite(near) & (pn.cos(samples.heading[candidate] - samples.heading[innermost][:, None]) < -0.9)
    fits &= np.abs(samples.centre[candidate, 2] - samples.centre[innermost, 2][:, None]) < SAME_SURFACE
    ahead, aside = _frame(samples, innermost, edge[np.minimum(where, len(innermost) - 1)] - edge[:, None])
    aside = out * aside  # positive towards the own kerb
    fits &= (np.abs(ahead) < 1.3) & (aside < _TOUCH) & (aside > -_WIDEST_MEDIAN)
    some = fits.any(axis=1)
    first = np.argmin(np.where(fits, near, np.inf), axis=1)
    rows = np.arange(len(innermost))
    found[innermost] = np.where(some, candidate[rows, first], -1)
    gap[innermost] = np.where(some, np.maximum(0.0, -aside[rows, first]), 0.0)
    return found, gap


def _frame(samples: TownSamples, index: NDArray[np.int64], offset: Array) -> tuple[Array, Array]:
    """Transforms offsets (m, k, 2) [m] from samples into their frames: forward and right (m, k) each."""
    heading = samples.heading[index][:, None]
    c, s = pn.cos(heading), pn.sin(heading)
    return offset[..., 0] * c + offset[..., 1] * s, offset[..., 1] * c - offset[..., 0] * s


def _inside_others(samples: TownSamples, outside: NDArray[np.int64], out: int) -> NDArray[np.bool_]:
    """Returns whether the inner and outer edges lie inside another lane at the same height (2, n)."""
    hidden = np.zeros((2, len(samples.lane)), dtype=bool)
    tree = cKDTree(samples.centre[outside, :2])
    for row, sign in enumerate((-out, out)):
        near, where = tree.query(samples.edge(sign)[outside], k=8, distance_upper_bound=3.0)
        candidate = outside[np.minimum(where, len(outside) - 1)]
        inside = np.isfinite(near) & (samples.lane[candidate] != samples.lane[outside][:, None])
        inside &= near < samples.half_width[candidate] - _INSIDE
        inside &= np.abs(samples.centre[candidate, 2] - samples.centre[outside, 2][:, None]) < SAME_SURFACE
        hidden[row, outside] = inside.any(axis=1)
    return hidden


def _owns(town: Town, samples: TownSamples, facing: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Returns whether the line between a lane and the oncoming lane is drawn from this lane (n,)."""
    number = np.array([lane.lane_id for lane in town.lanes])[samples.lane]
    other = number[np.maximum(facing, 0)]
    different = (number < 0) != (other < 0)
    return np.where(different, number < 0, samples.lane < samples.lane[np.maximum(facing, 0)])


def _majority(samples: TownSamples, beside: NDArray[np.int64]) -> dict[int, int]:
    """Returns for each lane the most frequent adjacent lane of its samples."""
    index = np.flatnonzero(beside >= 0)
    pairs, counts = np.unique(
        np.column_stack((samples.lane[index], samples.lane[beside[index]])), axis=0, return_counts=True
    )
    best: dict[int, tuple[int, int]] = {}
    for (lane, other), count in zip(pairs.tolist(), counts.tolist(), strict=True):
        if lane not in best or count > best[lane][0]:
            best[lane] = count, other
    return {lane: other for lane, (_, other) in best.items()}


def _lines(town: Town, samples: TownSamples, kinds: NDArray[np.int64], gap: Array, sign: int) -> Iterator[Border]:
    """Yields lines along one side, joined across the ends of lanes."""
    runs = [run for lane in range(len(town.lanes)) for run in _runs(kinds, *samples.bounds[lane].tolist())]
    edge = np.column_stack((samples.edge(sign), samples.centre[:, 2]))
    after = _followers(town, samples, runs, edge)
    used = [False] * len(runs)
    followed = frozenset(after.values())
    # open lines first; the rest are rings
    for head in (*(k for k in range(len(runs)) if k not in followed), *range(len(runs))):
        chain: list[_Run] = []
        number = head
        while number >= 0 and not used[number]:
            used[number] = True
            chain.append(runs[number])
            number = after.get(number, -1)
        if chain:
            yield from _border(town, samples, edge, gap, sign, chain)


def _followers(town: Town, samples: TownSamples, runs: Sequence[_Run], edge: Array) -> dict[int, int]:
    """Returns the continuation of each run that reaches the end of its lane: same kind and street, adjacent start."""
    begins = {(int(samples.lane[a]), kind): k for k, (a, _, kind) in enumerate(runs) if samples.station[a] == 0.0}
    after: dict[int, int] = {}
    for k, (_, end, kind) in enumerate(runs):
        lane = town.lanes[int(samples.lane[end - 1])]
        if end != samples.bounds[lane.id, 1]:
            continue
        for link in town.successors(lane.id):
            found = begins.get((link.target, kind), -1)
            if found < 0 or town.lanes[link.target].street != lane.street:
                continue
            if pn.hypot(*(edge[runs[found][0], :2] - edge[end - 1, :2])) < _JOIN:
                after[k] = found
                break
    return after


def _border(
    town: Town, samples: TownSamples, edge: Array, gap: Array, sign: int, chain: Sequence[_Run]
) -> Iterator[Border]:
    # the common point of successive lanes is kept once
    index = np.concatenate([np.arange(a + (k > 0), b) for k, (a, b, _) in enumerate(chain)])
    line = edge[index]
    if len(line) < 2 or pn.hypot(*np.diff(line[:, :2], axis=0).T).sum() < _SHORTEST_BORDER:
        return
    lanes = tuple(dict.fromkeys(samples.lane[index].tolist()))
    yield Border(
        kind=BorderKind(chain[0][2]),
        sign=sign,
        outer=sign == town.traffic.sign,
        lanes=lanes,
        street=town.lanes[lanes[0]].street,
        points=line,
        heading=np.unwrap(samples.heading[index]),
        gap=_smooth(gap[index]),
        width=2.0 * samples.half_width[index],
    )


def _runs(kinds: NDArray[np.int64], start: int, end: int) -> Iterator[_Run]:
    """Yields index ranges of one lane with constant kind, and the kind; single samples in between are absorbed."""
    row = kinds[start:end].copy()
    for k in range(1, len(row) - 1):
        if row[k - 1] == row[k + 1] != row[k]:
            row[k] = row[k - 1]
    cuts = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
    for a, b in itertools.pairwise(cuts):
        if row[a] != BorderKind.NONE and b - a > 1:
            yield start + a, start + b, int(row[a])


def _smooth(values: Array) -> Array:
    """Smooths with a running mean over five samples: distances to samples of another lane jitter."""
    if len(values) < 5:
        return values
    padded = np.pad(values, 2, mode="edge")
    return np.convolve(padded, np.full(5, 0.2), mode="valid")
