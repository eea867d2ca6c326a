"""Radial plan: avenues from a central circus, and rings around it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.generated.growth import between, curve, shuffled
from dorothie_gym.maps.generated.specification import TownSize
from dorothie_gym.maps.generated.street_graph import StreetGraph, whole
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    import numpy as np

_SPOKES = {TownSize.SMALL: (4, 4), TownSize.MEDIUM: (5, 6), TownSize.LARGE: (6, 7)}
_RINGS = {TownSize.SMALL: 2, TownSize.MEDIUM: 2, TownSize.LARGE: 3}
_FIRST_RING, _NEXT_RING = (108, 126), (88, 112)  # [m] radius of the first ring, and distance of the next ones


def draw_radial(rng: np.random.Generator, size: TownSize) -> StreetGraph:
    """Returns the junctions and lines of a town around its centre, junction 0."""
    spokes, rings = between(rng, *_SPOKES[size]), _RINGS[size]
    step, turn = 2.0 * math.pi / spokes, math.radians(float(between(rng, 0, 89)))
    graph = StreetGraph(places={0: (0, 0)})
    radii = [between(rng, *_FIRST_RING)]
    radii += [0] * (rings - 1)
    for ring in range(1, rings):
        radii[ring] = radii[ring - 1] + between(rng, *_NEXT_RING)
    stretch = between(rng, 82, 100) / 100.0
    for spoke in range(spokes):
        angle = turn + spoke * step + math.radians(float(between(rng, -5, 5)))
        for ring, radius in enumerate(radii):
            r = radius + between(rng, -7, 7)
            graph.places[1 + ring * spokes + spoke] = whole(r * pm.cos(angle), stretch * r * pm.sin(angle))
    for spoke in range(spokes):
        graph.add(0, 1 + spoke)
        for ring in range(rings - 1):
            graph.add(1 + ring * spokes + spoke, 1 + (ring + 1) * spokes + spoke)
    rim: dict[int, list[int]] = {}
    for ring in range(rings):
        rim[ring] = [
            graph.add(1 + ring * spokes + spoke, 1 + ring * spokes + (spoke + 1) % spokes) for spoke in range(spokes)
        ]
    _round(graph, rim)
    _open(graph, rng, rim[rings - 1] if rings > 2 else [])
    graph.clean()
    curve(graph, rng, share=0.25, depth=(0.04, 0.08), without=graph.at(0))
    return graph


def _round(graph: StreetGraph, rim: dict[int, list[int]]) -> None:
    """Bends the lines of rings outwards."""
    for lines in rim.values():
        for k in lines:
            edge = graph.edges[k]
            (x, y), (u, v) = graph.places[edge.start], graph.places[edge.end]
            chord = pm.hypot(float(u - x), float(v - y))
            mx, my = (x + u) / 2.0, (y + v) / 2.0
            out = pm.hypot(mx, my)
            depth = 0.11 * chord
            graph.edges[k] = type(edge)(edge.start, edge.end, (whole(mx * (1 + depth / out), my * (1 + depth / out)),))


def _open(graph: StreetGraph, rng: np.random.Generator, outer: list[int]) -> None:
    """Removes one or two lines of the outer ring of a large town, whose spokes then end there."""
    for k in shuffled(rng, outer)[: between(rng, 0, 2)]:
        edge, degrees = graph.edges[k], graph.degrees()
        del graph.edges[k]
        if min(degrees[edge.start], degrees[edge.end]) < 3 or any(graph.is_bridge(other) for other in graph.edges):
            graph.edges[k] = edge
