"""Which lanes a file has and how they go on: lane sections linked, contracted and merged to lanes.

A file cuts a road into lane sections wherever anything changes, often every few millimetres. What a driver calls a lane
is a chain of sections of one road that go on one to one; where a lane forks, joins or enters another road, it ends.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from dorothie_gym.angles import wrap_degrees
from dorothie_gym.errors import TownError
from dorothie_gym.maps.model import Lane, LaneLink, LinkType
from dorothie_gym.maps.opendrive.records import ConnectionRecord, OpenDriveRecords, RoadRecord

# Sections shorter than this are joints, not road: they are left out and what they link is linked directly [m].
JOINT_LENGTH = 1e-3

# A merged lane shorter than this cannot be driven: its links are joined across it in the same way [m].
SHORTEST_LANE = 0.1

_log = logging.getLogger(__name__)


class LanePiece(NamedTuple):
    """One driving lane of one lane section."""

    road: int
    section: int
    lane: int


@dataclass(frozen=True)
class Topology:
    """Lanes and links of a file.

    Attributes:
        chains: pieces of each lane in driving direction.
        links: pairs (source, target) of indices in `chains`, sorted.
    """

    chains: tuple[tuple[LanePiece, ...], ...]
    links: tuple[tuple[int, int], ...]


def runs_forward(road: RoadRecord, lane: int) -> bool:
    """Whether traffic in a lane runs along the reference line (right-hand traffic: the lanes on its right)."""
    return (lane < 0) == road.right_hand


def build_topology(records: OpenDriveRecords) -> Topology:
    """Lanes of a file and how they go on.

    Links that lead to no lane, or against the traffic, are slips of exporters: they are left out and logged.

    Raises:
        TownError: no driving lanes.
    """
    graph = _Graph()
    for road in records.roads.values():
        for k, section in enumerate(road.sections):
            for lane in section.lanes.values():
                if lane.drives:
                    graph.add(LanePiece(road.id, k, lane.id), section.end - section.start)
    for source, target in (*_lane_links(records, graph), *_connection_links(records, graph)):
        graph.link(source, target)
    for piece in [p for p, length in graph.length.items() if length < JOINT_LENGTH]:
        graph.contract(piece)
    for piece in [p for p in graph.length if records.roads[p.road].sections[p.section].lanes[p.lane].is_closed]:
        graph.remove(piece)
    chains = graph.chains()
    short = [chain for chain in chains if sum(graph.length[p] for p in chain) < SHORTEST_LANE]
    if short:
        for piece in (p for chain in short for p in chain):
            graph.contract(piece)
        chains = graph.chains()
    if not chains:
        raise TownError(records.source, "OpenDRIVE", "has no driving lanes; a town needs at least one")
    chains.sort(key=lambda chain: min(chain))
    index = {chain[0]: k for k, chain in enumerate(chains)}
    links = sorted((k, index[target]) for k, chain in enumerate(chains) for target in graph.after[chain[-1]])
    return Topology(tuple(chains), tuple(links))


class _Graph:
    """Pieces and links between them; dictionaries as ordered sets, so that the order is the file's."""

    def __init__(self) -> None:
        self.length: dict[LanePiece, float] = {}
        self.after: dict[LanePiece, dict[LanePiece, None]] = {}
        self.before: dict[LanePiece, dict[LanePiece, None]] = {}

    def add(self, piece: LanePiece, length: float) -> None:
        self.length[piece] = length
        self.after[piece], self.before[piece] = {}, {}

    def link(self, source: LanePiece, target: LanePiece) -> None:
        self.after[source][target] = None
        self.before[target][source] = None

    def contract(self, piece: LanePiece) -> None:
        """Takes a piece out and links what comes before it to what comes after it."""
        before, after = self.remove(piece)
        for source in before:
            for target in after:
                self.link(source, target)

    def remove(self, piece: LanePiece) -> tuple[tuple[LanePiece, ...], tuple[LanePiece, ...]]:
        """Takes a piece out; returns what came before it and what came after it."""
        before, after = self.before.pop(piece), self.after.pop(piece)
        before.pop(piece, None)
        after.pop(piece, None)
        for source in before:
            del self.after[source][piece]
        for target in after:
            del self.before[target][piece]
        del self.length[piece]
        return tuple(before), tuple(after)

    def chains(self) -> list[tuple[LanePiece, ...]]:
        """Pieces that go on one to one within a road, joined."""
        follower = {}
        for piece, after in self.after.items():
            if len(after) == 1:
                target = next(iter(after))
                if target.road == piece.road and target != piece and len(self.before[target]) == 1:
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
    """An end of a lane section: the road, the section's number, and whether it is the end at the section's start."""

    road: int
    section: int
    at_start: bool


