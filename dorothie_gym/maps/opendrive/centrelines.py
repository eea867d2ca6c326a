"""Centre lines of OpenDRIVE lanes: sampled densely from the profiles of the road, thinned, and joined at links."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import Array
from dorothie_gym.maps.opendrive.car_paths import turn_between
from dorothie_gym.maps.opendrive.connectors import lane_name, repair_connectors
from dorothie_gym.maps.opendrive.elements import MAX_NUMBER
from dorothie_gym.maps.opendrive.lane_loops import SHARPEST, turns_back, without_loops
from dorothie_gym.maps.opendrive.parse import refuse_empty
from dorothie_gym.maps.opendrive.records import SIDEWALK_TYPES, OpenDriveRecords, RoadRecord, SectionRecord
from dorothie_gym.maps.opendrive.topology import SHORTEST_LANE, Topology, runs_forward
from dorothie_gym.support import portable_arrays as pn

# Sampling distance in the file [m]: chords of a 5 m radius deviate by 1.6 mm.
_DENSE_STEP = 0.25
# Sampling distance of curvature [m], and distance between points of the result: largest on straights, largest
# on curves, and smallest [m].
_GRID_STEP = 0.5
_LONGEST_STEP, _LONGEST_CURVE_STEP, _SHORTEST_STEP = 20.0, 2.0, 0.25
# Target for the distance between chord and arc [m]; together with the sampling error it stays below 1 cm.
_CHORD_ERROR = 0.005
# Curvature below which a lane counts as straight [1/m]: 20 m of it bend by 5 mm.
_STRAIGHT_CURVATURE = 1e-4
# Largest gap between linked lanes that is closed [m]; larger gaps are not rounding errors, remain as they are, and
# are reported by `lint`. CARLA's maps need 2 mm.
_LARGEST_STITCH = 0.05
# Largest jump of a centre line from one sample to the next [m].
_LARGEST_JUMP = 10.0
# Length over which a lane is deformed towards its moved end [m], per metre of shift and at least for one.
_STITCH_LENGTH = 10.0
# A lane is opening or closing below this width [m] and this share of its greatest width (or of the linked lanes).
_OPEN_WIDTH, _OPEN_SHARE = 1.75, 0.5


class LanePlace(NamedTuple):
    """Place of a lane beside its reference line.

    Attributes:
        centre: lateral position of its centre (m,) [m].
        width: (m,) [m].
        level_from: lateral position (m,) from which the cross-section is level, although the road is tilted; None for
            a lane that is tilted with its road.
    """

    centre: Array
    width: Array
    level_from: Array | None = None


@dataclass(frozen=True)
class RoadSamples:
    """Samples along one road, in the frame of the file.

    Attributes:
        x, y, z: reference line (n,) each [m].
        heading: direction of the reference line (n,) [rad].
        tilt: roll angle of the road (n,) [rad], positive with the left side up.
        spans: range of samples of each lane section.
        centres: for each section, the places of driving lanes and sidewalks by lane number.
    """

    x: Array
    y: Array
    z: Array
    heading: Array
    tilt: Array
    spans: tuple[slice, ...]
    centres: tuple[dict[int, LanePlace], ...]

    def line(self, pieces: Iterable[tuple[int, int]]) -> Array:
        """Returns the centre line of successive pieces (section, lane): x, y, z, width in the frame of the TOWN."""
        with np.errstate(over="ignore", invalid="ignore"):  # see `sample_road`
            return np.concatenate([self._piece(section, lane) for section, lane in pieces])

    def _piece(self, section: int, lane: int) -> Array:
        here = self.spans[section]
        lateral, width, level_from = self.centres[section][lane]
        tilted = lateral if level_from is None else level_from
        across = tilted * pn.cos(self.tilt[here])
        if level_from is not None:
            across = across + (lateral - level_from)
        x = self.x[here] - across * pn.sin(self.heading[here])
        y = self.y[here] + across * pn.cos(self.heading[here])
        z = self.z[here] + tilted * pn.sin(self.tilt[here])
        return np.column_stack((x, -y, z, np.maximum(width, 0.0)))  # y points south in the town


def sample_centrelines(
    records: OpenDriveRecords, topology: Topology, samples: Mapping[int, RoadSamples]
) -> tuple[Topology, list[Array]]:
    """Returns the centre lines of all lanes in the frame of the town and in driving direction, joined at links.

    A lane that opens or closes beside others without a link at that end begins where it reaches half of its width:
    the wedge before cannot be driven. Loops inside bends that are too sharp for a lane are cut off. A lane whose centre
    line has no length, jumps or turns back is dropped with a note.

    Args:
        records: records of the file.
        topology: lanes of the file.
        samples: samples of the roads, by road id.

    Returns:
        The lanes that are left, and one array (n, 4) for each: x, y, z and width [m].

    Raises:
        TownError: no lane is left.
    """
    while True:
        lines = _dense_lines(records, topology, samples)
        faults = {k: fault for k, line in enumerate(lines) if (fault := _fault(line))}
        for k, fault in faults.items():
            records.notes.dropped(NoteKind.LANE, lane_name(records, topology, k), fault)
        if len(faults) == len(lines):
            refuse_empty(records.source, records.notes, "has no driving lane whose centre line can be driven")
        if not faults:
            break
        topology = topology.without(faults)  # ends that have lost their links may now be wedges
    lines = [thin(_cut(records, topology, k, line)) for k, line in enumerate(lines)]
    topology, lines = _leading_on(records, *repair_connectors(records, topology, lines))
    topology = _without_breaks(records, topology, lines)
    _stitch(lines, topology.links)
    return topology, lines


def _without_breaks(records: OpenDriveRecords, topology: Topology, lines: list[Array]) -> Topology:
    """Returns the topology without links between lanes that do not meet, or meet in opposite directions."""
    kept = []
    for source, target in topology.links:
        gap = float(pn.hypot(*(lines[target][0, :2] - lines[source][-1, :2])))
        turn = turn_between(lines[source], lines[target])
        if gap > _LARGEST_JUMP or turn > SHARPEST:
            to = lane_name(records, topology, target)
            reason = f"does not lead to {to}: {gap:.1f} m away, at an angle of {np.degrees(turn):.0f} degrees"
            records.notes.dropped(NoteKind.LANE_LINK, lane_name(records, topology, source), reason)
        else:
            kept.append((source, target))
    return topology if len(kept) == len(topology.links) else Topology(topology.chains, tuple(kept))


def _dense_lines(records: OpenDriveRecords, topology: Topology, samples: Mapping[int, RoadSamples]) -> list[Array]:
    """Returns the samples of all lanes (n, 4) in driving direction, without wedges."""
    entered, left = ({link[k] for link in topology.links} for k in (1, 0))
    lines = []
    for k, chain in enumerate(topology.chains):
        road = records.roads[chain[0].road]
        forward = runs_forward(road, chain[0].section, chain[0].lane)
        dense = samples[road.id].line((p.section, p.lane) for p in (chain if forward else chain[::-1]))
        dense = dense if forward else dense[::-1]
        if k not in entered or k not in left:
            dense = _without_wedges(dense, k not in entered, k not in left)
        lines.append(dense)
    return lines


def _is_open(widths: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return widths >= min(_OPEN_WIDTH, _OPEN_SHARE * float(widths.max()))


def _without_wedges(line: Array, at_start: bool, at_end: bool) -> Array:
    """Removes the samples at the ends of a centre line (n, 4) where the lane is still opening or already closing."""
    wide = np.flatnonzero(_is_open(line[:, 3]))
    if not len(wide):  # a width that is not a number
        return line
    first, last = wide[0] if at_start else 0, wide[-1] if at_end else len(line) - 1
    kept = line[first : last + 1]
    return kept if pn.hypot(*np.ptp(kept[:, :2], axis=0)) >= SHORTEST_LANE else line


def _fault(dense: Array) -> str:
    """Returns the reason why a centre line (n, 4) cannot be driven; empty if there is none."""
    if not np.all(np.abs(dense) <= MAX_NUMBER):  # also for NaN
        return "its centre line has a position that is no finite number; check geometry, offsets and widths"
    if pn.hypot(*np.ptp(dense[:, :2], axis=0)) < SHORTEST_LANE / 2:
        return "its centre line shrinks to a point: the bend is too sharp for it"
    jump = float(np.max(pn.hypot(*np.diff(dense[:, :2], axis=0).T)))
    return f"its centre line jumps by {jump:.1f} m; check geometry, offsets and widths" if jump > _LARGEST_JUMP else ""


def _cut(records: OpenDriveRecords, topology: Topology, lane: int, dense: Array) -> Array:
    """Returns a centre line (n, 4) without loops, with a note; one that never turns forward again stays as it is."""
    line = without_loops(dense)
    if line is None or line is dense:
        return dense
    reason = "lies inside a bend that is too sharp for it; the loops of its centre line were cut off"
    records.notes.repaired(NoteKind.LANE, lane_name(records, topology, lane), reason)
    return line


def _leading_on(records: OpenDriveRecords, topology: Topology, lines: list[Array]) -> tuple[Topology, list[Array]]:
    """Returns the lanes without those whose centre lines (n, 4) turn back."""
    bad = {k for k, line in enumerate(lines) if turns_back(line)}
    for k in sorted(bad):
        reason = "its centre line turns back; check geometry and offsets"
        records.notes.dropped(NoteKind.LANE, lane_name(records, topology, k), reason)
    if len(bad) == len(lines):
        refuse_empty(records.source, records.notes, "has no driving lane whose centre line can be driven")
    return topology.without(bad), [line for k, line in enumerate(lines) if k not in bad]


def sample_road(road: RoadRecord) -> RoadSamples:
    """Samples a road every 0.25 m, section by section."""
    pieces, picks, spans = [], [], []
    total = 0
    for section in road.sections:
        length = section.end - section.start
        count = int(np.ceil(length / _DENSE_STEP)) + 1 if length > 0.0 else 1
        s = np.linspace(section.start, section.end, count)
        pieces.append(s)
        # the end of a section belongs to its own profiles, not to those of the next one
        picks.append(np.minimum(s, section.end - min(1e-7, 0.5 * length)))
        spans.append(slice(total, total + count))
        total += count
    s, pick = np.concatenate(pieces), np.concatenate(picks)
    with np.errstate(over="ignore", invalid="ignore"):  # lanes at such places are dropped
        x, y, heading = road.line.place(s, pick)
        offset = road.offset.at(s, pick)
        elevation, tilt = road.elevation.at(s, pick), road.superelevation.at(s, pick)
        tilts = bool(np.any(tilt))
        centres = tuple(
            _lateral_places(section, s[span] - section.start, pick[span] - section.start, offset[span], tilts)
            for section, span in zip(road.sections, spans, strict=True)
        )
    return RoadSamples(x=x, y=y, z=elevation, heading=heading, tilt=tilt, spans=tuple(spans), centres=centres)


def _lateral_places(section: SectionRecord, ds: Array, pick: Array, offset: Array, tilts: bool) -> dict[int, LanePlace]:
    """Returns the places of the lanes of a section, stacked from the centre outwards.

    A lane with a border ends at it regardless of the lanes between (OpenDRIVE 1.7, section 11.6.2). Level lanes at the
    edge of a tilted road continue level from the tilted lanes.
    """
    places = {}
    for side in (1, -1):
        edge, level_from = offset, None
        for number in sorted((n for n in section.lanes if n * side > 0), key=abs):
            lane = section.lanes[number]
            here, picked = ds + lane.shift, pick + lane.shift
            width = lane.width.at(here, picked) if lane.border is None else side * (lane.border.at(here, picked) - edge)
            if not (tilts and lane.level):
                level_from = None
            elif level_from is None:
                level_from = edge
            if lane.drives or lane.type in SIDEWALK_TYPES:
                places[number] = LanePlace(edge + 0.5 * side * width, width, level_from)
            edge = edge + side * width
    return places


def thin(line: Array) -> Array:
    """Thins a line (n, 4) to as few points as its curvature, width and height allow."""
    step = pn.hypot(*np.diff(line[:, :2], axis=0).T)
    line = line[np.concatenate(([True], step > 1e-6))]
    station = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(line[:, :2], axis=0).T))))
    count = max(2, int(np.ceil(station[-1] / _GRID_STEP)))
    grid = np.linspace(0.0, station[-1], count + 1)
    h = grid[1]
    bend = np.diff(_at(grid, station, line), n=2, axis=0) / h**2  # (count - 1, 4) second derivatives
    curvature = pn.hypot(bend[:, 0], bend[:, 1])
    sharpest = np.max(np.column_stack((curvature, np.abs(bend[:, 2:]))), axis=1)
    longest = np.where(curvature > _STRAIGHT_CURVATURE, _LONGEST_CURVE_STEP, _LONGEST_STEP)
    spacing = np.clip(np.sqrt(8.0 * _CHORD_ERROR / np.maximum(sharpest, 1e-9)), _SHORTEST_STEP, longest)
    spacing = np.concatenate((spacing[:1], np.minimum(spacing[:-1], spacing[1:]), spacing[-1:]))  # (count,) intervals
    points = np.concatenate(([0.0], np.cumsum(h / spacing)))  # number of points so far
    total = max(1, int(np.ceil(points[-1] - 1e-9)))
    return _at(np.interp(np.linspace(0.0, points[-1], total + 1), points, grid), station, line)


def _at(where: Array, station: Array, line: Array) -> Array:
    return np.column_stack([np.interp(where, station, column) for column in line.T])


def _stitch(lines: list[Array], links: tuple[tuple[int, int], ...]) -> None:
    """Joins the ends of linked lanes at a common point: files have gaps of millimetres or centimetres."""
    group = list(range(2 * len(lines)))  # 2 k is the start of lane k, 2 k + 1 its end

    def find(end: int) -> int:
        while group[end] != end:
            end = group[end]
        return end

    for source, target in links:
        a, b = find(2 * source + 1), find(2 * target)
        group[max(a, b)] = min(a, b)
    members: dict[int, list[int]] = {}
    for end in range(2 * len(lines)):
        members.setdefault(find(end), []).append(end)
    for ends in members.values():
        if len(ends) > 1:
            _join(lines, ends)


def _join(lines: list[Array], ends: list[int]) -> None:
    """Joins ends of lanes at the mean of those that are open; opening lanes start from that point."""
    places = np.array([lines[e // 2][-1 if e % 2 else 0] for e in ends])  # (n, 4)
    open_ = _is_open(places[:, 3])
    target = places[open_, :3].mean(axis=0)
    shift = target - places[:, :3]
    if np.ptp(places[open_, :3], axis=0).max() > _LARGEST_STITCH or np.max(np.abs(shift)) <= 1e-9:
        return
    for end, move, width in zip(ends, shift, places[:, 3], strict=True):
        if pn.hypot(*move[:2]) <= max(_LARGEST_STITCH, places[:, 3].max() - width):
            _move_end(lines[end // 2], bool(end % 2), move)


def _move_end(line: Array, at_end: bool, move: Array) -> None:
    station = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(line[:, :2], axis=0).T))))
    away = station[-1] - station if at_end else station
    reach = min(_STITCH_LENGTH * max(1.0, float(pn.hypot(*move[:2]))), station[-1])
    line[:, :3] += (0.5 + 0.5 * pn.cos(np.pi * np.minimum(away / reach, 1.0)))[:, None] * move
