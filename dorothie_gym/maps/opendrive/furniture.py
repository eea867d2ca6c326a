"""Signals, crosswalks and sidewalks of an OpenDRIVE file, in the frame of the town."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping

import numpy as np

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import NO_STREET, Array, Crosswalk, Lane, Sidewalk, Signal, SignalKind
from dorothie_gym.maps.opendrive.centrelines import RoadSamples, thin
from dorothie_gym.maps.opendrive.elements import MAX_NUMBER
from dorothie_gym.maps.opendrive.records import (
    SIDEWALK_TYPES,
    CrosswalkRecord,
    OpenDriveRecords,
    RoadRecord,
    SignalRecord,
)
from dorothie_gym.maps.opendrive.topology import LanePiece, Topology, runs_forward
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.portable_math import wrap_radians

# Signal types in CARLA's maps: lights as in OpenDRIVE 1.4, annex, signs by their numbers in German law.
SIGNAL_TYPES = {
    "1000001": SignalKind.TRAFFIC_LIGHT,
    "1000002": SignalKind.OTHER,  # a light for those on foot
    "206": SignalKind.STOP,
    "205": SignalKind.YIELD,
    "274": SignalKind.SPEED,
}

# Kinds that control the end of a lane.
_CONTROLS = (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP, SignalKind.YIELD)

# Largest distance of a light or sign to its junction, across ends of lanes [m].
_FARTHEST_LANE = 50.0

# A signal nearer to the start of its lane, and farther than this from its end, is the far-side signal of a junction
# behind it [m].
_NEAR_THE_END = 30.0


def place_signals(records: OpenDriveRecords, topology: Topology, lanes: tuple[Lane, ...]) -> tuple[Signal, ...]:
    """Returns the signals of a file, one for each `signal` element, in order of their ids.

    `Signal.lanes` are the lanes at whose end it applies (for speed limits: on which it applies): those that lead into
    its junction, and if the file lists connectors, those that lead into them. Lights and signs are dropped with a note
    if none of their lanes is for cars.
    """
    ways = _Ways(topology, lanes)
    ruled: defaultdict[int, dict[int, None]] = defaultdict(dict)
    placed = [(road, record) for road in records.roads.values() for record in road.signals]
    owners = {record.id: (road, record) for road, record in placed if not record.reference}
    for road, record in placed:
        if record.id in owners:  # a reference may have lost its signal
            controls = _kind(owners[record.id][1]) in _CONTROLS
            for lane in ways.ruled(road, record, controls):
                ruled[record.id].update(dict.fromkeys(ways.approaches(lane, controls)))
    others = {number for number, (road, record) in owners.items() if not ruled[number] and _is_for_others(road, record)}
    for road, record in (owners[number] for number in sorted(others)):
        where = f"road {road.name} / signal {record.id}"
        records.notes.dropped(NoteKind.ACCESS, where, "is for lanes that are not for cars")
    kept = sorted(owners.keys() - others)
    return tuple(_signal(number, *owners[number], tuple(sorted(ruled[number])), lanes) for number in kept)


def _kind(record: SignalRecord) -> SignalKind:
    return SIGNAL_TYPES.get(record.type, SignalKind.TRAFFIC_LIGHT if record.dynamic else SignalKind.OTHER)


def _is_for_others(road: RoadRecord, record: SignalRecord) -> bool:
    """Returns whether a light or sign lists lanes, none of which is for cars."""
    if not record.lanes or _kind(record) not in _CONTROLS:
        return False
    lanes = [lane for section in road.sections for lane in section.lanes.values()]
    listed = [lane for lane in lanes if any(min(span) <= lane.id <= max(span) for span in record.lanes) and lane.id]
    return bool(listed) and not any(lane.drives for lane in listed)


class _Ways:
    """Lookup of the lanes that a signal applies to."""

    def __init__(self, topology: Topology, lanes: tuple[Lane, ...]) -> None:
        self._lanes = lanes
        self._at: defaultdict[int, list[tuple[LanePiece, int]]] = defaultdict(list)  # by road
        for k, chain in enumerate(topology.chains):
            for piece in chain:
                self._at[piece.road].append((piece, k))
        self._before: defaultdict[int, list[int]] = defaultdict(list)
        self._after: defaultdict[int, list[int]] = defaultdict(list)
        for source, target in topology.links:
            self._before[target].append(source)
            self._after[source].append(target)

    def ruled(self, road: RoadRecord, record: SignalRecord, controls: bool) -> Iterator[int]:
        """Yields the lanes of the road that a signal applies to: those that it lists, else those of its direction."""

        def away(piece: LanePiece) -> tuple[float, int]:
            section = road.sections[piece.section]
            return max(section.start - record.s, record.s - section.end, 0.0), -piece.section

        # section of the signal, or an adjacent one if it is omitted for zero length
        here = min((piece for piece, _ in self._at[road.id]), key=away, default=None)
        for piece, lane in self._at[road.id]:
            if here is None or piece.section != here.section or not _names(road, record, piece):
                continue
            if record.lanes or not controls or self._lanes[lane].in_junction or self._is_ahead(road, record, lane):
                yield lane

    def _is_ahead(self, road: RoadRecord, record: SignalRecord, lane: int) -> bool:
        """Returns whether a signal stands before the junction as seen from its lane."""
        pieces = [piece for piece, k in self._at[road.id] if k == lane]
        sections = [road.sections[piece.section] for piece in pieces]
        behind = record.s - min(section.start for section in sections)
        ahead = max(section.end for section in sections) - record.s
        if not runs_forward(road, pieces[0].section, pieces[0].lane):
            behind, ahead = ahead, behind
        return ahead <= max(behind, _NEAR_THE_END)

    def approaches(self, lane: int, controls: bool) -> Iterator[int]:
        """Yields the lanes outside junctions that lead to a lane; for junction controls, those that end there."""
        if not self._lanes[lane].in_junction:
            yield self._last_before_junction(lane) if controls else lane
            return
        seen, todo = {lane: None}, [lane]
        while todo:
            for before in self._before[todo.pop()]:
                if not self._lanes[before].in_junction:
                    yield before
                elif before not in seen:
                    seen[before] = None
                    todo.append(before)

    def _last_before_junction(self, lane: int) -> int:
        """Returns the last lane before the next junction, if it is near and the only continuation."""
        way, further = lane, 0.0
        while further <= _FARTHEST_LANE:
            onward = self._after[way]
            if any(self._lanes[k].in_junction for k in onward):
                return way
            if len(onward) != 1:
                break
            way, further = onward[0], further + self._lanes[onward[0]].length
        return lane


def _names(road: RoadRecord, record: SignalRecord, piece: LanePiece) -> bool:
    """Returns whether a signal applies to a lane; if it lists both directions or none, the orientation decides."""
    spans: list[tuple[float, float]] = [(min(span), max(span)) for span in record.lanes] or [(-math.inf, math.inf)]
    if not any(low <= piece.lane <= high for low, high in spans):
        return False
    both = min(low for low, _ in spans) < 0 < max(high for _, high in spans)
    return (
        not both
        or record.orientation not in "+-"
        or (record.orientation == "+") == runs_forward(road, piece.section, piece.lane)
    )


def _signal(
    number: int, road: RoadRecord, record: SignalRecord, ruled: tuple[int, ...], lanes: tuple[Lane, ...]
) -> Signal:
    s = np.clip(np.array([record.s]), 0.0, road.length)
    x, y, heading = (float(v[0]) for v in road.line.place(s))
    z = float(road.elevation.at(s)[0]) + record.z
    position = (x - record.t * pn.sin(heading), -(y + record.t * pn.cos(heading)), z)
    if ruled:  # exporters disagree about orientation and hOffset; a signal faces the traffic to which it applies
        facing = float(lanes[ruled[0]].headings[-1]) + np.pi
    else:
        facing = -(heading + record.heading + (0.0 if record.orientation == "-" else np.pi))
    return Signal(
        id=number,
        kind=_kind(record),
        position=(float(position[0]), float(position[1]), z),
        heading=float(wrap_radians(facing)),
        lanes=ruled,
        value=record.value,
    )


def place_crosswalks(records: OpenDriveRecords) -> tuple[Crosswalk, ...]:
    """Returns the crosswalks of a file, numbered in its order, with outlines (n, 2) in the frame of the town."""
    found = [(road, crossing) for road in records.roads.values() for crossing in road.crosswalks]
    return tuple(Crosswalk(id=k, outline=_outline(road, crossing)) for k, (road, crossing) in enumerate(found))


def _outline(road: RoadRecord, crossing: CrosswalkRecord) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    if crossing.on_road:
        s, t = crossing.corners.T
        x, y, heading = road.line.place(np.clip(s, 0.0, road.length))
        return np.column_stack((x - t * pn.sin(heading), -(y + t * pn.cos(heading))))
    x, y, heading = road.line.place(np.clip(np.array([crossing.s]), 0.0, road.length))
    x, y = x - crossing.t * pn.sin(heading), y + crossing.t * pn.cos(heading)
    angle = heading + crossing.heading
    u, v = crossing.corners.T
    return np.column_stack((x + u * pn.cos(angle) - v * pn.sin(angle), -(y + u * pn.sin(angle) + v * pn.cos(angle))))


# --- Sidewalks -------------------------------------------------------------------------------------------------------
# Narrowest sidewalk [m].
NARROWEST_SIDEWALK = 0.5

# Shortest sidewalk [m].
SHORTEST_SIDEWALK = 1.0

# Largest jump of a centre line from one sample to the next [m].
LARGEST_JUMP = 2.0

# Largest gap between joined sidewalks of successive lane sections [m].
TOUCHING = 0.5


def lay_sidewalks(
    records: OpenDriveRecords, samples: Mapping[int, RoadSamples], lanes: tuple[Lane, ...]
) -> tuple[Sidewalk, ...]:
    """Returns the sidewalks of a file, along their roads, in its order.

    Args:
        records: the file.
        samples: its roads, by their ids.
        lanes: lanes of the town with streets; a sidewalk belongs to the street on its side of its road, and on a
            road without lanes to that of its name.
    """
    street: dict[tuple[int, bool], int] = {}
    for lane in lanes:
        for left in (lane.lane_id > 0, lane.lane_id < 0):  # the other side's lanes are used where a side has none
            if lane.street != NO_STREET:
                street.setdefault((lane.road_id, left), lane.street)
    named = {records.roads[lane.road_id].street: lane.street for lane in lanes if not lane.in_junction}
    named[""] = NO_STREET
    found = [
        (line, street.get((road.id, left), named.get(road.street, NO_STREET)))
        for road in records.roads.values()
        for left in (True, False)
        for line in _stretches(road, samples[road.id], left)
    ]
    return tuple(
        Sidewalk(id=k, points=line[:, :3].copy(), width=float(np.median(line[:, 3])), street=number)
        for k, (line, number) in enumerate(found)
    )


def _stretches(road: RoadRecord, samples: RoadSamples, left: bool) -> Iterator[Array]:
    """Yields the centre lines (n, 4) of the sidewalks at one side of a road: x, y, z, width [m]."""
    open_: list[Array] = []
    for k, section in enumerate(road.sections):
        begun = []
        for number, lane in sorted(section.lanes.items()):
            if lane.type in SIDEWALK_TYPES and (number > 0) == left:
                for line in _wide_parts(samples.line([(k, number)])):
                    before = next((j for j, other in enumerate(open_) if _gap(other[-1], line[0]) < TOUCHING), None)
                    begun.append(line if before is None else np.concatenate((open_.pop(before), line)))
        yield from _finished(open_)
        open_ = begun
    yield from _finished(open_)


def _wide_parts(line: Array) -> list[Array]:
    """Returns the parts of a centre line with sufficient width, split at jumps in the profiles."""
    if not np.all(np.abs(line) <= MAX_NUMBER):  # also for NaN
        return []
    wide = line[:, 3] >= NARROWEST_SIDEWALK
    step = pn.hypot(*np.diff(line[:, :2], axis=0).T)
    edges = np.flatnonzero(np.diff(wide) | (step > LARGEST_JUMP)) + 1
    return [part for part in np.split(line, edges) if part[0, 3] >= NARROWEST_SIDEWALK]


def _gap(a: Array, b: Array) -> float:
    return float(pn.hypot(*(a[:2] - b[:2])))


def _finished(lines: list[Array]) -> Iterator[Array]:
    for line in lines:
        if float(pn.hypot(*np.diff(line[:, :2], axis=0).T).sum()) >= SHORTEST_SIDEWALK:
            yield thin(line)
