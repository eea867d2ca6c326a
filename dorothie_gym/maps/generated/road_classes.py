"""Classes of the streets of a generated town: avenues, wide streets, pairs of one-way streets, and speed limits."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.generated.growth import shuffled
from dorothie_gym.maps.generated.specification import TownSize
from dorothie_gym.maps.generated.street_graph import turns_along
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    import numpy as np

    from dorothie_gym.maps.generated.named_streets import Chain
    from dorothie_gym.maps.generated.street_graph import StreetGraph
    from dorothie_gym.maps.generated.town_draft import StreetDraft, TownDraft

MEDIAN = 4
"""Width of the median of an avenue [m]."""
_AVENUES = {TownSize.SMALL: 0, TownSize.MEDIUM: 1, TownSize.LARGE: 2}
_AVENUE_BLOCK, _WIDE_BLOCK = 84.0, 76.0  # [m] shortest block of an avenue, and of another street of several lanes
_AVENUE_ANGLE, _WIDE_ANGLE = math.radians(66.0), math.radians(60.0)  # smallest angle to other streets
_SHORTEST_WIDE, _STRAIGHT = 240.0, math.radians(100.0)  # [m], and largest sum of changes of direction [rad]
_POCKET_BLOCK = 94.0  # [m] shortest block with left-turn lanes
_PARALLEL, _PAIR_DISTANCE, _SHORTEST_PAIR = math.radians(22.0), (60.0, 170.0), 190.0
_JUNCTION, _SMALLEST_RADIUS, _VISIBLE = 24.0, 16, math.radians(1.0)
"""Room of a junction [m], smallest radius of a bend that is set [m], and smallest change of direction [rad]."""
_SLOW, _SHORT = 30, 260.0
"""Speed limit of short streets [km/h], and their largest length [m]."""


def classify(town: TownDraft, rng: np.random.Generator, size: TownSize) -> None:
    """Draws lanes, medians, one-way streets and speed limits of the streets."""
    for _ in range(_AVENUES[size]):
        _widen(town, rng, median=True)
    if size is not TownSize.SMALL or rng.random() < 0.5:
        _widen(town, rng, median=False)
    if size is not TownSize.SMALL and rng.random() < 0.75:
        _pair(town, rng)
    for street in town.streets:
        if street.median:
            street.speed = town.speed + 10
        elif street.lanes == 1 and not street.one_way and street.chain.length(town.graph) < _SHORT:
            street.speed = _SLOW


def add_turn_lanes(town: TownDraft) -> None:
    """Opens left-turn lanes in the medians of avenues before junctions with lights, where the blocks are long."""
    for street in town.streets:
        if not street.median:
            continue
        chain, graph = street.chain, town.graph
        found = []
        for node in dict.fromkeys(chain.nodes):
            own = [k for k in chain.edges if node in (graph.edges[k].start, graph.edges[k].end)]
            crossed = len(graph.at(node)) > len(own) and len(own) > 1
            if node in town.lights and crossed and all(_first_leg(graph, k, node) >= _POCKET_BLOCK for k in own):
                found.append(node)
        street.turn_lanes = tuple(node for node in found if _turns_left(town, street, node))


def round_bends(town: TownDraft, radius: int) -> None:
    """Sets the radius of the bends of each street: a given one, or the largest that fits all of them."""
    for street in town.streets:
        fitting = [radius]
        for edge, node in zip(street.chain.edges, street.chain.nodes[:-1], strict=True):
            line = town.graph.points(edge, node)
            legs = [pm.dist(a, b) for a, b in itertools.pairwise(line)]
            rooms = [leg - _JUNCTION if k in (0, len(legs) - 1) else leg / 2.0 for k, leg in enumerate(legs)]
            for k, turn in enumerate(turns_along(line)):
                if turn > _VISIBLE:
                    fitting.append(int(min(rooms[k], rooms[k + 1]) / pm.tan(turn / 2.0)))
        if len(fitting) > 1 and min(fitting) >= _SMALLEST_RADIUS:
            street.radius = min(fitting)


def _turns_left(town: TownDraft, street: StreetDraft, node: int) -> bool:
    """Returns whether two-way streets cross an avenue, so that both of its directions turn left."""
    return all(not town.streets[k].one_way for k in town.streets_at(node)) and len(town.graph.at(node)) > 3


def _first_leg(graph: StreetGraph, edge: int, node: int) -> float:
    """Returns the length of a line, or 0 for one that bends near a junction [m]."""
    line = graph.points(edge, node)
    return graph.length(edge) if pm.dist(*line[:2]) > _POCKET_BLOCK / 2.0 else 0.0


def _widen(town: TownDraft, rng: np.random.Generator, *, median: bool) -> None:
    """Gives one of the long streets two lanes in each direction."""
    block, angle = (_AVENUE_BLOCK, _AVENUE_ANGLE) if median else (_WIDE_BLOCK, _WIDE_ANGLE)
    usable = [
        street
        for street in town.streets
        if street.lanes == 1
        and not street.one_way
        and _has_room(town.graph, street.chain, block, angle)
        and street.chain.length(town.graph) >= _SHORTEST_WIDE
        and sum(street.chain.turns(town.graph)) <= _STRAIGHT
    ]
    if usable:
        usable.sort(key=lambda street: _distance_from_centre(town.graph, street.chain))
        street = usable[int(rng.integers(min(2, len(usable))))]
        street.lanes, street.median = 2, MEDIAN if median else 0


def _distance_from_centre(graph: StreetGraph, chain: Chain) -> float:
    """Returns the smallest distance of a junction of a street from the middle of the town [m]."""
    middle = graph.middle()
    return min(pm.dist(graph.places[node], middle) for node in chain.nodes)


def _has_room(graph: StreetGraph, chain: Chain, block: float, angle: float) -> bool:
    """Returns whether the blocks along a street are long enough, and the angles to other streets large enough."""
    own = set(chain.edges)
    for k, (start, end) in zip(chain.edges, itertools.pairwise(chain.nodes), strict=True):
        line = graph.points(k)
        if min(pm.dist(a, b) for a, b in itertools.pairwise(line)) < block / 2.0 or graph.length(k) < block:
            return False
        for node in (start, end):
            others = [other for other in graph.at(node) if other not in own]
            if graph.gap(node, graph.heading(k, node), without=own) < angle and others:
                return False
    return True


# --- One-way pairs ----------------------------------------------------------------------------------------------------


def _pair(town: TownDraft, rng: np.random.Generator) -> None:
    """Makes two parallel streets of one lane one-way streets of two lanes, in opposite directions."""
    indices = range(len(town.streets))
    pairs = [(a, b) for a, b in itertools.combinations(indices, 2) if _are_parallel(town, a, b)]
    for number in shuffled(rng, range(len(pairs))):
        a, b = (town.streets[k] for k in pairs[number])
        before = a.chain, b.chain
        if pm.cos(_direction(town.graph, a.chain) - _direction(town.graph, b.chain)) > 0.0:
            b.chain = type(b.chain)(b.chain.nodes[::-1], b.chain.edges[::-1])
        a.one_way = b.one_way = True
        a.lanes = b.lanes = 2
        if is_strongly_connected(town):
            return
        a.one_way = b.one_way = False
        a.lanes = b.lanes = 1
        a.chain, b.chain = before


def _are_parallel(town: TownDraft, a: int, b: int) -> bool:
    first, second = town.streets[a], town.streets[b]
    for street in (first, second):
        if street.lanes > 1 or street.chain.is_ring or street.chain.length(town.graph) < _SHORTEST_PAIR:
            return False
    if set(first.chain.nodes) & set(second.chain.nodes):
        return False
    turn = abs(math.pi - abs(_direction(town.graph, first.chain) - _direction(town.graph, second.chain)) % math.pi)
    if min(turn, math.pi - turn) > _PARALLEL:
        return False
    distance = pm.dist(_middle(town.graph, first.chain), _middle(town.graph, second.chain))
    return _PAIR_DISTANCE[0] <= distance <= _PAIR_DISTANCE[1]


def _direction(graph: StreetGraph, chain: Chain) -> float:
    (x, y), (u, v) = graph.places[chain.nodes[0]], graph.places[chain.nodes[-1]]
    return pm.atan2(float(v - y), float(u - x))


def _middle(graph: StreetGraph, chain: Chain) -> tuple[float, float]:
    (x, y), (u, v) = graph.places[chain.nodes[0]], graph.places[chain.nodes[-1]]
    return (x + u) / 2.0, (y + v) / 2.0


def is_strongly_connected(town: TownDraft) -> bool:
    """Returns whether every direction of every street leads to all others without a U-turn."""
    ways = [(k, node) for street in town.streets for k, node in _ways_of(street)]  # line, and junction that it leads to
    onward: dict[tuple[int, int], list[tuple[int, int]]] = {way: [] for way in ways}
    back: dict[tuple[int, int], list[tuple[int, int]]] = {way: [] for way in ways}
    for way, following in itertools.product(ways, ways):
        if way[0] != following[0] and town.graph.edges[following[0]].far(following[1]) == way[1]:
            onward[way].append(following)
            back[following].append(way)
    return all(_reached(ways[0], links) == len(ways) for links in (onward, back))


def _ways_of(street: StreetDraft) -> list[tuple[int, int]]:
    chain = street.chain
    forward = list(zip(chain.edges, chain.nodes[1:], strict=True))
    return forward if street.one_way else forward + list(zip(chain.edges, chain.nodes[:-1], strict=True))


def _reached(start: tuple[int, int], links: dict[tuple[int, int], list[tuple[int, int]]]) -> int:
    found, queue = {start}, [start]
    while queue:
        for way in links[queue.pop()]:
            if way not in found:
                found.add(way)
                queue.append(way)
    return len(found)
