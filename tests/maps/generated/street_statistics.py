"""Statistics of street networks as in Boeing (2017, 2019): degrees, lengths, circuity and entropy of orientations."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from statistics import mean
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from dorothie_gym.maps.yaml.layout import Layout
    from dorothie_gym.maps.yaml.segments import StreetSegment

BINS = 36


@dataclass(frozen=True, kw_only=True)
class StreetStatistics:
    """Statistics of a street network, in which a roundabout is one junction.

    Attributes:
        degree: mean number of streets that meet at a junction.
        four_way: share of junctions of four streets or more.
        block: mean length of the streets between two junctions [m].
        longest: largest of these lengths [m].
        circuity: sum of the lengths, relative to the sum of the straight distances.
        entropy: entropy of the bearings, of both directions, in 36 bins [nat]; at most 3.584.
    """

    degree: float
    four_way: float
    block: float
    longest: float
    circuity: float
    entropy: float


def street_statistics(layout: Layout) -> StreetStatistics:
    """Returns the statistics of a town."""
    segments = [segment for segment in layout.segments if segment.arc is None]
    ends = Counter(crossing.plan.id for segment in segments for crossing in (segment.start, segment.end))
    lengths = [_length(segment) for segment in segments]
    straight = [math.dist(segment.start.plan.centre, segment.end.plan.centre) for segment in segments]
    return StreetStatistics(
        degree=mean(ends.values()),
        four_way=sum(count >= 4 for count in ends.values()) / len(ends),
        block=mean(lengths),
        longest=max(lengths),
        circuity=sum(lengths) / sum(straight),
        entropy=_entropy(segments),
    )


def _length(segment: StreetSegment) -> float:
    points = [segment.start.plan.centre, *segment.corners[1:-1], segment.end.plan.centre]
    return sum(math.dist(a, b) for a, b in pairwise(points))


def _entropy(segments: list[StreetSegment]) -> float:
    """Returns the entropy of the bearings; bins are centred on the compass points, as in OSMnx."""
    places = np.array([(*segment.start.plan.centre, *segment.end.plan.centre) for segment in segments])
    bearing = np.degrees(np.arctan2(places[:, 2] - places[:, 0], places[:, 1] - places[:, 3]))
    both = (np.concatenate((bearing, bearing + 180.0)) + 180.0 / BINS) % 360.0
    counts = np.histogram(both, bins=BINS, range=(0.0, 360.0))[0]
    shares = counts[counts > 0] / counts.sum()
    return float(-(shares * np.log(shares)).sum())
