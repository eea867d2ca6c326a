"""Junctions of a generated town: roundabouts, streets that pass above others, lights, signs and crosswalks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.generated.growth import between, shuffled
from dorothie_gym.maps.generated.specification import TownSize, TownStyle
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    import numpy as np

    from dorothie_gym.maps.generated.street_graph import StreetGraph
    from dorothie_gym.maps.generated.town_draft import TownDraft

# --- Roundabouts ------------------------------------------------------------------------------------------------------

RING_ARC = 37.0
"""Distance of two streets along the ring of a roundabout [m]."""
_SMALLEST_RING, _LARGEST_RING = 18, 40  # [m] radius
_RING_BLOCK, _JUNCTION = 50.0, 14.0  # [m] shortest distance from the ring to the next junction, and radius of that one
_RINGS = {TownSize.SMALL: 1, TownSize.MEDIUM: 1, TownSize.LARGE: 2}
_CIRCUS = ("Circus", "Round", "Cross")


def round_junctions(graph: StreetGraph, rng: np.random.Generator, size: TownSize, style: TownStyle) -> dict[int, int]:
    """Draws the roundabouts of a town; returns the radius of each ring [m], by junction."""
    found: dict[int, int] = {}
    if style is TownStyle.RADIAL:
        found[0] = _radius(graph, 0)
    wanted = between(rng, 0, _RINGS[size])
    for node in shuffled(rng, sorted(graph.places)):
        if len(found) >= wanted + (style is TownStyle.RADIAL):
            break
        radius = _radius(graph, node)
        if node not in found and radius <= _LARGEST_RING and _has_ring_room(graph, node, radius, found):
            found[node] = radius
    return found


def _radius(graph: StreetGraph, node: int) -> int:
    return max(_SMALLEST_RING, math.ceil(RING_ARC / graph.smallest_gap(node)))


def _has_ring_room(graph: StreetGraph, node: int, radius: int, others: dict[int, int]) -> bool:
    for k in graph.at(node):
        far = graph.edges[k].far(node)
        room = pm.dist(*graph.points(k, node)[:2]) - radius - _JUNCTION
        if far in others or room < _RING_BLOCK or graph.edges[k].bends:
            return False
    return True


def ring_names(rng: np.random.Generator, count: int) -> list[str]:
    """Draws different names for roundabouts."""
    stems = [("Royal", "Crown", "Poplar", "Liberty", "Harbour")[int(k)] for k in rng.permutation(5)[:count]]
    return [f"{stem} {_CIRCUS[int(rng.integers(len(_CIRCUS)))]}" for stem in stems]


# --- Grade separation -------------------------------------------------------------------------------------------------

_UNDER, _OVER = -5.0, 5.5
"""Height of a street that dives under another, and of one that passes over it [m]."""
_SEPARATED_BLOCK = 106.0  # [m] shortest block before a bridge or tunnel: both slopes stay below 12 %
_LEVEL = 15.0  # [m] length at this height on either side of the other street
_STRAIGHT = math.radians(12.0)
_SEPARATED_SHARE = {TownSize.SMALL: 0.25, TownSize.MEDIUM: 0.5, TownSize.LARGE: 0.75}


def separate(
    graph: StreetGraph, rng: np.random.Generator, size: TownSize, taken: dict[int, int]
) -> dict[tuple[int, int], float]:
    """Leads one street over or under another where they crossed; the junction disappears.

    Args:
        graph: the town.
        rng: source of random numbers.
        size: size of the town.
        taken: junctions that remain.

    Returns:
        Heights of points [m]; empty if no junction is suitable, or none is drawn.
    """
    if rng.random() >= _SEPARATED_SHARE[size]:
        return {}
    height = _UNDER if rng.random() < 0.5 else _OVER
    for node in shuffled(rng, sorted(graph.places)):
        if node in taken:
            continue
        for passing, other in _crossing_pairs(graph, node):
            if all(graph.length(k) >= _SEPARATED_BLOCK and not graph.edges[k].bends for k in passing):
                return _pass(graph, node, passing, other, height)
    return {}


def _crossing_pairs(graph: StreetGraph, node: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Returns both orders of the two straight pairs of lines at a junction of four, or nothing."""
    lines = sorted(graph.at(node), key=lambda k: graph.heading(k, node))
    if len(set(lines)) != 4 or any(len(set(graph.at(graph.edges[k].far(node)))) < 3 for k in lines):
        return []
    one, other = (lines[0], lines[2]), (lines[1], lines[3])
    for a, b in (one, other):
        if abs(wrap_radians(graph.heading(a, node) - graph.heading(b, node) - math.pi)) > _STRAIGHT:
            return []
    return [(one, other), (other, one)]


def _pass(
    graph: StreetGraph, node: int, passing: tuple[int, int], other: tuple[int, int], height: float
) -> dict[tuple[int, int], float]:
    place = graph.places[node]
    level = []
    for k in passing:
        heading = graph.heading(k, node)
        level.append(
            (
                math.floor(place[0] + _LEVEL * pm.cos(heading) + 0.5),
                math.floor(place[1] + _LEVEL * pm.sin(heading) + 0.5),
            )
        )
    rest = [
        point
        for points in (graph.points(other[0], graph.edges[other[0]].far(node))[1:], graph.points(other[1], node)[1:-1])
        for point in points
    ]
    graph.join_at(node, *passing, level)
    graph.join_at(node, *other, rest)
    del graph.places[node]
    return dict.fromkeys(level, height)


# --- Lights, signs and crosswalks -------------------------------------------------------------------------------------

_LIT_CROSSING, _LIT_JUNCTION, _LIT_LANES = 0.45, 0.12, 0.8
"""Share of junctions with lights: of four arms, of three arms, and of streets with several lanes that cross."""
_STOP, _YIELD = 0.4, 0.45
"""Share of the other junctions with stop signs, and with yield signs if no street has several lanes."""
_OFFSETS = (0, 30)  # [s]
_CROSSWALK_LIT, _CROSSWALK = 0.6, 0.22


def control(town: TownDraft, rng: np.random.Generator) -> None:
    """Draws lights, signs and crosswalks of all junctions without a ring."""
    for node in sorted(town.graph.places):
        if node in town.roundabouts:
            continue
        streets = sorted(town.streets_at(node), key=lambda k: town.streets[k].rank, reverse=True)
        arms = len(town.graph.at(node))
        wide = town.streets[streets[0]].lanes > 1
        share = _LIT_LANES if wide and arms > 3 else _LIT_CROSSING if arms > 3 or wide else _LIT_JUNCTION
        draw, sign, offset = float(rng.random()), float(rng.random()), between(rng, *_OFFSETS)
        if draw < share:
            town.lights[node] = offset
        else:
            _sign(town, node, streets, sign, wide=wide)
        for k in streets:
            if rng.random() < (_CROSSWALK_LIT if node in town.lights else _CROSSWALK):
                town.crosswalks.append((node, k))


def _sign(town: TownDraft, node: int, streets: list[int], draw: float, *, wide: bool) -> None:
    """Gives the minor streets of a junction stop signs or yield signs; without them, the right has priority."""
    if len(streets) < 2:
        return
    minor = [k for k in streets[1:] if _leads_to(town, k, node)]
    if draw < _STOP:
        town.stops.extend((node, k) for k in minor)
    elif draw < _STOP + _YIELD or wide:
        town.yields.extend((node, k) for k in minor)


def _leads_to(town: TownDraft, k: int, node: int) -> bool:
    """Returns whether a street leads to a junction: a one-way street only leaves its first one."""
    street = town.streets[k]
    return not street.one_way or node in street.chain.nodes[1:]
