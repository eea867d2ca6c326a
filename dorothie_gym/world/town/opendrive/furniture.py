"""What stands on or beside the roads of a file: lights, signs and crosswalks, placed in our frame."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from dorothie_gym.world.town.model import Crosswalk, Lane, Signal, SignalKind
from dorothie_gym.world.town.opendrive.records import CrosswalkRecord, OpenDriveRecords, RoadRecord, SignalRecord
from dorothie_gym.world.town.opendrive.topology import Topology, runs_forward

# Types of signal that CARLA's maps use: lights as in OpenDRIVE 1.4, annex, signs by their numbers in German law.
SIGNAL_TYPES = {
    "1000001": SignalKind.TRAFFIC_LIGHT,
    "206": SignalKind.STOP,
    "205": SignalKind.YIELD,
    "274": SignalKind.SPEED,
}


def place_signals(records: OpenDriveRecords, topology: Topology, lanes: tuple[Lane, ...]) -> tuple[Signal, ...]:
    """Signals of a file, one for each `signal` element, in order of their ids.

    `Signal.lanes` are the lanes at whose end (or, outside junctions, on which) a driver has to heed it: where the file
    names connectors of a junction, these are the lanes that lead into them.
    """
    chain_at = _lanes_by_section(topology)
    entered_from: defaultdict[int, list[int]] = defaultdict(list)
    for source, target in topology.links:
        entered_from[target].append(source)
    ruled: defaultdict[int, dict[int, None]] = defaultdict(dict)
    owners: dict[int, tuple[RoadRecord, SignalRecord]] = {}
    for road in records.roads.values():
        for record in road.signals:
            if not record.reference:
                owners[record.id] = (road, record)
            for lane in _ruled_lanes(road, record, chain_at):
                approach = entered_from[lane] if lanes[lane].in_junction else [lane]
                ruled[record.id].update(dict.fromkeys(approach))
    return tuple(_signal(number, *owners[number], tuple(sorted(ruled[number])), lanes) for number in sorted(owners))


def _lanes_by_section(topology: Topology) -> dict[tuple[int, int], dict[int, int]]:
    """Lane index by (road, section) and lane number."""
    table: defaultdict[tuple[int, int], dict[int, int]] = defaultdict(dict)
    for k, chain in enumerate(topology.chains):
        for piece in chain:
            table[piece.road, piece.section][piece.lane] = k
    return table


def _ruled_lanes(
    road: RoadRecord, record: SignalRecord, chain_at: dict[tuple[int, int], dict[int, int]]
) -> Iterable[int]:
    """Lanes of this road that a signal rules: those that it names, else those of its direction."""
    starts = [section.start for section in road.sections]
    section = max(0, int(np.searchsorted(starts, record.s, side="right")) - 1)
    for number, lane in chain_at.get((road.id, section), {}).items():
        if record.lanes:
            if any(min(span) <= number <= max(span) for span in record.lanes):
                yield lane
        elif record.orientation not in "+-" or (record.orientation == "+") == runs_forward(road, number):
            yield lane


def _signal(
    number: int, road: RoadRecord, record: SignalRecord, ruled: tuple[int, ...], lanes: tuple[Lane, ...]
) -> Signal:
    s = np.clip(np.array([record.s]), 0.0, road.length)
    x, y, heading = (float(v[0]) for v in road.line.place(s))
    z = float(road.elevation.at(s)[0]) + record.z
    position = (x - record.t * np.sin(heading), -(y + record.t * np.cos(heading)), z)
    if ruled:  # exporters disagree about orientation and hOffset; a signal faces those who have to heed it
        facing = float(lanes[ruled[0]].headings[-1]) + np.pi
    else:
        facing = -(heading + record.heading + (0.0 if record.orientation == "-" else np.pi))
    kind = SIGNAL_TYPES.get(record.type, SignalKind.TRAFFIC_LIGHT if record.dynamic else SignalKind.OTHER)
    return Signal(
        id=number,
        kind=kind,
        position=(float(position[0]), float(position[1]), z),
        heading=float((facing + np.pi) % (2.0 * np.pi) - np.pi),
        lanes=ruled,
        value=record.value,
    )


def place_crosswalks(records: OpenDriveRecords) -> tuple[Crosswalk, ...]:
    """Crosswalks of a file, outlines (n, 2) in our frame, numbered in the file's order."""
    found = [(road, crossing) for road in records.roads.values() for crossing in road.crosswalks]
    return tuple(Crosswalk(id=k, outline=_outline(road, crossing)) for k, (road, crossing) in enumerate(found))


def _outline(road: RoadRecord, crossing: CrosswalkRecord) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    if crossing.on_road:
        s, t = crossing.corners.T
        x, y, heading = road.line.place(np.clip(s, 0.0, road.length))
        return np.column_stack((x - t * np.sin(heading), -(y + t * np.cos(heading))))
    x, y, heading = road.line.place(np.clip(np.array([crossing.s]), 0.0, road.length))
    x, y = x - crossing.t * np.sin(heading), y + crossing.t * np.cos(heading)
    angle = heading + crossing.heading
    u, v = crossing.corners.T
    return np.column_stack((x + u * np.cos(angle) - v * np.sin(angle), -(y + u * np.sin(angle) + v * np.cos(angle))))
