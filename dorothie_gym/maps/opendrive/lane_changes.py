"""Lane changes of an OpenDRIVE file: links between lanes that lie side by side in a common lane section."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import Lane, LaneLink, LinkType
from dorothie_gym.maps.opendrive.topology import LanePiece, Topology, runs_forward

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.records import OpenDriveRecords, RoadRecord

# Shortest length of parallel lanes with a lane change [m].
SHORTEST_LANE_CHANGE = 5.0


def lane_change_links(records: OpenDriveRecords, topology: Topology, lanes: tuple[Lane, ...]) -> tuple[LaneLink, ...]:
    """Returns lane changes between parallel lanes, each pair once and the longest neighbour of a lane first.

    The side of a neighbour is that of the sections that both lanes share: a lane may have other numbers elsewhere. A
    file may contradict itself about sides; then the lanes concerned have no changes to each other, and no lane is
    its own neighbour after several changes to one side.
    """
    shared: defaultdict[tuple[int, int], float] = defaultdict(float)
    open_: defaultdict[tuple[int, int], bool] = defaultdict(bool)
    sides: defaultdict[tuple[int, int], set[LinkType]] = defaultdict(set)
    lane_of = {piece: k for k, chain in enumerate(topology.chains) for piece in chain}
    for inner, outer in _neighbours(records, lane_of):
        source, target = lane_of[inner], lane_of[outer]
        if lanes[source].in_junction:
            continue
        road = records.roads[inner.road]
        section = road.sections[inner.section]
        between = section.lanes.get(inner.lane if inner.lane * outer.lane > 0 else 0)  # the lane with the mark
        changes = () if between is None else between.changes
        outward = 1 if outer.lane > inner.lane else -1
        for a, b, toward in ((source, target, outward), (target, source, -outward)):
            shared[a, b] += section.end - section.start
            open_[a, b] |= _permits(changes, toward)
            sides[a, b].add(_side(road, inner, toward))
    pairs = [pair for pair, length in shared.items() if open_[pair] and length >= SHORTEST_LANE_CHANGE]
    tangled = _tangled(sides, len(lanes))
    for a, b in sorted({(min(pair), max(pair)) for pair in pairs if pair in tangled}):
        reason = f"lies on both sides of lane {lanes[b].lane_id}; no change between the two"
        where = f"road {records.roads[lanes[a].road_id].name} / lane {lanes[a].lane_id}"
        records.notes.dropped(NoteKind.LANE_CHANGE, where, reason)
    rows = sorted((a, -shared[a, b], b, next(iter(sides[a, b]))) for a, b in pairs if (a, b) not in tangled)
    return tuple(LaneLink(source, target, side) for source, _, target, side in rows)


def _neighbours(records: OpenDriveRecords, lane_of: Iterable[LanePiece]) -> Iterator[tuple[LanePiece, LanePiece]]:
    """Yields the pairs of neighbouring lanes of each section that run the same way, the inner one first.

    Lanes at both sides of the reference line are neighbours where one of them is driven against the rule of its side.
    """
    known = dict.fromkeys(lane_of)
    for piece in known:
        outer = piece._replace(lane=piece.lane + (1 if piece.lane > 0 else -1))
        across = piece._replace(lane=1)
        for other in (outer, across) if piece.lane == -1 else (outer,):
            road = records.roads[piece.road]
            if other in known and runs_forward(road, *piece[1:]) == runs_forward(road, *other[1:]):
                yield piece, other


def _permits(changes: tuple[str, ...], toward: int) -> bool:
    """Returns whether a road mark permits changes to higher (1) or lower (-1) lane numbers; by default it does."""
    allowing = ("both", "increase" if toward > 0 else "decrease")
    return not changes or any(change in allowing for change in changes)


def _side(road: RoadRecord, piece: LanePiece, toward: int) -> LinkType:
    """Returns the side of higher (1) or lower (-1) lane numbers in driving direction."""
    forward = runs_forward(road, piece.section, piece.lane)
    return LinkType.LANE_CHANGE_RIGHT if forward == (toward < 0) else LinkType.LANE_CHANGE_LEFT


def _tangled(sides: dict[tuple[int, int], set[LinkType]], count: int) -> set[tuple[int, int]]:
    """Returns the pairs of lanes that lie on both sides of each other, directly or by a round of lanes."""
    pairs = np.array([pair for pair, found in sides.items() if LinkType.LANE_CHANGE_RIGHT in found], dtype=np.intp)
    if not len(pairs):
        return set()
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()
    _, part = connected_components(graph, directed=True, connection="strong")
    return {(a, b) for a, b in sides if part[a] == part[b]}
