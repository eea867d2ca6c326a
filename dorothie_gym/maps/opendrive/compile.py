"""OpenDRIVE compiler: from records to a `Town`."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.long_lanes import cut_long_lanes
from dorothie_gym.maps.model import Array, Junction, Lane, LaneLink, SignalKind
from dorothie_gym.maps.opendrive.centrelines import sample_centrelines, sample_road
from dorothie_gym.maps.opendrive.furniture import lay_sidewalks, place_crosswalks, place_signals
from dorothie_gym.maps.opendrive.lane_changes import lane_change_links
from dorothie_gym.maps.opendrive.parse import parse_opendrive
from dorothie_gym.maps.opendrive.street_names import find_streets
from dorothie_gym.maps.opendrive.topology import LanePiece, Topology, build_topology, successor_links
from dorothie_gym.maps.opendrive.traffic_rule import driving_side
from dorothie_gym.maps.site_inference import APPROACH, lay_sites
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.traffic_light_programs import derive_programmes
from dorothie_gym.maps.trapped_lanes import trapped_lanes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dorothie_gym.maps.import_notes import ImportNotes
    from dorothie_gym.maps.model import Signal
    from dorothie_gym.maps.opendrive.records import OpenDriveRecords, RoadRecord
    from dorothie_gym.maps.town import LightProgramme

# Speed limit of roads without one, as in built-up areas [m/s] (50 km/h).
DEFAULT_SPEED_LIMIT = 50.0 / 3.6


def read_opendrive(path: str | Path) -> Town:
    """Reads an OpenDRIVE file (1.4 to 1.8) into a town with the name of the file.

    The y axis of the file points north and that of a town south: all coordinates are mirrored. A lane is a chain of
    lane sections of one road; lanes of types other than "driving" (and those of ramps) are ignored. Elements that
    cannot be understood are dropped, and the first of each kind logged as warnings.

    Args:
        path: file to read.

    Returns:
        The town. Streets and landmark sites, which OpenDRIVE does not have, are inferred.

    Raises:
        TownError: the file is no OpenDRIVE, or has no driving lane; the message names the file, the element and the
            reason.
    """
    town, notes = import_opendrive(path)
    notes.log()
    return town


def import_opendrive(path: str | Path) -> tuple[Town, ImportNotes]:
    """Reads a file like `read_opendrive`; also returns what was dropped, repaired or assumed."""
    records = parse_opendrive(path)
    samples = {road.id: sample_road(road) for road in records.roads.values()}
    topology, lines = sample_centrelines(records, build_topology(records), samples)
    lanes = _lanes(records, topology, lines)
    traffic = driving_side(records, lanes)
    lanes = tuple(_numbered_outwards(records, topology, lane, traffic) for lane in lanes)
    links = successor_links(records, lanes, topology) + lane_change_links(records, topology, lanes)
    if trapped := trapped_lanes(lanes, links, traffic):
        topology, lanes, links = _without(trapped, topology, lanes, links, records)
    lanes, streets = find_streets(records, lanes, links)
    junctions, signals = _junctions(lanes), place_signals(records, topology, lanes)
    town = Town(
        name=Path(path).stem,
        lanes=lanes,
        links=links,
        junctions=junctions,
        streets=streets,
        sites=lay_sites(lanes, links, traffic=traffic, approach=APPROACH),
        signals=signals,
        crosswalks=place_crosswalks(records),
        sidewalks=lay_sidewalks(records, samples, lanes),
        programmes=_programmes(records, derive_programmes(lanes, links, junctions, signals, traffic), signals),
        traffic=traffic,
        cruise=None,
        titled=not records.own,
    )
    return cut_long_lanes(town, records.notes), records.notes


def _without(
    trapped: frozenset[int],
    topology: Topology,
    lanes: tuple[Lane, ...],
    links: tuple[LaneLink, ...],
    records: OpenDriveRecords,
) -> tuple[Topology, tuple[Lane, ...], tuple[LaneLink, ...]]:
    """Drops lanes that lead nowhere, with notes; the others are renumbered."""
    for lane in (lanes[k] for k in sorted(trapped)):
        if not lane.in_junction:
            where = f"road {records.roads[lane.road_id].name} / lane {lane.lane_id}"
            records.notes.dropped(NoteKind.LANE, where, "leads nowhere: a car can neither go on nor turn round there")
    kept = {lane.id: new for new, lane in enumerate(lane for lane in lanes if lane.id not in trapped)}
    rest = tuple(replace(lanes[old], id=new) for old, new in kept.items())
    among = (link for link in links if link.source in kept and link.target in kept)
    return topology.without(trapped), rest, tuple(LaneLink(kept[a.source], kept[a.target], a.type) for a in among)


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


def _numbered_outwards(records: OpenDriveRecords, topology: Topology, lane: Lane, traffic: DrivingSide) -> Lane:
    """Returns a lane with a number that grows from the middle of the road to the kerb.

    The numbers of a file grow with the distance from the reference line, which SUMO draws at the kerb in left-hand
    traffic.
    """
    piece = topology.chains[lane.id][0]
    road = records.roads[piece.road]
    if road.right_hand == (traffic is DrivingSide.RIGHT):
        return lane
    side = [abs(number) for number in road.sections[piece.section].lanes if number * piece.lane > 0]
    number = max(side) + 1 - abs(piece.lane)
    return replace(lane, lane_id=number if piece.lane > 0 else -number)


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


def _programmes(
    records: OpenDriveRecords, derived: Sequence[LightProgramme], signals: Sequence[Signal]
) -> tuple[LightProgramme, ...]:
    """Returns the programmes of the file, and those derived for other junctions."""
    lights = {signal.id for signal in signals if signal.kind is SignalKind.TRAFFIC_LIGHT}
    found = {programme.junction_id: programme for programme in derived}
    for junction, programme in records.programmes.items():
        if set(programme.signals) <= lights:
            found[junction] = programme
        else:
            reason = "refers to signals that are no lights of the file; its lights have a programme of the usual kind"
            records.notes.dropped(NoteKind.SIGNAL, f"junction {junction} / userData", reason)
    return tuple(found[junction] for junction in sorted(found))


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