def _lane_links(records: OpenDriveRecords, graph: _Graph) -> Iterator[tuple[LanePiece, LanePiece]]:
    """Links that the lanes themselves name, in driving direction."""
    for piece in graph.length:
        road = records.roads[piece.road]
        lane = road.sections[piece.section].lanes[piece.lane]
        for number, step in ((lane.predecessor, -1), (lane.successor, 1)):
            touch = _neighbour_section(records, road, piece.section, step)
            if number is not None and touch is not None:
                here = _Touch(piece.road, piece.section, step < 0)
                where = f"road {piece.road} / laneSection {piece.section} / lane {piece.lane}"
                yield from _joined(records, graph, (here, piece.lane), (touch, number), where)


def _neighbour_section(records: OpenDriveRecords, road: RoadRecord, section: int, step: int) -> _Touch | None:
    """Section before (-1) or behind (+1) a section; None at a junction and where the road ends."""
    if 0 <= section + step < len(road.sections):
        return _Touch(road.id, section + step, step > 0)
    link = road.successor if step > 0 else road.predecessor
    return _touched(records, link.id, link.contact) if link is not None and link.is_road else None


def _touched(records: OpenDriveRecords, road: int, contact: str) -> _Touch:
    """The lane section at an end of a road."""
    return _Touch(road, 0, True) if contact == "start" else _Touch(road, len(records.roads[road].sections) - 1, False)


def _joined(
    records: OpenDriveRecords, graph: _Graph, a: tuple[_Touch, int], b: tuple[_Touch, int], where: str
) -> Iterator[tuple[LanePiece, LanePiece]]:
    """The link between two lanes that meet at ends of their sections, in driving direction; nothing if there is none.

    Args:
        records: the file.
        graph: its driving lanes; a lane may end in one of another type.
        a: where one lane is touched, and its number.
        b: the same for the other.
        where: element that says so, for the log.
    """
    pieces = []
    for touch, number in (a, b):
        if number not in records.roads[touch.road].sections[touch.section].lanes:
            _log.warning(
                "%s: %s: links lane %d of road %d: no such lane there", records.source, where, number, touch.road
            )
            return
        pieces.append(LanePiece(touch.road, touch.section, number))
    if any(piece not in graph.length for piece in pieces):
        return
    leaves = [runs_forward(records.roads[t.road], number) != t.at_start for t, number in (a, b)]
    if leaves[0] == leaves[1]:
        _log.warning("%s: %s: links lanes of opposite directions: left out", records.source, where)
    else:
        yield (pieces[0], pieces[1]) if leaves[0] else (pieces[1], pieces[0])


def _connection_links(records: OpenDriveRecords, graph: _Graph) -> Iterator[tuple[LanePiece, LanePiece]]:
    """Links that the junctions name."""
    for junction, connections in records.junctions.items():
        for connection in connections:
            there = _touched(records, connection.connecting, connection.contact)
            where = f"junction {junction} / connection from road {connection.incoming} to road {connection.connecting}"
            for here in _incoming_ends(records, junction, connection):
                for source, target in connection.lanes or _equal_lanes(records, here, there):
                    yield from _joined(records, graph, (here, source), (there, target), where)


def _incoming_ends(records: OpenDriveRecords, junction: int, connection: ConnectionRecord) -> Iterator[_Touch]:
    """Ends of the incoming road that a connection begins at; none where the connecting road knows better."""
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
    """Lanes that a connection without lane links means: those of equal number, or opposite where the roads collide."""
    sign = 1 if here.at_start != there.at_start else -1
    beyond = records.roads[there.road].sections[there.section].lanes
    for number, lane in records.roads[here.road].sections[here.section].lanes.items():
        if lane.drives and sign * number in beyond and beyond[sign * number].drives:
            yield number, sign * number


# --- Turn types of the links into a junction's connectors: OpenDRIVE has no names for them, geometry tell ------------

# Changes of heading that separate the types of turn [degrees].
STRAIGHT_BELOW, U_TURN_ABOVE = 35.0, 150.0


def turn_type(angle: float) -> LinkType:
    """Type of a turn by its angle [degrees], positive left."""
    if abs(angle) > U_TURN_ABOVE:
        return LinkType.U_TURN
    if abs(angle) < STRAIGHT_BELOW:
        return LinkType.STRAIGHT
    return LinkType.LEFT if angle > 0 else LinkType.RIGHT


def successor_links(lanes: tuple[Lane, ...], topology: Topology) -> tuple[LaneLink, ...]:
    """Links by which lanes go on at their ends, with their types; a turn is typed where it enters the junction.

    Where a road forks so that several ways are nearly straight, only the straightest is called so, and the others are
    called by the side that they turn to from it.
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
    return tuple(links)


def _turn(lanes: tuple[Lane, ...], after: dict[int, list[int]], connector: int) -> tuple[float, float]:
    """Change of heading across a junction, and that from its entry to the way to its exit [degrees], positive left.

    The second one tells ways apart that lead into lanes side by side. A connector may go on in another one.
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
    aside = float(np.degrees(lanes[connector].headings[0] - np.arctan2(y, x)))
    return turned if abs(turned) < 180.0 else wrap_degrees(turned), wrap_degrees(aside)
