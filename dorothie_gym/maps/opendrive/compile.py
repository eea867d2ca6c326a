"""OpenDRIVE compiler: from records to a `Town`."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.model import Array, Junction, Lane, LaneLink, LinkType
from dorothie_gym.maps.opendrive.centrelines import sample_centrelines, sample_road
from dorothie_gym.maps.opendrive.furniture import lay_sidewalks, place_crosswalks, place_signals
from dorothie_gym.maps.opendrive.parse import parse_opendrive
from dorothie_gym.maps.opendrive.topology import LanePiece, Topology, build_topology, successor_links
from dorothie_gym.maps.street_inference import lay_sites, name_streets
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.traffic_light_programs import derive_programmes

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.records import OpenDriveRecords, RoadRecord

# Speed limit of roads without one, as in built-up areas [m/s] (50 km/h).
DEFAULT_SPEED_LIMIT = 50.0 / 3.6

# Shortest length of parallel lanes with a lane change [m].
SHORTEST_LANE_CHANGE = 5.0


def read_opendrive(path: str | Path) -> Town:
    """Reads an OpenDRIVE file (1.4, as CARLA's towns) into a town with the name of the file.

    The y axis of the file points north and that of a town south: all coordinates are mirrored. A lane is a chain of
    lane sections of one road; lanes of types other than "driving" (and those of ramps) are ignored.

    Args:
        path: file to read.

    Returns:
        The town. Streets and landmark sites, which OpenDRIVE does not have, are inferred.

    Raises:
        TownError: the file is invalid; the message names the file, the element and the reason.
    """
    records = parse_opendrive(path)
    topology = build_topology(records)
    samples = {road.id: sample_road(road) for road in records.roads.values()}
    lanes = _lanes(records, topology, sample_centrelines(records, topology, samples))
    links = successor_links(lanes, topology) + _lane_change_links(records, topology, lanes)
    lanes, streets = name_streets(lanes, links)
    junctions, signals = _junctions(lanes), place_signals(records, topology, lanes)
    return Town(
        name=Path(path).stem,
        lanes=lanes,
        links=links,
        junctions=junctions,
        streets=streets,
        sites=lay_sites(lanes, links),
        signals=signals,
        crosswalks=place_crosswalks(records),
        sidewalks=lay_sidewalks(records, samples, lanes),
        programmes=derive_programmes(lanes, links, junctions, signals),
    )


def _lanes(records: OpenDriveRecords, topology: Topology, lines: list[Array]) -> tuple[Lane, ...]:
    limits = _speed_limits(records, topology)
    return tuple(
        Lane(
            id=k,
            road_id=chain[0].road,
            lane_id=chain[0].lane,
            junction_id=records.roads[chain[0].road].junction,
            points=line[:, :3].copy(),
            widths=line[:, 3].copy(),
            speed_limit=limit,
        )
        for k, (chain, line, limit) in enumerate(zip(topology.chains, lines, limits, strict=True))
    )


def _speed_limits(records: OpenDriveRecords, topology: Topology) -> list[float]:
    """Returns the speed limit of each lane; lanes without one (most connectors) take the lowest of their links."""
    own = [_own_limit(records.roads[chain[0].road], chain) for chain in topology.chains]
    linked: defaultdict[int, list[float]] = defaultdict(list)
    for source, target in topology.links:
        for lane, other in ((source, own[target]), (target, own[source])):
            if other is not None:
                linked[lane].append(other)
    return [min(linked[k], default=DEFAULT_SPEED_LIMIT) if limit is None else limit for k, limit in enumerate(own)]


def _own_limit(road: RoadRecord, chain: tuple[LanePiece, ...]) -> float | None:
    """Returns the lowest speed limit on a lane according to its road or lane records, or None."""
    limits = [speed for p in chain for _, speed in road.sections[p.section].lanes[p.lane].speeds]
    if not limits:
        start = min(road.sections[p.section].start for p in chain)
        end = max(road.sections[p.section].end for p in chain)
        until = [*(s for s, _ in road.speeds[1:]), np.inf]
        limits = [v for (s, v), e in zip(road.speeds, until, strict=False) if s < end and e > start]
    return min(limits, default=None)


def _lane_change_links(records: OpenDriveRecords, topology: Topology, lanes: tuple[Lane, ...]) -> tuple[LaneLink, ...]:
    """Returns lane changes between parallel lanes, each pair once and the longest neighbour of a lane first."""
    lane_of = {piece: k for k, chain in enumerate(topology.chains) for piece in chain}
    shared: defaultdict[tuple[int, int], float] = defaultdict(float)
    open_: defaultdict[tuple[int, int], bool] = defaultdict(bool)
    for piece, inner in lane_of.items():
        road = records.roads[piece.road]
        section = road.sections[piece.section]
        outward = 1 if piece.lane > 0 else -1
        outer = lane_of.get(LanePiece(piece.road, piece.section, piece.lane + outward))
        if lanes[inner].in_junction or outer is None:
            continue
        changes = section.lanes[piece.lane].changes  # the mark on a lane's outer edge
        for pair, toward in (((inner, outer), outward), ((outer, inner), -outward)):
            shared[pair] += section.end - section.start
            open_[pair] |= _permits(changes, toward)
    rows = []
    for (source, target), length in shared.items():
        if open_[source, target] and length >= SHORTEST_LANE_CHANGE:
            outward = abs(lanes[target].lane_id) > abs(lanes[source].lane_id)
            rows.append((source, -length, target, _side(records.roads[lanes[source].road_id], outward)))
    return tuple(LaneLink(source, target, side) for source, _, target, side in sorted(rows))


def _permits(changes: tuple[str, ...], toward: int) -> bool:
    """Returns whether a road mark permits changes to higher (1) or lower (-1) lane numbers; by default it does."""
    allowing = ("both", "increase" if toward > 0 else "decrease")
    return not changes or any(change in allowing for change in changes)


def _side(road: RoadRecord, outward: bool) -> LinkType:
    """Returns the side on which the outer (or inner) lane lies: the outer one is at the kerb."""
    return LinkType.LANE_CHANGE_RIGHT if outward == road.right_hand else LinkType.LANE_CHANGE_LEFT


def _junctions(lanes: tuple[Lane, ...]) -> tuple[Junction, ...]:
    """Returns the junctions, each at the centre of the bounding box of its connectors."""
    members: defaultdict[int, list[Lane]] = defaultdict(list)
    for lane in lanes:
        if lane.in_junction:
            members[lane.junction_id].append(lane)
    junctions = []
    for number in sorted(members):
        points = np.concatenate([lane.points[:, :2] for lane in members[number]])
        x, y = 0.5 * (points.min(axis=0) + points.max(axis=0))
        connectors = tuple(lane.id for lane in members[number])
        junctions.append(Junction(id=number, position=(float(x), float(y)), connectors=connectors))
    return tuple(junctions)
