"""Streets of a generated town: lines that continue each other across junctions, and their names."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dorothie_gym.maps.generated.street_graph import turns_along
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    import numpy as np

    from dorothie_gym.maps.generated.street_graph import StreetGraph

MOST_STREETS = 14
"""Largest number of streets, with the rings of roundabouts: a session has as many names."""
_CORNER = math.radians(58.0)
"""Change of direction of which a street has at most one, where there are few enough streets [rad]."""
_SMALLEST_RING = 4
"""Smallest number of lines of a street that ends where it begins."""
_STRAIGHT_ON = math.radians(50.0)
"""Largest change of direction at which lines are one street where there are few enough [rad]."""


@dataclass(frozen=True)
class Chain:
    """Street: junctions in order, and the lines between them; the first junction is also the last one of a ring."""

    nodes: tuple[int, ...]
    edges: tuple[int, ...]

    @property
    def is_ring(self) -> bool:
        """Whether it ends where it begins."""
        return self.nodes[0] == self.nodes[-1]

    def length(self, graph: StreetGraph) -> float:
        """Returns its length [m]."""
        return sum(graph.length(k) for k in self.edges)

    def turns(self, graph: StreetGraph) -> list[float]:
        """Returns the changes of direction along it, at bends and junctions [rad]."""
        pieces = zip(self.edges, self.nodes[:-1], strict=True)
        line = [point for edge, start in pieces for point in graph.points(edge, start)[:-1]]
        return turns_along([*line, graph.places[self.nodes[-1]]])


def join_streets(graph: StreetGraph, most: int = MOST_STREETS) -> list[Chain]:
    """Joins lines to streets: the most straight continuations first, then others while there are too many streets.

    A street visits no junction twice, unless it is a ring.

    Args:
        graph: the town.
        most: largest number of streets.

    Returns:
        The streets, longest first; more than `most` if they cannot be joined.
    """
    chains = {k: Chain((edge.start, edge.end), (k,)) for k, edge in sorted(graph.edges.items())}
    used: set[tuple[int, int]] = set()  # (junction, line) where a street continues
    continuations = _continuations(graph)
    straight = [each for each in continuations if each[0] <= _STRAIGHT_ON]
    for strict, choice in ((True, straight), (False, continuations)):
        for _, node, first, second in choice:
            if not strict and len(set(chains.values())) <= most:
                break
            if (node, first) in used or (node, second) in used:
                continue
            joined = _joined(chains[first], chains[second], node)
            if joined is None or (strict and sum(turn > _CORNER for turn in joined.turns(graph)) > 1):
                continue
            used |= {(node, first), (node, second)}
            chains.update(dict.fromkeys(joined.edges, joined))
    return sorted(set(chains.values()), key=lambda chain: (-chain.length(graph), chain.edges))


def _continuations(graph: StreetGraph) -> list[tuple[float, int, int, int]]:
    """Returns change of direction [rad], junction and both lines of all continuations, most straight first."""
    return sorted(
        (abs(wrap_radians(graph.heading(a, node) - graph.heading(b, node) - math.pi)), node, a, b)
        for node in graph.places
        for a, b in itertools.combinations(sorted(graph.at(node)), 2)
    )


def _joined(first: Chain, second: Chain, node: int) -> Chain | None:
    """Returns two streets as one, or None if it would visit a junction twice; a ring ends where it begins."""
    if first is second or first.is_ring or second.is_ring:
        return None
    common = set(first.nodes) & set(second.nodes)
    ends = {first.nodes[0], first.nodes[-1]}
    if common != {node} and not (common == ends == {second.nodes[0], second.nodes[-1]} and _makes_ring(first, second)):
        return None
    head = first if first.nodes[-1] == node else Chain(first.nodes[::-1], first.edges[::-1])
    tail = second if second.nodes[0] == node else Chain(second.nodes[::-1], second.edges[::-1])
    return Chain(head.nodes + tail.nodes[1:], head.edges + tail.edges)


def _makes_ring(first: Chain, second: Chain) -> bool:
    return len(first.edges) + len(second.edges) >= _SMALLEST_RING


# --- Names ------------------------------------------------------------------------------------------------------------

_STEMS = (
    "Abbey", "Alder", "Bank", "Barley", "Beacon", "Birch", "Bridge", "Castle", "Cedar", "Chapel", "Cherry", "Church",
    "Clay", "College", "Cooper", "Corn", "Cross", "Dove", "Elm", "Fair", "Ferry", "Field", "Forge", "Garden",
    "Granary", "Green", "Hazel", "Heron", "Hill", "Ivy", "King", "Lake", "Linden", "Malt", "Maple", "Market",
    "Meadow", "Mill", "Mint", "Minster", "Oak", "Orchard", "Park", "Pine", "Pond", "Priory", "Quarry", "Queen",
    "River", "Rose", "Saddler", "School", "Smith", "South", "Station", "Swan", "Tanner", "Temple", "Thorn", "Tower",
    "Vine", "Wall", "Water", "Weaver", "Well", "Willow", "Wood", "York",
)  # fmt: skip
_LANE, _ROAD = 230.0, 420.0
"""Lengths below which a street is a lane, and below which it is a street [m]."""


def draw_names(rng: np.random.Generator, lengths: Sequence[float], avenues: Iterable[int]) -> list[str]:
    """Draws different names for streets.

    Args:
        rng: source of random numbers.
        lengths: length of each street [m].
        avenues: indices of the avenues.
    """
    stems = [_STEMS[int(k)] for k in rng.permutation(len(_STEMS))[: len(lengths)]]
    kinds = [_kind(rng, k in set(avenues), length) for k, length in enumerate(lengths)]
    return [f"{stem} {kind}" for stem, kind in zip(stems, kinds, strict=True)]


def _kind(rng: np.random.Generator, avenue: bool, length: float) -> str:
    draw = float(rng.random())
    if avenue:
        return "Avenue"
    if length < _LANE:
        return "Lane" if draw < 0.6 else "Row"
    return "Road" if length > _ROAD and draw < 0.7 else "Street"
