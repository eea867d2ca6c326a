"""Scratch space and results of route searches in arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.routing_graph import RoutingEdge, RoutingGraph
from dorothie_gym.support.compilation.records import (
    Float,
    Int32,
    RecordArray,
    argument,
    by_reference,
    empty_records,
    filled_records,
)


class PlaceRecord:
    """A lane and a station on it [m]."""

    station: Float
    lane: Int32


class LegRecord:
    """A lane of a route: how it is entered (`LANE_ENTRIES`), and the stations between which it is driven [m]."""

    start: Float
    end: Float
    lane: Int32
    entry: Int32


class SearchNode:
    """A node during a search: its cost so far [m], and the edge by which it is reached."""

    cost: Float
    edge: Int32  # row of `RoutingGraph.edges`, or, counting on from those, of `RouteSearch.extra`
    place: Int32  # place in the heap; -1: not reached yet, -2: settled
    arrival: Int32  # row of `RouteSearch.extra` that leads from here to the goal, or -1


class HeapEntry:
    """A node in the heap of a search, with its cost so far [m]."""

    cost: Float
    node: Int32


class SearchResult:
    """Outcome of a search."""

    cost: Float  # [m at 40 km/h]
    extra: Int32  # number of edges from the start and to the goal
    steps: Int32  # number of edges of the route
    legs: Int32  # number of its legs


UNREACHED, SETTLED = -1, -2


@by_reference
class RouteSearch(NamedTuple):
    """Scratch space and result of route searches in a town, one search at a time.

    Attributes:
        nodes: nodes of the graph.
        heap: nodes that are reached and not settled, as a binary heap.
        closed: which nodes are closed by roadblocks; all False between searches.
        extra: edges from the start and to the goal.
        path: edges of the route in order, numbered as in `SearchNode.edge`.
        driven: length of the lane change or U-turn of each edge of the route, else 0 [m].
        legs: legs of the route.
        result: (1,) numbers of the rows in use, and the cost.
    """

    nodes: RecordArray[SearchNode]
    heap: RecordArray[HeapEntry]
    closed: NDArray[np.bool_]
    extra: RecordArray[RoutingEdge]
    path: NDArray[np.int32]
    driven: Array
    legs: RecordArray[LegRecord]
    result: RecordArray[SearchResult]


_NO_PLACES = argument(empty_records(PlaceRecord, 1))


def place_records(places: Sequence[tuple[int, float]]) -> RecordArray[PlaceRecord]:
    """Returns places as records; a single record of zeros if there are none."""
    if not places:
        return _NO_PLACES
    return argument(filled_records(PlaceRecord, [(station, lane) for lane, station in places]))


def empty_search(graph: RoutingGraph) -> RouteSearch:
    """Returns the scratch space for searches in a town."""
    count = graph.nodes
    out = int(np.diff(graph.rows).max(initial=0))
    into = int(np.diff(graph.manoeuvre_rows).max(initial=0))
    return RouteSearch(
        nodes=argument(empty_records(SearchNode, count)),
        heap=argument(empty_records(HeapEntry, count)),
        closed=np.zeros(count, dtype=np.bool_),
        extra=argument(empty_records(RoutingEdge, 24 + out + into)),
        path=np.zeros(count, dtype=np.int32),
        driven=np.zeros(count),
        legs=argument(empty_records(LegRecord, count)),
        result=argument(empty_records(SearchResult, 1)),
    )
