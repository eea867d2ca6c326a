"""Growth of street plans: lines between given junctions, removal of some, and bends."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.generated.street_graph import GridPoint, StreetGraph, turns_along, whole
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.generated.specification import TownSize

SMALLEST_ANGLE = math.radians(54.0)
"""Smallest angle between two lines at a junction before lines are bent [rad]."""
BENT_ANGLE = math.radians(50.0)
"""The same after lines are bent [rad]."""
SHARPEST_CORNER = math.radians(102.0)
"""Largest change of direction at a bend [rad], if there is a choice."""
BLOCK = 34.0
"""Smallest distance between the centre lines of two streets away from their junctions [m]."""
MOST_ARMS = 4
"""Largest number of streets that meet at a junction."""
_AROUND = 48.0  # [m] from a junction within which its streets are close to each other
_LONGEST_STRAIGHT = 75.0  # [m] beyond which a street may be bent

Drawer = Callable[[np.random.Generator, "TownSize"], StreetGraph]
"""Function that draws the junctions and lines of a style."""


def shuffled(rng: np.random.Generator, items: Iterable[int]) -> list[int]:
    """Returns items in a random order."""
    found = list(items)
    return [found[int(k)] for k in rng.permutation(len(found))]


def between(rng: np.random.Generator, low: int, high: int) -> int:
    """Returns a random whole number from `low` to `high`."""
    return int(rng.integers(low, high + 1))


def fits(graph: StreetGraph, start: int, end: int, least: float = SMALLEST_ANGLE) -> bool:
    """Returns whether a straight line may be added: at an angle to the lines at both ends, and clear of all others."""
    a, b = graph.places[start], graph.places[end]
    heading = pm.atan2(float(b[1] - a[1]), float(b[0] - a[0]))
    if min(graph.gap(start, heading), graph.gap(end, wrap_radians(heading + math.pi))) < least:
        return False
    return graph.clearance((a, b), around=_AROUND) >= BLOCK


def grow(graph: StreetGraph, longest: float) -> None:
    """Adds lines between junctions, shortest first, as long as they fit.

    Args:
        graph: junctions, possibly with lines.
        longest: largest length of a line [m].
    """
    nodes = sorted(graph.places)
    pairs = [(pm.dist(graph.places[a], graph.places[b]), a, b) for a in nodes for b in nodes if a < b]
    linked = {frozenset((edge.start, edge.end)) for edge in graph.edges.values()}
    degrees = graph.degrees()
    for distance, a, b in sorted(pairs):
        if distance > longest or frozenset((a, b)) in linked or max(degrees[a], degrees[b]) >= MOST_ARMS:
            continue
        if fits(graph, a, b):
            graph.add(a, b)
            degrees[a] += 1
            degrees[b] += 1


def thin(graph: StreetGraph, rng: np.random.Generator, count: int) -> None:
    """Removes some lines inside the town, which makes larger blocks; the town stays connected twice.

    Args:
        graph: the town.
        rng: source of random numbers.
        count: largest number of lines to remove.
    """
    for k in shuffled(rng, sorted(graph.edges)):
        if count == 0:
            break
        if k not in graph.edges:
            continue
        edge, degrees = graph.edges[k], graph.degrees()
        if min(degrees[edge.start], degrees[edge.end]) < MOST_ARMS:
            continue
        del graph.edges[k]
        if any(graph.is_bridge(other) for other in graph.edges):
            graph.edges[k] = edge
        else:
            count -= 1


def prune(graph: StreetGraph) -> None:
    """Removes what no town has: dead ends, parts behind a single line, bulges, and needless sharp corners."""
    graph.clean()
    _connect_twice(graph)
    _drop_twins(graph)
    _drop_corners(graph)


def _connect_twice(graph: StreetGraph) -> None:
    """Removes lines without which a part would be cut off, and the smaller of both parts."""
    while bridge := next((k for k in sorted(graph.edges) if graph.is_bridge(k)), None):
        del graph.edges[bridge]
        graph.clean()


def _drop_twins(graph: StreetGraph) -> None:
    """Removes the longer of two lines between the same junctions, which encloses nothing but a bulge."""
    for k in sorted(graph.edges, key=graph.length, reverse=True):
        edge = graph.edges[k]
        if any(other != k and {edge.start, edge.end} == {twin.start, twin.end} for other, twin in graph.edges.items()):
            del graph.edges[k]
            graph.clean()
            _drop_twins(graph)
            return


def _drop_corners(graph: StreetGraph) -> None:
    """Removes lines with a sharp corner without which the town stays connected twice."""
    for k in sorted(graph.edges):
        if k in graph.edges and _sharpest(graph.points(k)) > SHARPEST_CORNER:
            edge = graph.edges.pop(k)
            if len(graph.edges) == 0 or any(graph.is_bridge(other) for other in graph.edges):
                graph.edges[k] = edge
    graph.clean()


def _sharpest(line: Sequence[GridPoint]) -> float:
    """Returns the largest change of direction along a line [rad]."""
    return max(turns_along(line), default=0.0)


def curve(
    graph: StreetGraph, rng: np.random.Generator, share: float, depth: tuple[float, float], without: Iterable[int] = ()
) -> None:
    """Bends straight lines to one side.

    Args:
        graph: the town.
        rng: source of random numbers.
        share: share of the lines that are bent if there is room.
        depth: smallest and largest distance of the bend from the straight line, relative to its length.
        without: lines that stay straight.
    """
    for k in sorted(set(graph.edges) - set(without)):
        wanted, side, relative = rng.random() < share, 1.0 - 2.0 * float(rng.random() < 0.5), rng.random()
        if not wanted or graph.edges[k].bends or graph.length(k) < _LONGEST_STRAIGHT:
            continue
        aside = side * (depth[0] + (depth[1] - depth[0]) * relative)
        for offset in (aside, -aside):
            if bend(graph, k, offset):
                break


def bend(graph: StreetGraph, number: int, aside: float) -> bool:
    """Bends a straight line in its middle if there is room; `aside` is relative to its length. Returns whether."""
    edge = graph.edges[number]
    (x, y), (u, v) = a, b = graph.places[edge.start], graph.places[edge.end]
    middle = whole((x + u) / 2.0 - aside * (v - y), (y + v) / 2.0 + aside * (u - x))
    line = (a, middle, b)
    for node, first in ((edge.start, a), (edge.end, b)):
        heading = pm.atan2(float(middle[1] - first[1]), float(middle[0] - first[0]))
        if graph.gap(node, heading, without=(number,)) < BENT_ANGLE:
            return False
    if graph.clearance(line, without=(number,), around=_AROUND) < BLOCK:
        return False
    graph.edges[number] = type(edge)(edge.start, edge.end, (middle,))
    return True


def scatter(
    rng: np.random.Generator, taken: Sequence[GridPoint], half: tuple[int, int], spacing: float, count: int
) -> list[GridPoint]:
    """Returns up to `count` random places in an ellipse, apart from each other and from places that are taken.

    Args:
        rng: source of random numbers.
        taken: places that are taken [m].
        half: half axes of the ellipse [m].
        spacing: smallest distance between two places [m].
        count: number of places.
    """
    found: list[GridPoint] = []
    for _ in range(60 * count):
        x, y = between(rng, -half[0], half[0]), between(rng, -half[1], half[1])
        if (x / half[0]) ** 2 + (y / half[1]) ** 2 > 1.0:
            continue
        if all(pm.dist((x, y), other) >= spacing for other in (*taken, *found)):
            found.append((x, y))
            if len(found) == count:
                break
    return found
