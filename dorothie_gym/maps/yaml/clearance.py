"""Clearance of YAML towns: streets and junctions may only touch where they meet, unless one passes above the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.yaml.movements import SMALLEST_RING_TRIM, SMALLEST_TRIM, MovementPath
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.arms import Arm
    from dorothie_gym.maps.yaml.centrelines import Centreline
    from dorothie_gym.maps.yaml.segments import Crossing, StreetSegment

Indices: TypeAlias = NDArray[np.int64]

HEADROOM = 4.5
"""Smallest difference of height of streets that pass above each other [m]."""
_CLEARANCE_SPACING = 2.0
"""Sampling distance [m]."""
_SLACK = 0.5
"""Permitted overlap of the edges of roads [m]: the error of a sample half a step aside is smaller."""


def check_crossings(
    crossings: Sequence[Crossing], arms: Mapping[int, tuple[Arm, ...]], trims: Mapping[tuple[int, bool], float]
) -> None:
    """Rejects overlapping junctions.

    Args:
        crossings: all crossings.
        arms: arms by crossing id.
        trims: distance from the centre of the crossing to each end of a segment [m].

    Raises:
        TownError: two junctions at one level are closer than the sum of their radii.
    """
    radii = {crossing.id: _radius(crossing, arms[crossing.id], trims) for crossing in crossings}
    for k, crossing in enumerate(crossings):
        for other in crossings[:k]:
            gap, mine, its = pm.dist(crossing.centre, other.centre), radii[crossing.id], radii[other.id]
            if other.plan is crossing.plan or abs(crossing.height - other.height) >= HEADROOM:
                continue
            if gap < mine + its:
                crossing.plan.entry.fail(
                    f"it is {gap:.1f} m from {other.name!r}, closer than their radii of {mine:.1f} m and {its:.1f} m;"
                    " move them apart or make one junction of them"
                )


def _radius(crossing: Crossing, arms: Sequence[Arm], trims: Mapping[tuple[int, bool], float]) -> float:
    """Returns the radius of a crossing [m]; `check_clearance` covers the long corners of ramps and rings."""
    if crossing.on_ring:
        return SMALLEST_RING_TRIM
    if any(arm.street.ramp for arm in arms):
        return SMALLEST_TRIM
    return max(trims[arm.segment, arm.at_start] for arm in arms)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Samples:
    """Points on the centres of roads, those of segments first, then those of crossings.

    Attributes:
        points: where they are (n, 3) [m].
        before, after: distance along the road from its start and to its end (n,) [m].
        reach: half the width of the road (n,) [m].
        pavement: width of its pavements (n,) [m].
        owner: index of the segment, or of the crossing and the number of segments more (n,).
    """

    points: Array
    before: Array
    after: Array
    reach: Array
    pavement: Array
    owner: Indices


def check_clearance(
    crossings: Sequence[Crossing],
    segments: Sequence[StreetSegment],
    centrelines: Sequence[Centreline],
    ways: Mapping[int, tuple[MovementPath, ...]],
) -> None:
    """Checks all roads and all paths through crossings against each other.

    Raises:
        TownError: two roads touch at one level without meeting there.
    """
    samples = _samples(crossings, segments, centrelines, ways)
    # samples farther apart than the width of the widest road cannot touch
    farthest = 2.0 * float(samples.reach.max() + samples.pavement.max())
    pairs = cKDTree(samples.points[:, :2]).query_pairs(farthest, output_type="ndarray")
    a, b = np.ascontiguousarray(pairs.T)
    x, y, z = np.ascontiguousarray(samples.points.T)
    dx, dy, dz = x[a] - x[b], y[a] - y[b], z[a] - z[b]
    room = samples.reach[a] + samples.reach[b] + np.maximum(samples.pavement[a], samples.pavement[b]) - _SLACK
    near = (dx**2 + dy**2 < room**2) & (np.abs(dz) < HEADROOM)
    pairs, room = pairs[near], room[near]
    touching = pairs[~_may_be_near(samples, crossings, segments, pairs, room)]
    if len(touching):
        _refuse(crossings, segments, samples, touching[0])


def _may_be_near(
    samples: _Samples, crossings: Sequence[Crossing], segments: Sequence[StreetSegment], pairs: Indices, room: Array
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Returns which pairs (n, 2) of samples belong together (n,): they follow each other, or meet at a crossing."""
    place = {crossing.id: k for k, crossing in enumerate(crossings)}
    nowhere = [-1] * len(crossings)
    starts = np.array([*(place[segment.start.id] for segment in segments), *nowhere])
    ends = np.array([*(place[segment.end.id] for segment in segments), *nowhere])
    first, second = samples.owner[pairs].T
    a, b = pairs.T
    # samples of one segment are close to each other within half a circle of its width
    fine = (first == second) & ((first >= len(segments)) | (np.abs(samples.before[a] - samples.before[b]) < 2.0 * room))
    # segments that meet at a crossing were trimmed there; corner to corner they are closer than side to side
    for tips_a, from_a in ((starts, samples.before), (ends, samples.after)):
        for tips_b, from_b in ((starts, samples.before), (ends, samples.after)):
            meet = (tips_a[first] == tips_b[second]) & (tips_a[first] >= 0)
            fine |= meet & (from_a[a] < room) & (from_b[b] < room)
    # a crossing touches its own arms, and others on the same ring
    plans = np.array([*[-1] * len(segments), *(crossing.plan.id for crossing in crossings)])
    fine |= (plans[first] == plans[second]) & (plans[first] >= 0)
    for one, other in ((first, second), (second, first)):
        crossing = one - len(segments)
        fine |= (crossing >= 0) & ((starts[other] == crossing) | (ends[other] == crossing))
    result: np.ndarray[tuple[int], np.dtype[np.bool_]] = fine
    return result


