"""Organic plan: an old main street, and lanes that grew around it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.generated.growth import between, curve, grow, prune, scatter, thin
from dorothie_gym.maps.generated.specification import TownSize
from dorothie_gym.maps.generated.street_graph import GridPoint, StreetGraph

if TYPE_CHECKING:
    import numpy as np

_PLACES = {TownSize.SMALL: 18, TownSize.MEDIUM: 29, TownSize.LARGE: 40}
"""Number of places from which junctions and bends grow."""
_SPACING = 84.0  # [m] smallest distance of two places
_LONGEST = 190.0  # [m] longest line
_THINNED = {TownSize.SMALL: 1, TownSize.MEDIUM: 3, TownSize.LARGE: 6}


def draw_organic(rng: np.random.Generator, size: TownSize) -> StreetGraph:
    """Returns the junctions and lines of a town that grew along a main street."""
    count = _PLACES[size]
    # a place takes about 0.8 of the square of its distance to the next one in a random packing
    half_width = int(_SPACING * math.sqrt(0.62 * count))
    half = half_width, int(half_width * between(rng, 62, 90) / 100)
    street = _main_street(rng, half_width)
    graph = StreetGraph(places=dict(enumerate(street)))
    for k in range(len(street) - 1):
        graph.add(k, k + 1)
    for place in scatter(rng, street, half, _SPACING, count - len(street)):
        graph.places[len(graph.places)] = place
    grow(graph, _LONGEST)
    thin(graph, rng, between(rng, 0, _THINNED[size]))
    prune(graph)
    curve(graph, rng, share=0.55, depth=(0.05, 0.13))
    return graph


def _main_street(rng: np.random.Generator, half_width: int) -> list[GridPoint]:
    """Returns the junctions of the main street, from west to east with a gentle bend [m]."""
    x, y, slope = -half_width, between(rng, -20, 20), between(rng, -25, 25)
    places = []
    while x <= half_width:
        places.append((x, y))
        slope = max(-45, min(45, slope + between(rng, -18, 18)))
        x, y = x + between(rng, 88, 120), y + slope
    return places
