"""Draws places for landmarks that lie apart, so that one stop does not serve two."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dorothie_gym.tasks.storyboard import Place

# A stop counts within 2 m of a waypoint (paper, appendix "Interface Components"); this leaves room for queues too.
SPACING = 15.0
"""Distance that two landmarks keep from one another where the town has the places for it [m]."""


def spread_places(places: Sequence[Place], count: int, rng: np.random.Generator) -> list[Place]:
    """Draws places, first those on lanes of their own that keep `SPACING`, then those that keep it, then the farthest.

    Args:
        places: places to draw from; at least `count`.
        count: how many to draw.
        rng: decides in which order the places are tried.

    Returns:
        Distinct places, best spread first.
    """
    shuffled = [places[k] for k in rng.permutation(len(places))]
    chosen: list[Place] = []
    for fresh_lane in (True, False):
        for place in tuple(shuffled):
            lane_is_taken = fresh_lane and any(place.lane == other.lane for other in chosen)
            if len(chosen) < count and not lane_is_taken and _gap(place, chosen) >= SPACING:
                chosen.append(place)
                shuffled.remove(place)
    while len(chosen) < count:
        farthest = max(range(len(shuffled)), key=lambda k: _gap(shuffled[k], chosen))
        chosen.append(shuffled.pop(farthest))
    return chosen


def _gap(place: Place, others: Sequence[Place]) -> float:
    """Distance to the closest of the others, between the landmarks or between their waypoints [m]."""
    return min(
        (min(math.dist(place.position, other.position), math.dist(place.waypoint, other.waypoint)) for other in others),
        default=math.inf,
    )
