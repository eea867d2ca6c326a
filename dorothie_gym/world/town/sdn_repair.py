"""The known fault of SDN's town graphs: found, and put right where the graph allows it.

In the published files a lane's `start` is really its END, its `end` a point on a lane before it, and its `length` a
difference between places on two roads. So the end is what stands as the start, the start is the end of any lane that
leads to it, and the length that of its road in the junction graph, or of a smooth curve between both ends.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.town.graph import END, LENGTH, START, EdgeType, LaneGraph, Repair
from dorothie_gym.world.town.model import NO_JUNCTION, Array

TOUCHING = 1.0
"""Ends of lanes closer than this are one place [m]: lanes of well-formed files are millimetres apart, those of SDN's
faulty ones their whole length."""

MAJORITY = 0.5
"""A reading of a file holds if it fits more than this share of what it says something about."""

_ANGLES = (3, 4, 5, 9, 10, 11)

_SAMPLES = 33
"""Points at which a curve is measured."""


def repair(graph: LaneGraph) -> LaneGraph:
    """A lane graph as read from a file, with the known fault repaired if it has it.

    Returns:
        The same graph where the ends of linked lanes meet already. Else one with ends, starts and lengths set anew and
        `LaneGraph.repairs` telling what was done to each lane; where the ends do not fit with the fault either, the
        lanes stay as they are, flagged `Repair.UNRELIABLE`.
    """
    links = graph.edges_of(EdgeType.CONCAT)
    if not len(links):
        return (
            _noted(graph, "no lane is linked to another: whether their ends are right cannot be told")
            if len(graph)
            else graph
        )
    features = graph.features
    source, target = links.T
    gaps = np.hypot(*(features[source, 6:8] - features[target, 0:2]).T)
    if np.mean(gaps <= TOUCHING) > MAJORITY:
        apart = int(np.sum(gaps > TOUCHING))
        return (
            _noted(graph, f"{apart} links join lanes whose ends are more than {TOUCHING:g} m apart") if apart else graph
        )
    before = _predecessors(len(graph), links)
    agreeing = [_agree(features, lanes) for lanes in before if len(lanes) > 1]
    if agreeing and np.mean(agreeing) <= MAJORITY:
        note = "the ends of the lanes fit neither as they are written nor with the known fault; nothing was repaired"
        flags = np.full(len(graph), int(Repair.UNRELIABLE), dtype=np.int64)
        return _noted(replace(graph, repairs=flags), note)
    return _repaired(graph, before)


def _noted(graph: LaneGraph, note: str) -> LaneGraph:
    return graph if note in graph.notes else replace(graph, notes=(*graph.notes, note))


def _predecessors(count: int, links: NDArray[np.int64]) -> list[list[int]]:
    before: list[list[int]] = [[] for _ in range(count)]
    for source, target in links.tolist():
        if source != target:
            before[target].append(source)
    return before


def _agree(features: Array, lanes: list[int]) -> bool:
    """Whether lanes end, by what the file has as their starts, in one place."""
    ends = features[lanes, 0:2]
    return bool(np.all(np.hypot(*(ends - ends[0]).T) <= TOUCHING))


def _repaired(graph: LaneGraph, before: list[list[int]]) -> LaneGraph:
    stored = graph.features.copy()
    # the files' angles run beyond a turn
    stored[:, _ANGLES] = (stored[:, _ANGLES] + 180.0) % 360.0 - 180.0
    features = stored.copy()
    flags = np.full(len(graph), int(Repair.END_FROM_START), dtype=np.int64)
    features[:, END] = stored[:, START]
    road_lengths, whole = _road_lengths(graph), _whole(graph)
    for row, lanes in enumerate(before):
        known = bool(lanes) and _agree(stored, lanes)
        # where nothing leads to a lane, the walk back that went astray in SDN's files had nowhere to go
        features[row, START] = stored[lanes[0], START] if known else stored[row, END]
        flags[row] |= Repair.START_FROM_PREDECESSOR if known else Repair.START_UNKNOWN
        chord = math.dist(features[row, 0:2], features[row, 6:8])
        measured = whole[row] and road_lengths[row] >= chord - TOUCHING
        features[row, LENGTH] = road_lengths[row] if measured else _curve_length(features[row])
        flags[row] |= Repair.LENGTH_FROM_META_MAP if measured else Repair.LENGTH_ESTIMATED
    return replace(graph, features=features, repairs=flags)


def _road_lengths(graph: LaneGraph) -> Array:
    """Length of each lane's road where that leads from a junction to another alone, else NaN (n,) [m]."""
    given: dict[tuple[int, int], float] = {}
    meta_map = graph.meta_map
    for (_, target), roads, length in zip(meta_map.edges, meta_map.roads, meta_map.lengths.tolist(), strict=True):
        if len(roads) == 1:
            given[roads[0], int(meta_map.ids[target])] = length
    lengths = np.full(len(graph), np.nan)
    for source, target in graph.edges_of(EdgeType.CONCAT).tolist():
        key = int(graph.road_ids[source]), int(graph.junction_ids[target])
        lengths[source] = given.get(key, lengths[source])
    return lengths


def _whole(graph: LaneGraph) -> NDArray[np.bool_]:
    """Which lanes run along all of their road (n,): those outside junctions that other roads lead to and follow."""
    source, target = graph.edges_of(EdgeType.CONCAT).T
    same = graph.road_ids[source] == graph.road_ids[target]
    rows = np.arange(len(graph))
    whole: NDArray[np.bool_] = graph.junction_ids == NO_JUNCTION
    for ends in (source, target):
        whole = whole & np.isin(rows, ends) & ~np.isin(rows, ends[same])
    return whole


def _curve_length(row: Array) -> float:
    """Length of the cubic curve between both ends of a lane in their directions; that of an arc where it is one [m]."""
    start, end = row[0:2], row[6:8]
    chord = math.dist(start, end)
    yaws = np.radians((row[4], row[10]))
    half = abs((yaws[1] - yaws[0] + math.pi) % (2 * math.pi) - math.pi) / 2
    pull = chord * (half / math.sin(half) if half > 1e-6 else 1.0)
    tangents = pull * np.column_stack((np.cos(yaws), np.sin(yaws)))
    t = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    points = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + (t**3 - 2 * t**2 + t) * tangents[0]
        + (3 * t**2 - 2 * t**3) * end
        + (t**3 - t**2) * tangents[1]
    )
    return float(np.hypot(*np.diff(points, axis=0).T).sum())
