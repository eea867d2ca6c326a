"""Connectors of junctions that no car can follow, drawn again as the shortest path of arcs and a straight.

SUMO joins the two directions of a street at a junction by curves of a radius of half a lane, which begin and end beside
the lanes that they link, at other angles.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import NO_JUNCTION
from dorothie_gym.maps.opendrive.car_paths import path_between, turn_between
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.opendrive.records import OpenDriveRecords
    from dorothie_gym.maps.opendrive.topology import Topology

# A connector is drawn again beyond these limits; maps of other tools stay below them.
LARGEST_GAP = 0.3  # between the ends of linked lanes [m]
LARGEST_KINK = math.radians(15.0)  # change of direction in one point [rad]

# Smallest change of direction of a turnaround [rad].
_TURNAROUND = math.radians(150.0)


def repair_connectors(
    records: OpenDriveRecords, topology: Topology, lines: list[Array]
) -> tuple[Topology, list[Array]]:
    """Draws the connectors again that no car can follow, between the lanes that they link.

    Such turnarounds are dropped where their lanes have other ways on and no part of the town is cut off: a car turns
    round on the street.

    Args:
        records: records of the file.
        topology: lanes of the file.
        lines: centre lines (n, 4) of the lanes.

    Returns:
        The lanes that are left, and their centre lines.
    """
    before, after = _neighbours(topology)
    faults: dict[int, str] = {}
    for k, chain in enumerate(topology.chains):
        inside = records.roads[chain[0].road].junction != NO_JUNCTION
        if inside and len(before[k]) == len(after[k]) == 1:
            fault = _fault(lines[before[k][0]], lines[k], lines[after[k][0]])
            if fault:
                faults[k] = fault
    spare = {
        k
        for k in faults
        if len(after[before[k][0]]) > 1
        and len(before[after[k][0]]) > 1
        and turn_between(lines[before[k][0]], lines[after[k][0]]) > _TURNAROUND
    }
    if spare and not _is_unchanged(topology, spare):
        spare = set()
    new = list(lines)
    for k, fault in faults.items():
        element = lane_name(records, topology, k)
        if k in spare:
            reason = f"{fault}; cars turn round on the street, and other ways lead on"
            records.notes.dropped(NoteKind.TURNAROUND, element, reason)
            continue
        widths = float(lines[k][0, 3]), float(lines[k][-1, 3])
        line = path_between(lines[before[k][0]], lines[after[k][0]], widths)
        if line is not None:
            records.notes.repaired(NoteKind.LANE, element, f"{fault}; the path across the junction was drawn again")
            new[k] = line
    return topology.without(spare), [line for k, line in enumerate(new) if k not in spare]


def _neighbours(topology: Topology) -> tuple[defaultdict[int, list[int]], defaultdict[int, list[int]]]:
    """Returns the lanes before and after each lane."""
    before: defaultdict[int, list[int]] = defaultdict(list)
    after: defaultdict[int, list[int]] = defaultdict(list)
    for source, target in topology.links:
        after[source].append(target)
        before[target].append(source)
    return before, after


def lane_name(records: OpenDriveRecords, topology: Topology, lane: int) -> str:
    """Returns the name of a lane for notes: its first lane record in the file."""
    first = topology.chains[lane][0]
    return f"road {records.roads[first.road].name} / laneSection {first.section} / lane {first.lane}"


def _is_unchanged(topology: Topology, spare: set[int]) -> bool:
    """Returns whether the lanes that are left without some are connected with each other as before."""
    links = np.array(topology.links, dtype=np.intp).reshape(-1, 2)
    kept = np.array([k not in spare for k in range(len(topology.chains))])
    parts = []
    for rows in (links, links[kept[links].all(axis=1)]):
        shape = (len(kept), len(kept))
        graph = coo_array((np.ones(len(rows)), (rows[:, 0], rows[:, 1])), shape=shape).tocsr()
        parts.append(connected_components(graph, directed=True, connection="strong")[1][kept])
    pairs = len(set(zip(*(part.tolist() for part in parts), strict=True)))
    return pairs == len(set(parts[0].tolist())) == len(set(parts[1].tolist()))


def _fault(source: Array, line: Array, target: Array) -> str:
    gap = max(float(pn.hypot(*(line[end, :2] - other[-1 - end, :2]))) for end, other in ((0, source), (-1, target)))
    whole = np.concatenate((source[-2:, :2], line[1:-1, :2], target[:2, :2])) if gap <= LARGEST_GAP else line[:, :2]
    kink = float(np.max(np.abs(_turns(whole)), initial=0.0))
    if gap <= LARGEST_GAP and kink <= LARGEST_KINK:
        return ""
    return f"is {gap:.2f} m beside the lanes that it links, and turns by {math.degrees(kink):.0f} degrees in a point"


def _turns(line: Array) -> Array:
    """Returns the changes of direction at the inner points of a line (n, 2), (n - 2,) [rad]."""
    steps = np.diff(line, axis=0)
    steps = steps[pn.hypot(*steps.T) > 1e-3]
    turns: Array = np.diff(np.unwrap(pn.arctan2(steps[:, 1], steps[:, 0])))
    return turns
