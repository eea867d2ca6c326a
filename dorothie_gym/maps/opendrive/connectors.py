"""Connectors of junctions that no car can follow, drawn again as the shortest path of arcs and a straight.

SUMO joins the two directions of a street at a junction by curves of a radius of half a lane, which begin and end beside
the lanes that they link, at other angles.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import NO_JUNCTION
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.maps.opendrive.records import OpenDriveRecords
    from dorothie_gym.maps.opendrive.topology import Topology

# A connector is drawn again beyond these limits; maps of other tools stay below them.
LARGEST_GAP = 0.3  # between the ends of linked lanes [m]
LARGEST_KINK = math.radians(15.0)  # change of direction in one point [rad]

# Radius of the arcs [m]: a little more than the smallest turning circle of the car.
RADIUS = 4.2

# Largest sum of turns in addition to the change of direction [rad]: two swings in a U-turn, but no loop.
MOST_SWING = math.radians(220.0)

# Smallest change of direction of a turnaround [rad].
_TURNAROUND = math.radians(150.0)

_STEP = 0.3  # distance between points on arcs [m]


class Pose(NamedTuple):
    """Position [m] and direction [rad] in the plane."""

    x: float
    y: float
    heading: float


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
        and _turn(lines[before[k][0]], lines[after[k][0]]) > _TURNAROUND
    }
    if spare and not _is_unchanged(topology, spare):
        spare = set()
    new = list(lines)
    for k, fault in faults.items():
        element = _name(records, topology, k)
        if k in spare:
            reason = f"{fault}; cars turn round on the street, and other ways lead on"
            records.notes.dropped(NoteKind.TURNAROUND, element, reason)
        elif (line := _path(lines[before[k][0]], lines[k], lines[after[k][0]])) is not None:
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


def _name(records: OpenDriveRecords, topology: Topology, lane: int) -> str:
    first = topology.chains[lane][0]
    return f"road {records.roads[first.road].name} / laneSection {first.section} / lane {first.lane}"


def _turn(source: Array, target: Array) -> float:
    """Returns the change of direction from the end of a lane to the start of another one, without sign [rad]."""
    return abs(math.remainder(_pose(target, 0).heading - _pose(source, -1).heading, math.tau))


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


def _path(source: Array, line: Array, target: Array) -> Array | None:
    """Returns the new centre line (n, 4) of a connector, or None if a car would have to drive a loop."""
    begin, end = _pose(source, -1), _pose(target, 0)
    legs = shortest_legs(begin, end, RADIUS)
    turned = sum(abs(length) for kind, length in legs if kind != 0) / RADIUS
    if turned > _turn(source, target) + MOST_SWING:
        return None
    points = np.array([(begin.x, begin.y), *_points(begin, legs)])
    points[-1] = end.x, end.y
    along = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(points, axis=0).T))))
    points = points[np.concatenate(([True], np.diff(along) > 1e-3))]
    along = np.concatenate(([0.0], np.cumsum(pn.hypot(*np.diff(points, axis=0).T))))
    if len(points) < 2:
        return None
    share = along / along[-1]
    heights = (1.0 - share) * source[-1, 2] + share * target[0, 2]
    return np.column_stack((points, heights, np.interp(share, [0.0, 1.0], line[[0, -1], 3])))


def _pose(line: Array, end: int) -> Pose:
    """Returns the pose at the start (0) or end (-1) of a line (n, 4)."""
    dx, dy = line[-1, :2] - line[-2, :2] if end else line[1, :2] - line[0, :2]
    return Pose(float(line[end, 0]), float(line[end, 1]), pm.atan2(float(dy), float(dx)))


def _points(pose: Pose, legs: list[tuple[int, float]]) -> Iterator[tuple[float, float]]:
    """Yields points along legs: the ends of straights, and steps along arcs."""
    x, y, heading = pose
    for kind, length in legs:
        count = 1 if kind == 0 else max(1, math.ceil(length / _STEP))
        turn = kind * length / RADIUS / count
        chord = length / count if kind == 0 else 2.0 * RADIUS * pm.sin(0.5 * abs(turn))
        for _ in range(count):
            x, y = x + chord * pm.cos(heading + 0.5 * turn), y + chord * pm.sin(heading + 0.5 * turn)
            heading += turn
            yield x, y


# --- Shortest paths of bounded curvature -----------------------------------------------------------------------------


def shortest_legs(begin: Pose, end: Pose, radius: float) -> list[tuple[int, float]]:
    """Returns the shortest path between two poses with turns of one radius (L. E. Dubins, 1957).

    Returns:
        Three legs: 1, -1 or 0 for an arc to either side (1: growing heading) or a straight, and its length [m].
    """
    dx, dy = (end.x - begin.x) / radius, (end.y - begin.y) / radius
    c, n = pm.cos(begin.heading), pm.sin(begin.heading)
    ahead, aside, turn = dx * c + dy * n, dy * c - dx * n, (end.heading - begin.heading) % math.tau
    found = []
    for side in (1, -1):  # mirrored, an arc to one side is one to the other
        for kinds, lengths in _words(ahead, side * aside, (side * turn) % math.tau):
            found.append((sum(lengths), [(side * kind, radius * a) for kind, a in zip(kinds, lengths, strict=True)]))
    return min(found, key=lambda row: row[0])[1]


def _words(x: float, y: float, turn: float) -> Iterator[tuple[tuple[int, int, int], tuple[float, float, float]]]:
    """Yields the paths that begin with an arc of growing heading, from (0, 0, 0) to (x, y, turn), radius 1.

    The centre of the first arc is (0, 1); that of the last one lies beside the end.
    """
    c, n = pm.cos(turn), pm.sin(turn)
    # both arcs to the same side: the straight is as long as the centres are apart
    u, v = x - n, y + c - 1.0
    apart = pm.hypot(u, v)
    way = pm.atan2(v, u) % math.tau if apart > 1e-9 else 0.0
    yield (1, 0, 1), (way, apart, (turn - way) % math.tau)
    if apart <= 4.0:  # three arcs: the centre of the middle one is 2 from both others
        corner = pm.acos(0.25 * apart)
        for side in (1, -1):
            first, middle = (way + side * corner + 0.5 * math.pi) % math.tau, math.pi + side * 2.0 * corner
            yield (1, -1, 1), (first, middle, (turn - first + middle) % math.tau)
    # the last arc to the other side: the straight crosses between the centres
    u, v = x + n, y - c - 1.0
    apart = pm.hypot(u, v)
    if apart >= 2.0:
        length = math.sqrt(apart * apart - 4.0)
        way = (pm.atan2(v, u) + pm.atan2(2.0, length)) % math.tau
        yield (1, 0, -1), (way, length, (way - turn) % math.tau)