def _refuse(
    crossings: Sequence[Crossing], segments: Sequence[StreetSegment], samples: _Samples, pair: Indices
) -> NoReturn:
    """Raises the error of two samples that touch."""
    first, second = sorted((int(k) for k in samples.owner[pair]), reverse=True)
    x, y = (float(c) for c in samples.points[pair[0], :2])
    place = [round(x), round(segments[0].street.traffic.sign * y)]
    if first < len(segments):
        segment, other = segments[first], segments[second]
        if first == second:
            segment.street.entry.fail(f"{segment.label()} it runs into itself near {place}; move its points apart")
        segment.street.entry.fail(
            f"{segment.label()} it touches street {other.street.name!r} near {place}; put a junction there, move one of"
            f" them away, or lead one {HEADROOM:g} m above the other"
        )
    crossing = crossings[first - len(segments)]
    if second >= len(segments):
        crossing.plan.entry.fail(
            f"the ways through it touch those through {crossings[second - len(segments)].name!r} near {place}; move"
            " them apart"
        )
    segments[second].street.entry.fail(
        f"{segments[second].label()} it runs over junction {crossing.name!r} without naming it; name it in the"
        f" course, keep away, or pass {HEADROOM:g} m above or below"
    )


def _samples(
    crossings: Sequence[Crossing],
    segments: Sequence[StreetSegment],
    centrelines: Sequence[Centreline],
    ways: Mapping[int, tuple[MovementPath, ...]],
) -> _Samples:
    """Returns the samples of all segments, then of all crossings: along the paths through them, and their centres."""
    rows = []  # each (n, 8): the attributes in their order

    def add(places: Array, along: Array, height: Array, *, half: float, pavement: float, owner: int) -> None:
        rest = np.tile((half, pavement, float(owner)), (len(places), 1))
        rows.append(np.column_stack((places, height, along, along[-1] - along, rest)))

    for k, (segment, centreline) in enumerate(zip(segments, centrelines, strict=True)):
        section = segment.section
        places, along = centreline.path.every(_CLEARANCE_SPACING, (section.right - section.left) / 2.0)
        half = (section.right + section.left) / 2.0
        add(places, along, centreline.heights.at(along), half=half, pavement=segment.street.sidewalk, owner=k)
    for k, crossing in enumerate(crossings, start=len(segments)):
        half = SMALLEST_RING_TRIM if crossing.on_ring else SMALLEST_TRIM
        height = np.full(1, crossing.height)
        add(np.array([crossing.centre]), np.zeros(1), height, half=half, pavement=0.0, owner=k)
        for way in ways[crossing.id]:
            places, along = way.path.every(_CLEARANCE_SPACING)
            half = way.movement.target.street.width / 2.0
            add(places, along, np.full(len(places), crossing.height), half=half, pavement=0.0, owner=k)
    table = np.concatenate(rows)
    return _Samples(
        points=table[:, :3],
        before=table[:, 3],
        after=table[:, 4],
        reach=table[:, 5],
        pavement=table[:, 6],
        owner=table[:, 7].astype(np.int64),
    )
