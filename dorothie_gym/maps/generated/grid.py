"""Grid plan: parallel streets of uneven distances, with some blocks joined."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.generated.growth import between, curve, thin
from dorothie_gym.maps.generated.specification import TownSize
from dorothie_gym.maps.generated.street_graph import StreetGraph, whole
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    import numpy as np

_LINES = {TownSize.SMALL: ((4, 3), (4, 3)), TownSize.MEDIUM: ((5, 4), (4, 5)), TownSize.LARGE: ((6, 5), (6, 6))}
"""Numbers of lines in both directions, one of which is drawn."""
_THINNED = {TownSize.SMALL: 1, TownSize.MEDIUM: 2, TownSize.LARGE: 3}
_NARROWEST, _WIDEST = 84, 128  # [m] distances of parallel streets
_JITTER = 7  # [m] by which a junction lies off its line


def draw_grid(rng: np.random.Generator, size: TownSize) -> StreetGraph:
    """Returns the junctions and lines of a grid, turned by up to 30 degrees."""
    options = _LINES[size]
    across, down = options[int(rng.integers(len(options)))]
    columns, rows = ([0, *(between(rng, _NARROWEST, _WIDEST) for _ in range(n - 1))] for n in (across, down))
    turn = math.radians(float(between(rng, -30, 30)))
    lean = float(between(rng, -12, 12)) / 100.0
    graph = StreetGraph()
    for i in range(across):
        for j in range(down):
            x, y = float(sum(columns[: i + 1])), float(sum(rows[: j + 1]))
            x, y = x + lean * y + between(rng, -_JITTER, _JITTER), y + between(rng, -_JITTER, _JITTER)
            graph.places[i * down + j] = whole(x * pm.cos(turn) - y * pm.sin(turn), x * pm.sin(turn) + y * pm.cos(turn))
    for i in range(across):
        for j in range(down):
            if i + 1 < across:
                graph.add(i * down + j, (i + 1) * down + j)
            if j + 1 < down:
                graph.add(i * down + j, i * down + j + 1)
    thin(graph, rng, between(rng, 0, _THINNED[size]))
    graph.clean()
    curve(graph, rng, share=0.12, depth=(0.05, 0.1))
    return graph
