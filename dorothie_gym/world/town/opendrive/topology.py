"""Which lanes a file has and how they go on: lane sections linked, contracted and merged to lanes.

A file cuts a road into lane sections wherever anything changes, often every few millimetres. What a driver calls a lane
is a chain of sections of one road that go on one to one; where a lane forks, joins or enters another road, it ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from dorothie_gym.world.town.model import TownError
from dorothie_gym.world.town.opendrive.records import ConnectionRecord, OpenDriveRecords, RoadLink, RoadRecord

# Sections shorter than this are joints, not road: they are left out and what they link is linked directly [m].
JOINT_LENGTH = 1e-3

# A merged lane shorter than this cannot be driven: its links are joined across it in the same way [m].
SHORTEST_LANE = 0.1


class Piece(NamedTuple):
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

    chains: tuple[tuple[Piece, ...], ...]
    links: tuple[tuple[int, int], ...]


def runs_forward(road: RoadRecord, lane: int) -> bool:
    """Whether traffic in a lane runs along the reference line (right-hand traffic: the lanes on its right)."""
    return (lane < 0) == road.right_hand


def build_topology(records: OpenDriveRecords) -> Topology:
    """Lanes of a file and how they go on.

    Raises:
        TownError: no driving lanes, or a lane link that leads to a lane that is not there.
    """
    graph = _Graph()
    for road in records.roads.values():
        for k, section in enumerate(road.sections):
            for lane in section.lanes.values():
                if lane.type == "driving":
                    graph.add(Piece(road.id, k, lane.id), section.end - section.start)
    for source, target in (*_lane_links(records, graph), *_connection_links(records, graph)):
        graph.link(source, target)
    for piece in [p for p, length in graph.length.items() if length < JOINT_LENGTH]:
        graph.contract(piece)
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
        self.length: dict[Piece, float] = {}
        self.after: dict[Piece, dict[Piece, None]] = {}
        self.before: dict[Piece, dict[Piece, None]] = {}

    def add(self, piece: Piece, length: float) -> None:
        self.length[piece] = length
        self.after[piece], self.before[piece] = {}, {}

    def link(self, source: Piece, target: Piece) -> None:
        self.after[source][target] = None
        self.before[target][source] = None

    def contract(self, piece: Piece) -> None:
        """Takes a piece out and links what comes before it to what comes after it."""
        before, after = self.before.pop(piece), self.after.pop(piece)
        before.pop(piece, None)
        after.pop(piece, None)
        for source in before:
            del self.after[source][piece]
        for target in after:
            del self.before[target][piece]
        for source in before:
            for target in after:
                self.link(source, target)
        del self.length[piece]

    def chains(self) -> list[tuple[Piece, ...]]:
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


def _lane_links(records: OpenDriveRecords, graph: _Graph) -> Iterator[tuple[Piece, Piece]]:
    """Links that the lanes themselves name, in driving direction."""
    for piece in graph.length:
        road = records.roads[piece.road]
        lane = road.sections[piece.section].lanes[piece.lane]
        forward = runs_forward(road, piece.lane)
        for number, step in ((lane.predecessor, -1), (lane.successor, 1)):
            section = _neighbour_section(records, road, piece.section, step)
            if number is None or section is None:
                continue
            other = Piece(*section, number)
            if number not in records.roads[other.road].sections[other.section].lanes:
                raise TownError(
                    records.source,
                    f"road {piece.road} / laneSection {piece.section} / lane {piece.lane}",
                    f"links to lane {number} of road {other.road}, which has no such lane there",
                )
            if other in graph.length:  # a lane may end in one of another type
                yield (piece, other) if forward == (step > 0) else (other, piece)


def _neighbour_section(records: OpenDriveRecords, road: RoadRecord, section: int, step: int) -> tuple[int, int] | None:
    """Road and section before (-1) or behind (+1) a section; None at a junction and where the road ends."""
    if 0 <= section + step < len(road.sections):
        return road.id, section + step
    link = road.successor if step > 0 else road.predecessor
    return _touched(records, link) if link is not None and link.is_road else None


def _touched(records: OpenDriveRecords, link: RoadLink) -> tuple[int, int]:
    """Road and lane section that a link touches."""
    return link.id, 0 if link.contact == "start" else len(records.roads[link.id].sections) - 1


def _connection_links(records: OpenDriveRecords, graph: _Graph) -> Iterator[tuple[Piece, Piece]]:
    """Links that the junctions name; those against the traffic are an exporter's slips and left out."""
    for junction, connections in records.junctions.items():
        for connection in connections:
            connecting = records.roads[connection.connecting]
            entry = connecting.predecessor if connection.contact == "start" else connecting.successor
            if entry is None or not entry.is_road or entry.id != connection.incoming:
                continue  # the connecting road itself does not know of the incoming one
            last = 0 if connection.contact == "start" else len(connecting.sections) - 1
            for source, target in connection.lanes:
                pair = Piece(*_touched(records, entry), source), Piece(connecting.id, last, target)
                _check_lanes(records, junction, connection, pair)
                enters = runs_forward(connecting, target) == (connection.contact == "start")
                if enters and pair[0] in graph.length and pair[1] in graph.length:
                    yield pair


def _check_lanes(
    records: OpenDriveRecords, junction: int, connection: ConnectionRecord, pair: tuple[Piece, Piece]
) -> None:
    for piece in pair:
        if piece.lane not in records.roads[piece.road].sections[piece.section].lanes:
            raise TownError(
                records.source,
                f"junction {junction} / connection from road {connection.incoming} to road {connection.connecting}",
                f"links lane {piece.lane} of road {piece.road}, which has no such lane there",
            )
