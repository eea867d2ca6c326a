"""Overlap and headroom: checks that lanes do not share ground and that bridges are high enough."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.lint.fault import HALF_WIDTH, Fault, FaultKind
from dorothie_gym.maps.lint.samples import SAME_GROUND, SAMPLE_SPACING, LaneSamples
from dorothie_gym.maps.model import Array

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

MAX_OVERLAP = 0.5
"""Largest sideways overlap of lanes [m]: merging roads overlap, and markings are not exact."""

SHORTEST_OVERLAP = 2.0
"""Shortest overlap that is reported [m]: roads may touch at a corner."""

MIN_CLEARANCE = 4.0
"""Smallest headroom under a crossing lane [m]: the largest height of lorries in Europe."""

LINK_REACH = 5.0
"""Distance from their ends within which successive lanes are not compared [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pairs:
    """Samples of different lanes beside each other: indices of both, overlap [m] and difference of height [m]."""

    first: NDArray[np.intp]
    second: NDArray[np.intp]
    overlap: Array
    rise: Array

    def select(self, wanted: NDArray[np.bool_] | NDArray[np.intp]) -> _Pairs:
        return _Pairs(
            first=self.first[wanted], second=self.second[wanted], overlap=self.overlap[wanted], rise=self.rise[wanted]
        )


def clearance_faults(town: Town, samples: LaneSamples) -> Iterator[Fault]:
    """Yields lanes on the same ground, connectors across unrelated lanes, and low bridges."""
    pairs = _pairs(town, samples)
    level = pairs.rise < SAME_GROUND
    for lane, other, rows in _by_lanes(samples, pairs.select(level)):
        if not _follow(town, lane, other) and not _fork_or_join(town, lane, other):
            yield from _overlap(town, samples, lane, other, rows)
    for lane, other, rows in _by_lanes(samples, pairs.select(~level & (pairs.rise < MIN_CLEARANCE))):
        if _follow(town, lane, other):  # a step where they meet is reported separately
            rows = rows.select(~(_at_ends(samples, rows.first) & _at_ends(samples, rows.second)))
        yield from _clearance(samples, lane, other, rows)


def _pairs(town: Town, samples: LaneSamples) -> _Pairs:
    """Returns the overlapping pairs of samples; connectors at the same height are only compared with other lanes."""
    junction = np.array([lane.in_junction for lane in town.lanes], dtype=np.bool_)[samples.owner]
    pairs = samples.tree.query_pairs(float(samples.widths.max()) + SAMPLE_SPACING, output_type="ndarray")
    a, b = pairs[:, 0], pairs[:, 1]
    rise = np.abs(samples.heights[a] - samples.heights[b])
    keep = (samples.owner[a] != samples.owner[b]) & (~(junction[a] & junction[b]) | (rise >= SAME_GROUND))
    a, b, rise = a[keep], b[keep], rise[keep]
    # Measured on the lane that is not a connector: the side of a car on the ground of that lane counts.
    a, b = np.where(junction[a], b, a), np.where(junction[a], a, b)
    offset = samples.points[b] - samples.points[a]
    along = np.einsum("ij,ij->i", offset, samples.along[a])
    across = np.abs(np.einsum("ij,ij->i", offset, samples.right[a]))
    half = np.where(junction[b], HALF_WIDTH, 0.5 * samples.widths[b])
    overlap = 0.5 * samples.widths[a] + half - across
    near = (np.abs(along) <= 0.75 * SAMPLE_SPACING) & (overlap > MAX_OVERLAP)
    return _Pairs(first=a[near], second=b[near], overlap=overlap[near], rise=rise[near])


def _by_lanes(samples: LaneSamples, pairs: _Pairs) -> Iterator[tuple[int, int, _Pairs]]:
    """Pairs grouped by the two lanes, smaller number first."""
    a, b = samples.owner[pairs.first], samples.owner[pairs.second]
    code = np.minimum(a, b) * len(samples.first) + np.maximum(a, b)
    order = np.argsort(code, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(code[order])) + 1):
        if len(rows):
            yield *divmod(int(code[rows[0]]), len(samples.first)), pairs.select(rows)


def _follow(town: Town, lane: int, other: int) -> bool:
    """Returns whether one of two lanes follows the other."""
    return lane in town.predecessors(other) or other in town.predecessors(lane)


def _fork_or_join(town: Town, lane: int, other: int) -> bool:
    """Returns whether two lanes have a common predecessor or successor."""
    after, after_other = ({link.target for link in town.successors(k)} for k in (lane, other))
    return bool(after & after_other) or not set(town.predecessors(lane)).isdisjoint(town.predecessors(other))


def _at_ends(samples: LaneSamples, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Returns which samples lie less than `LINK_REACH` from an end of their lane."""
    owner = samples.owner[rows]
    place = np.minimum(rows - samples.first[owner], samples.first[owner + 1] - 1 - rows)
    at_ends: NDArray[np.bool_] = place * SAMPLE_SPACING < LINK_REACH
    return at_ends


def _overlap(town: Town, samples: LaneSamples, lane: int, other: int, pairs: _Pairs) -> Iterator[Fault]:
    # Where lanes cross, only one of them has many samples inside the other.
    if max(len(np.unique(rows)) for rows in (pairs.first, pairs.second)) * SAMPLE_SPACING <= SHORTEST_OVERLAP:
        return
    worst = int(np.argmax(pairs.overlap))
    x, y = samples.points[pairs.first[worst]]
    connector = next((k for k in (lane, other) if town.lanes[k].in_junction), None)
    if connector is None:
        message = f"lanes {lane} and {other} overlap by {pairs.overlap[worst]:.1f} m"
    else:
        message = f"a car on lane {connector} runs {pairs.overlap[worst]:.1f} m into lane {lane + other - connector}"
    yield Fault(kind=FaultKind.OVERLAP, lanes=(lane, other), position=(float(x), float(y)), message=message)


def _clearance(samples: LaneSamples, lane: int, other: int, pairs: _Pairs) -> Iterator[Fault]:
    if len(pairs.rise) == 0:
        return
    worst = int(np.argmin(pairs.rise))
    x, y = samples.points[pairs.first[worst]]
    message = f"lanes {lane} and {other} cross only {pairs.rise[worst]:.1f} m above each other"
    yield Fault(kind=FaultKind.CLEARANCE, lanes=(lane, other), position=(float(x), float(y)), message=message)
