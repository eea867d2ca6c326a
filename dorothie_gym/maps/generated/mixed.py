"""Mixed plan: a regular extension beside an old town."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.generated.growth import between, curve, grow, prune, scatter, thin
from dorothie_gym.maps.generated.specification import TownSize
from dorothie_gym.maps.generated.street_graph import StreetGraph

if TYPE_CHECKING:
    import numpy as np

_LATTICE = {TownSize.SMALL: (3, 3), TownSize.MEDIUM: (3, 3), TownSize.LARGE: (4, 4)}
_PLACES = {TownSize.SMALL: 7, TownSize.MEDIUM: 17, TownSize.LARGE: 22}
_SPACING, _LONGEST = 84.0, 172.0  # [m]
_THINNED = {TownSize.SMALL: 1, TownSize.MEDIUM: 2, TownSize.LARGE: 4}


def draw_mixed(rng: np.random.Generator, size: TownSize) -> StreetGraph:
    """Returns the junctions and lines of a grid in the east and an old town in the west."""
    across, down = _LATTICE[size]
    column, row = between(rng, 88, 116), between(rng, 88, 116)
    graph = StreetGraph()
    for i in range(across):
        for j in range(down):
            x, y = 40 + i * column, round((j - (down - 1) / 2) * row)
            graph.places[i * down + j] = x + between(rng, -4, 4), y + between(rng, -4, 4)
            if i:
                graph.add((i - 1) * down + j, i * down + j)
            if j:
                graph.add(i * down + j - 1, i * down + j)
    half = (
        int(_SPACING * math.sqrt(0.62 * _PLACES[size] * 2)),
        int(_SPACING * math.sqrt(0.5 * _PLACES[size]) + 40),
    )
    taken = list(graph.places.values())
    found = scatter(rng, taken, half, _SPACING, 2 * _PLACES[size])
    for place in [p for p in found if p[0] < 0][: _PLACES[size]]:
        graph.places[len(graph.places)] = place
    grow(graph, _LONGEST)
    thin(graph, rng, between(rng, 0, _THINNED[size]))
    prune(graph)
    curve(graph, rng, share=0.3, depth=(0.05, 0.11))
    return graph
