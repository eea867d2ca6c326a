"""Topology of an OpenDRIVE file: lane sections linked, contracted and merged to lanes, with turn types.

A file divides a road into lane sections at every change, often every few millimetres. A lane of a town is a
chain of one-to-one linked lane sections of one road; it ends where it forks, merges or enters another road.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import NO_JUNCTION, Lane, LaneLink, LinkType
from dorothie_gym.maps.opendrive.parse import refuse_empty
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.records import ConnectionRecord, OpenDriveRecords, RoadRecord

# Lane sections shorter than this are contracted [m].
JOINT_LENGTH = 1e-3

# Merged lanes shorter than this are contracted [m].
SHORTEST_LANE = 0.1


class LanePiece(NamedTuple):
    """Driving lane of one lane section."""

    road: int
    section: int
    lane: int


@dataclass(frozen=True)
class Topology:
    """Lanes and links of a file.

    Attributes:
        chains: pieces of each lane, in driving direction.
        links: sorted pairs (source, target) of indices into `chains`.
    """

    chains: tuple[tuple[LanePiece, ...], ...]
    links: tuple[tuple[int, int], ...]

    def without(self, lanes: Collection[int]) -> Topology:
        """Returns the topology without some lanes and their links."""
        kept = {old: new for new, old in enumerate(k for k in range(len(self.chains)) if k not in lanes)}
        links = ((kept[a], kept[b]) for a, b in self.links if a in kept and b in kept)
        return Topology(tuple(self.chains[k] for k in kept), tuple(links))


def runs_forward(road: RoadRecord, section: int, lane: int) -> bool:
    """Returns whether traffic in a lane follows the reference line (right-hand traffic: the lanes on its right)."""
    return ((lane < 0) == road.right_hand) != road.sections[section].lanes[lane].reversed


def build_topology(records: OpenDriveRecords) -> Topology:
    """Returns the lanes of a file and their links.

    Links to missing lanes or against the traffic are errors of exporters: they are dropped with a note. So are paths
    across junctions on which only lanes lead that are not for cars.

    Raises:
        TownError: the file has no driving lanes.
    """
    graph = _Graph()
    for road in records.roads.values():
        for k, section in enumerate(road.sections):
            for lane in section.lanes.values():
                if lane.drives:
                    graph.add(LanePiece(road.id, k, lane.id), section.end - section.start)
    for source, target in (*_lane_links(records, graph), *_connection_links(records, graph)):
        graph.link(source, target)
    _drop_paths_of_others(records, graph)
    for piece in [p for p, length in graph.length.items() if length < JOINT_LENGTH]:
        graph.contract(piece)
    for piece in [p for p in graph.length if records.roads[p.road].sections[p.section].lanes[p.lane].is_closed]:
        graph.remove(piece)
    begun = {p for p in graph.length if records.roads[p.road].sections[p.section].lanes[p.lane].begins}
    chains = graph.chains(begun)
    short = [chain for chain in chains if sum(graph.length[p] for p in chain) < SHORTEST_LANE]
    if short:
        for piece in (p for chain in short for p in chain):
            graph.contract(piece)
        chains = graph.chains(begun)
    if not chains:
        refuse_empty(records.source, records.notes, "has no driving lanes; a town needs at least one")
    chains.sort(key=lambda chain: min(chain))
    index = {chain[0]: k for k, chain in enumerate(chains)}
    links = sorted((k, index[target]) for k, chain in enumerate(chains) for target in graph.after[chain[-1]])
    return Topology(tuple(chains), tuple(links))


class _Graph:
    """Pieces and the links between them; dictionaries serve as ordered sets, in the order of the file."""

    def __init__(self) -> None:
        self.length: dict[LanePiece, float] = {}
        self.after: dict[LanePiece, dict[LanePiece, None]] = {}
        self.before: dict[LanePiece, dict[LanePiece, None]] = {}
        self.after_others: dict[LanePiece, None] = {}  # pieces behind lanes that are not for cars

    def add(self, piece: LanePiece, length: float) -> None:
        self.length[piece] = length
        self.after[piece], self.before[piece] = {}, {}

    def link(self, source: LanePiece, target: LanePiece) -> None:
        self.after[source][target] = None
        self.before[target][source] = None

    def contract(self, piece: LanePiece) -> None:
        """Removes a piece and links its predecessors to its successors."""
        before, after = self.remove(piece)
        for source in before:
            for target in after:
                self.link(source, target)

    def remove(self, piece: LanePiece) -> tuple[tuple[LanePiece, ...], tuple[LanePiece, ...]]:
        """Removes a piece; returns its predecessors and successors."""
        before, after = self.before.pop(piece), self.after.pop(piece)
        before.pop(piece, None)
        after.pop(piece, None)
        for source in before:
            del self.after[source][piece]
        for target in after:
            del self.before[target][piece]
        del self.length[piece]
        return tuple(before), tuple(after)

    def chains(self, begun: Collection[LanePiece] = ()) -> list[tuple[LanePiece, ...]]:
        """Returns the chains of one-to-one linked pieces within a road; `begun` are the first of theirs."""
        follower = {}
        for piece, after in self.after.items():
            if len(after) == 1:
                target = next(iter(after))
                if (
                    target.road == piece.road
                    and target != piece
                    and target not in begun
                    and len(self.before[target]) == 1
                ):
                    follower[piece] = target
        followed = set(follower.values())
        chains = []
        for piece in self.length:
            if piece not in followed:
                chain = [piece]
                while chain[-1] in follower:
                    chain.append(follower[chain[-1]])
                chains.append(tuple(chain))
        return chains


class _Touch(NamedTuple):
    """End of a lane section: road id, index of the section, and whether it is the start of the section."""

    road: int
    section: int
    at_start: bool


def _lane_links(records: OpenDriveRecords, graph: _Graph) -> Iterator[tuple[LanePiece, LanePiece]]:
    """Yields the links in the lane records, in driving direction."""
    for piece in graph.length:
        road = records.roads[piece.road]
        lane = road.sections[piece.section].lanes[piece.lane]
        where = f"road {road.name} / laneSection {piece.section} / lane {piece.lane}"
        for numbers, step in ((lane.predecessors, -1), (lane.successors, 1)):
            touch = _neighbour_section(records, road, piece.section, step) if numbers else None
            if touch is not None:
                here = _Touch(piece.road, piece.section, step < 0)
                for number in numbers:
                    yield from _joined(records, graph, (here, piece.lane), (touch, number), where)


def _neighbour_section(records: OpenDriveRecords, road: RoadRecord, section: int, step: int) -> _Touch | None:
    """Returns the section before (-1) or after (+1) a section; None at a junction and at the end of the road."""
    if 0 <= section + step < len(road.sections):
        return _Touch(road.id, section + step, step > 0)
    link = road.successor if step > 0 else road.predecessor
    return _touched(records, link.id, link.contact) if link is not None and link.is_road else None


def _touched(records: OpenDriveRecords, road: int, contact: str) -> _Touch:
    """Returns the lane section at an end of a road."""
    return _Touch(road, 0, True) if contact == "start" else _Touch(road, len(records.roads[road].sections) - 1, False)


def _joined(
    records: OpenDriveRecords, graph: _Graph, a: tuple[_Touch, int], b: tuple[_Touch, int], where: str
) -> Iterator[tuple[LanePiece, LanePiece]]:
    """Yields the link between two lanes that meet at ends of their sections, in driving direction, if there is one.

    Args:
        records: records of the file.
        graph: driving lanes of the file; a lane may be linked to one of another type.
        a: end of one section, and lane number.
        b: the same for the other lane.
        where: element with the link, for the log.
    """
    pieces = []
    for touch, number in (a, b):
        if number not in records.roads[touch.road].sections[touch.section].lanes:
            reason = f"links lane {number} of road {records.roads[touch.road].name}: no such lane there"
            records.notes.dropped(NoteKind.LANE_LINK, where, reason)
            return
        pieces.append(LanePiece(touch.road, touch.section, number))
    leaves = [runs_forward(records.roads[t.road], t.section, number) != t.at_start for t, number in (a, b)]
    driven = [piece in graph.length for piece in pieces]
    if not all(driven):
        if any(driven) and not leaves[driven.index(True)]:
            graph.after_others[pieces[driven.index(True)]] = None
        return
    if leaves[0] == leaves[1]:
        records.notes.dropped(NoteKind.LANE_LINK, where, "links lanes of opposite directions")
    else:
        yield (pieces[0], pieces[1]) if leaves[0] else (pieces[1], pieces[0])


def _drop_paths_of_others(records: OpenDriveRecords, graph: _Graph) -> None:
    """Drops lanes of junctions that no car enters, because only lanes for others, such as buses, lead on them."""
    waiting = list(graph.after_others)
    while waiting:
        piece = waiting.pop()
        if piece in graph.length and not graph.before[piece] and records.roads[piece.road].junction != NO_JUNCTION:
            where = f"road {records.roads[piece.road].name} / laneSection {piece.section} / lane {piece.lane}"
            records.notes.dropped(NoteKind.ACCESS, where, "begins behind a lane that is not for cars")
            waiting += graph.remove(piece)[1]


def _connection_links(records: OpenDriveRecords, graph: _Graph) -> Iterator[tuple[LanePiece, LanePiece]]:
    """Yields the links in the junction records."""
    for junction, connections in records.junctions.items():
        for connection in connections:
            there = _touched(records, connection.connecting, connection.contact)
            names = [records.roads[number].name for number in (connection.incoming, connection.connecting)]
            where = f"junction {junction} / connection from road {names[0]} to road {names[1]}"
            for here in _incoming_ends(records, junction, connection):
                for source, target in connection.lanes or _equal_lanes(records, here, there):
                    yield from _joined(records, graph, (here, source), (there, target), where)


def _incoming_ends(records: OpenDriveRecords, junction: int, connection: ConnectionRecord) -> Iterator[_Touch]:
    """Yields the ends of the incoming road at a connection; none if the link of the connecting road contradicts it."""
    if connection.direct:
        road = records.roads[connection.incoming]
        for link, contact in ((road.predecessor, "start"), (road.successor, "end")):
            if link is not None and not link.is_road and link.id == junction:
                yield _touched(records, road.id, contact)
    else:
        road = records.roads[connection.connecting]
        link = road.predecessor if connection.contact == "start" else road.successor
        if link is not None and link.is_road and link.id == connection.incoming:
            yield _touched(records, link.id, link.contact)


def _equal_lanes(records: OpenDriveRecords, here: _Touch, there: _Touch) -> Iterator[tuple[int, int]]:
    """Yields the lane pairs of a connection without lane links: equal numbers, or opposite ones in collisions."""
    sign = 1 if here.at_start != there.at_start else -1
    beyond = records.roads[there.road].sections[there.section].lanes
    for number, lane in records.roads[here.road].sections[here.section].lanes.items():
        if lane.drives and sign * number in beyond and beyond[sign * number].drives:
            yield number, sign * number


# --- Turn types, derived from geometry -------------------------------------------------------------------------------
# Limits between the turn types [degrees].
STRAIGHT_BELOW, U_TURN_ABOVE = 35.0, 150.0


def turn_type(angle: float) -> LinkType:
    """Returns the turn type of an angle [degrees], positive left."""
    if abs(angle) > U_TURN_ABOVE:
        return LinkType.U_TURN
    if abs(angle) < STRAIGHT_BELOW:
        return LinkType.STRAIGHT
    return LinkType.LEFT if angle > 0 else LinkType.RIGHT


def successor_links(records: OpenDriveRecords, lanes: tuple[Lane, ...], topology: Topology) -> tuple[LaneLink, ...]:
    """Returns the links between successive lanes; the link into a junction carries the turn type.

    If a road forks into several almost straight branches, only the straightest is called straight; the others are named
    by their side of it. What our own files say about turns counts more than angles.
    """
    after: defaultdict[int, list[int]] = defaultdict(list)
    for source, target in topology.links:
        after[source].append(target)
    turns = {
        k: _turn(lanes, after, target)
        for k, (source, target) in enumerate(topology.links)
        if lanes[target].in_junction and not lanes[source].in_junction
    }
    links = [
        LaneLink(source, target, turn_type(turns[k][0]) if k in turns else LinkType.STRAIGHT)
        for k, (source, target) in enumerate(topology.links)
    ]
    straight: defaultdict[int, list[int]] = defaultdict(list)
    for k in turns:
        if links[k].type is LinkType.STRAIGHT:
            straight[links[k].source].append(k)
    for fork in straight.values():
        best = min(fork, key=lambda k: abs(sum(turns[k])))
        for k in fork:
            if k != best:
                side = LinkType.LEFT if sum(turns[k]) > sum(turns[best]) else LinkType.RIGHT
                links[k] = replace(links[k], type=side)
    for k in turns:
        piece = topology.chains[links[k].target][0]
        said = records.roads[piece.road].sections[piece.section].lanes[piece.lane].turn
        links[k] = links[k] if said is None else replace(links[k], type=said)
    return tuple(links)


def _turn(lanes: tuple[Lane, ...], after: dict[int, list[int]], connector: int) -> tuple[float, float]:
    """Returns the change of direction across a junction, and that to its exit point [degrees], positive left.

    The second value distinguishes branches into parallel lanes. A connector may continue in another one.
    """
    turned, last, seen = 0.0, connector, {connector}
    while True:
        turned += float(np.degrees(lanes[last].headings[0] - lanes[last].headings[-1]))
        onward = after.get(last, [])
        if len(onward) != 1 or not lanes[onward[0]].in_junction or onward[0] in seen:
            break
        last = onward[0]
        seen.add(last)
    x, y = lanes[last].points[-1, :2] - lanes[connector].points[0, :2]
    aside = float(np.degrees(lanes[connector].headings[0] - pn.arctan2(y, x)))
    return turned if abs(turned) < 180.0 else wrap_degrees(turned), wrap_degrees(aside)
