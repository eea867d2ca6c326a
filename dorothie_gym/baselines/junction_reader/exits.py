"""The ways on at the next junction, read off a town's lane graph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.benchmark.features import TownGraph
from dorothie_gym.maps.lane_graph import EDGE_TYPES, FEATURES, LENGTH, EdgeType

EXITS: Final = 5
"""Ways on that are kept at most; a crossing has three."""

_HOPS: Final = 24
_START_YAW, _END_YAW = FEATURES.index("start_yaw"), FEATURES.index("end_yaw")

END: Final = slice(FEATURES.index("end_x"), FEATURES.index("end_y") + 1)
"""Columns of the place where a lane ends."""


@dataclass(frozen=True, eq=False)
class ExitTable:
    """For each lane of a town (L,) the ways on at the next place where there is a choice.

    Attributes:
        angle: (L, X) turn to each way [degrees, positive left], as the angle of a turn is counted.
        lane: (L, X) lane that the car is on after the junction, -1 where there is none.
        place: (L, X, 2) where that lane ends [m]: which way it leads.
        there: (L, X) whether there is such a way.
        distance: (L,) from the end of the lane to the junction along the lanes between [m].
    """

    angle: NDArray[np.float32]
    lane: NDArray[np.int64]
    place: NDArray[np.float32]
    there: NDArray[np.bool_]
    distance: NDArray[np.float32]


def exit_table(graph: TownGraph) -> ExitTable:
    """Returns the ways on from every lane: along the only successor until there are several."""
    count = len(graph.lanes)
    successors = _successors(graph)
    angle, lane = np.zeros((count, EXITS), np.float32), np.full((count, EXITS), -1)
    distance = np.zeros(count, np.float32)
    for row in range(count):
        ways, distance[row] = _ways(graph, successors, row)
        ways = sorted(ways)[:EXITS]
        for column, (turn, target) in enumerate(ways):
            angle[row, column], lane[row, column] = turn, target
    place = graph.lanes[np.maximum(lane, 0)][..., END] if count else np.zeros((0, EXITS, 2))
    return ExitTable(angle, lane, place.astype(np.float32), lane >= 0, distance)


def _successors(graph: TownGraph) -> list[list[int]]:
    found: list[list[int]] = [[] for _ in graph.lanes]
    onward = graph.edge_types == EDGE_TYPES.index(EdgeType.CONCAT)
    for source, target in graph.edges.T[onward].tolist():
        found[source].append(target)
    return found


def _ways(graph: TownGraph, successors: list[list[int]], lane: int) -> tuple[list[tuple[float, int]], float]:
    """Turns and lanes at the next choice from a lane, and how far it is from its end [m]."""
    gone = 0.0
    for _ in range(_HOPS):
        following = successors[lane]
        if len(following) > 1:
            return [_turn(graph, successors, lane, way) for way in following], gone
        if not following:
            return [], gone
        lane = following[0]
        gone += float(graph.lanes[lane, LENGTH])
    return [], gone


def _turn(graph: TownGraph, successors: list[list[int]], lane: int, way: int) -> tuple[float, int]:
    """Returns the change of yaw from a lane's end to the exit of the junction, and the lane after it."""
    for _ in range(_HOPS):
        if graph.junction[way] == 0 or len(successors[way]) != 1:
            break
        way = successors[way][0]
    turned = float(graph.lanes[lane, _END_YAW] - graph.lanes[way, _START_YAW])  # yaw is clockwise, angles are not
    return (turned + 180.0) % 360.0 - 180.0, way
