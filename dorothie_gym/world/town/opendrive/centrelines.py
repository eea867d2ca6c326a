"""Centre lines of lanes: sampled densely from the road's profiles, thinned where they are straight, joined at links."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dorothie_gym.world.town.model import Array, TownError
from dorothie_gym.world.town.opendrive.records import OpenDriveRecords, RoadRecord
from dorothie_gym.world.town.opendrive.topology import SHORTEST_LANE, Piece, Topology, runs_forward

# Distance between the samples taken from the file [m]: the chord of a 5 m radius is then 1.6 mm off its arc.
_DENSE_STEP = 0.25
# Distance at which curvature is measured [m], and the one between points of the result: largest on straights, largest
# on curves, smallest.
_GRID_STEP = 0.5
_LONGEST_STEP, _LONGEST_CURVE_STEP, _SHORTEST_STEP = 20.0, 2.0, 0.25
# Largest distance between a chord and its arc that we aim at [m]; with the sampling's error it stays below 1 cm.
_CHORD_ERROR = 0.005
# Curvature below which a lane counts as straight [1/m]: 20 m of it bend by 5 mm.
_STRAIGHT = 1e-4
# Ends of linked lanes further apart than this [m] are no slip of rounding: they are left as the file has them.
_LARGEST_STITCH = 1.0
# A lane's own centre line may not jump further than this from one sample to the next [m].
_LARGEST_JUMP = 10.0
# Length over which a lane gives way to its moved end [m].
_STITCH_LENGTH = 10.0


@dataclass(frozen=True)
class _RoadSamples:
    """Samples along one road: reference line (n,) each, heading [rad], and what belongs to which section."""

    x: Array
    y: Array
    z: Array
    heading: Array
    spans: tuple[slice, ...]
    centres: tuple[dict[int, tuple[Array, Array]], ...]  # per section: lane -> (lateral place, width), (m,) [m]


def sample_centrelines(records: OpenDriveRecords, topology: Topology) -> list[Array]:
    """Centre lines of all lanes in our frame and in driving direction, ends of linked lanes joined.

    Returns:
        One array (n, 4) a lane: x, y, z and width [m].

    Raises:
        TownError: a lane's centre line has no length, or leaves a gap that no rounding explains.
    """
    samples: dict[int, _RoadSamples] = {}
    lines = []
    for chain in topology.chains:
        road = records.roads[chain[0].road]
        if road.id not in samples:
            samples[road.id] = _sample_road(road)
        dense = _dense_line(road, samples[road.id], chain)
        fault = _fault(dense)
        if fault:
            element = f"road {road.id} / laneSection {chain[0].section} / lane {chain[0].lane}"
            raise TownError(records.source, element, fault)
        lines.append(_thin(dense))
    _stitch(lines, topology.links)
    return lines


def _fault(dense: Array) -> str:
    """What makes a centre line (n, 4) impossible to drive; empty if nothing does."""
    if np.hypot(*np.ptp(dense[:, :2], axis=0)) < SHORTEST_LANE / 2:
        return "its centre line shrinks to a point: the bend is too sharp for it"
    jump = float(np.max(np.hypot(*np.diff(dense[:, :2], axis=0).T)))
    return f"its centre line jumps by {jump:.1f} m; check geometry, offsets and widths" if jump > _LARGEST_JUMP else ""


def _sample_road(road: RoadRecord) -> _RoadSamples:
    pieces, picks, spans = [], [], []
    total = 0
    for section in road.sections:
        length = section.end - section.start
        count = int(np.ceil(length / _DENSE_STEP)) + 1 if length > 0.0 else 1
        s = np.linspace(section.start, section.end, count)
        pieces.append(s)
        # At its end a section still obeys its own profiles, not those that begin there with the next one.
        picks.append(np.minimum(s, section.end - min(1e-7, 0.5 * length)))
        spans.append(slice(total, total + count))
        total += count
    s, pick = np.concatenate(pieces), np.concatenate(picks)
    x, y, heading = road.line.place(s, pick)
    offset = road.offset.at(s, pick)
    centres = tuple(
        _lateral_places(road, k, s[span] - road.sections[k].start, pick[span] - road.sections[k].start, offset[span])
        for k, span in enumerate(spans)
    )
    return _RoadSamples(x, y, road.elevation.at(s, pick), heading, tuple(spans), centres)


def _lateral_places(
    road: RoadRecord, section: int, ds: Array, pick: Array, offset: Array
) -> dict[int, tuple[Array, Array]]:
    """Centre and width of each driving lane of a section: the lanes are laid side by side from the middle outwards."""
    lanes = road.sections[section].lanes
    places = {}
    for side in (1, -1):
        edge = offset
        for number in sorted((n for n in lanes if n * side > 0), key=abs):
            width = lanes[number].width.at(ds, pick)
            if lanes[number].type == "driving":
                places[number] = (edge + 0.5 * side * width, width)
            edge = edge + side * width
    return places


def _dense_line(road: RoadRecord, samples: _RoadSamples, chain: tuple[Piece, ...]) -> Array:
    forward = runs_forward(road, chain[0].lane)
    pieces = chain if forward else chain[::-1]
    index = np.concatenate([np.arange(span.start, span.stop) for span in (samples.spans[p.section] for p in pieces)])
    lateral = np.concatenate([samples.centres[p.section][p.lane][0] for p in pieces])
    width = np.concatenate([samples.centres[p.section][p.lane][1] for p in pieces])
    heading = samples.heading[index]
    x = samples.x[index] - lateral * np.sin(heading)
    y = samples.y[index] + lateral * np.cos(heading)
    line = np.column_stack((x, -y, samples.z[index], np.maximum(width, 0.0)))  # y south from here on
    return line if forward else line[::-1]


def _thin(line: Array) -> Array:
    """The same line with as few points as its curvature, its width and its height allow."""
    step = np.hypot(*np.diff(line[:, :2], axis=0).T)
    line = line[np.concatenate(([True], step > 1e-6))]
    station = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))))
    count = max(2, int(np.ceil(station[-1] / _GRID_STEP)))
    grid = np.linspace(0.0, station[-1], count + 1)
    h = grid[1]
    bend = np.diff(_at(grid, station, line), n=2, axis=0) / h**2  # (count - 1, 4) second derivatives
    curvature = np.hypot(bend[:, 0], bend[:, 1])
    sharpest = np.max(np.column_stack((curvature, np.abs(bend[:, 2:]))), axis=1)
    longest = np.where(curvature > _STRAIGHT, _LONGEST_CURVE_STEP, _LONGEST_STEP)
    spacing = np.clip(np.sqrt(8.0 * _CHORD_ERROR / np.maximum(sharpest, 1e-9)), _SHORTEST_STEP, longest)
    spacing = np.concatenate((spacing[:1], np.minimum(spacing[:-1], spacing[1:]), spacing[-1:]))  # (count,) intervals
    points = np.concatenate(([0.0], np.cumsum(h / spacing)))  # how many points until here
    total = max(1, int(np.ceil(points[-1] - 1e-9)))
    return _at(np.interp(np.linspace(0.0, points[-1], total + 1), points, grid), station, line)


def _at(where: Array, station: Array, line: Array) -> Array:
    return np.column_stack([np.interp(where, station, column) for column in line.T])


def _stitch(lines: list[Array], links: tuple[tuple[int, int], ...]) -> None:
    """Moves the ends of linked lanes to one common point: files leave gaps of some millimetres or centimetres."""
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
        places = np.array([lines[e // 2][-1 if e % 2 else 0, :3] for e in ends])
        shift = places.mean(axis=0) - places
        if len(ends) > 1 and 1e-9 < np.max(np.abs(shift)) and np.ptp(places, axis=0).max() <= _LARGEST_STITCH:
            for end, move in zip(ends, shift, strict=True):
                _move_end(lines[end // 2], bool(end % 2), move)


def _move_end(line: Array, at_end: bool, move: Array) -> None:
    station = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))))
    away = station[-1] - station if at_end else station
    fade = 0.5 + 0.5 * np.cos(np.pi * np.minimum(away / min(_STITCH_LENGTH, station[-1]), 1.0))
    line[:, :3] += fade[:, None] * move
