"""Pavements of a file: lanes of type sidewalk, joined to stretches along each side of a road."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from dorothie_gym.world.town.model import NO_STREET, Array, Lane, Sidewalk
from dorothie_gym.world.town.opendrive.centrelines import RoadSamples, thin
from dorothie_gym.world.town.opendrive.records import SIDEWALK, OpenDriveRecords, RoadRecord

# Where a sidewalk is narrower nobody walks [m].
NARROWEST = 0.5

# A shorter stretch leads nowhere [m].
SHORTEST = 1.0

# A middle line may not jump further than this from one sample to the next [m].
LARGEST_JUMP = 2.0

# Stretches of two lane sections whose ends are this close are one [m].
TOUCHING = 0.5


def lay_sidewalks(
    records: OpenDriveRecords, samples: Mapping[int, RoadSamples], lanes: tuple[Lane, ...]
) -> tuple[Sidewalk, ...]:
    """Sidewalks of a file, along their roads, in the file's order.

    Args:
        records: the file.
        samples: its roads, by their ids.
        lanes: the town's lanes with their streets; a sidewalk belongs to the street of its side of its road.
    """
    street: dict[tuple[int, bool], int] = {}
    for lane in lanes:
        for left in (lane.lane_id > 0, lane.lane_id < 0):  # the other side's lanes stand in where a side has none
            if lane.street != NO_STREET:
                street.setdefault((lane.road_id, left), lane.street)
    found = [
        (line, street.get((road.id, left), NO_STREET))
        for road in records.roads.values()
        for left in (True, False)
        for line in _stretches(road, samples[road.id], left)
    ]
    return tuple(
        Sidewalk(id=k, points=line[:, :3].copy(), width=float(np.median(line[:, 3])), street=number)
        for k, (line, number) in enumerate(found)
    )


def _stretches(road: RoadRecord, samples: RoadSamples, left: bool) -> Iterator[Array]:
    """Middle lines (n, 4) of the sidewalks at one side of a road: x, y, z, width [m]."""
    open_: list[Array] = []
    for k, section in enumerate(road.sections):
        begun = []
        for number, lane in sorted(section.lanes.items()):
            if lane.type in SIDEWALK and (number > 0) == left:
                for line in _wide_parts(samples.line([(k, number)])):
                    before = next((j for j, other in enumerate(open_) if _gap(other[-1], line[0]) < TOUCHING), None)
                    begun.append(line if before is None else np.concatenate((open_.pop(before), line)))
        yield from _finished(open_)
        open_ = begun
    yield from _finished(open_)


def _wide_parts(line: Array) -> list[Array]:
    """Parts of a middle line where the sidewalk is wide enough; a jump in the file's profiles divides it, too."""
    wide = line[:, 3] >= NARROWEST
    step = np.hypot(*np.diff(line[:, :2], axis=0).T)
    edges = np.flatnonzero(np.diff(wide) | (step > LARGEST_JUMP)) + 1
    return [part for part in np.split(line, edges) if part[0, 3] >= NARROWEST]


def _gap(a: Array, b: Array) -> float:
    return float(np.hypot(*(a[:2] - b[:2])))


def _finished(lines: list[Array]) -> Iterator[Array]:
    for line in lines:
        if float(np.hypot(*np.diff(line[:, :2], axis=0).T).sum()) >= SHORTEST:
            yield thin(line)
