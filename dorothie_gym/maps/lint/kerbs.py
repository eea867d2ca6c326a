"""Kerbs: checks that a car that follows the lanes stays on the asphalt of junctions and off pavements."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from dorothie_gym.maps.lint.fault import HALF_WIDTH, Fault, FaultKind
from dorothie_gym.maps.lint.samples import SAME_GROUND, SAMPLE_SPACING, LaneSamples
from dorothie_gym.maps.model import Array, Junction, Lane, Sidewalk
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

CORNER_TURNS = np.radians([20.0, 160.0])
"""Range of turns with a corner on the inner side [rad]."""

FURTHEST_CORNER = 3.0
"""Largest distance to the intersection of the tangents of a connector, relative to the distance between its ends."""

SHORTEST_EDGE = 0.1
"""Shortest assumed length of the edges beside a corner [m], for a kerb that can be rounded."""

DRAWN_OUT = 2.0
"""Largest stretch factor of the arc of a corner; the rest beside the farther mouth is straight. With 2, correct
crossings with five and more arms have no faults; with 1.5 some do."""

THIRD_MOUTH = 0.5
"""Distance beyond the kerbs of both streets of a turn of a mouth that belongs to a third street [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneEndPose:
    """End of a lane: position (2,) [m], direction (2,), width [m] and the sign of the town's `DrivingSide`."""

    place: Array
    along: Array
    width: float
    sign: int

    @property
    def outward(self) -> Array:
        """Unit vector towards the kerb (2,): to the right, or in left-hand traffic to the left."""
        return self.sign * np.array([-self.along[1], self.along[0]])

    @property
    def edges(self) -> Array:
        """Edge points in the middle of the road and at the kerb (2, 2) [m]."""
        aside = 0.5 * self.width * self.outward
        return np.array([self.place - aside, self.place + aside])


class Corner:
    """Rounded kerb on the inner side of a turn from kerb to kerb."""

    def __init__(self, connector: int, start: LaneEndPose, end: LaneEndPose, corner: Array, turn: float) -> None:
        """Rounds off a corner.

        Args:
            connector: id of the lane of the turn.
            start: start of the turn.
            end: end of the turn.
            corner: intersection of the kerbs of both streets (2,) [m].
            turn: change of direction [rad], positive.
        """
        self.connector = connector
        self._start, self._end = start, end
        self._kerbs = start.edges[1], end.edges[1]
        self._corner = corner
        self._radius = 1.0 / pn.tan(0.5 * turn)
        self._middle = self._radius * start.outward - start.along

    def _drawing(self, drawn_out: float) -> Array:
        """Returns the matrix (2, 2) that scales the rounded part of both edges to length 1, so that the kerb is an arc.

        Args:
            drawn_out: largest ratio of the longer part to the shorter one.
        """
        edges = np.column_stack((-self._start.along, self._end.along))
        length = np.maximum([float(pn.hypot(*(self._corner - kerb))) for kerb in self._kerbs], SHORTEST_EDGE)
        length = np.minimum(length, drawn_out * length.min())
        drawing: Array = edges @ np.diag(1.0 / length) @ np.linalg.inv(edges)
        return drawing

    def beyond(self, places: Array) -> Array:
        """Returns the distance of positions (n, 2) beyond both kerbs, without limit along them (n,) [m]."""
        (kerb, kerb_behind), start, end = self._kerbs, self._start, self._end
        beyond: Array = np.minimum((places - kerb) @ start.outward, (places - kerb_behind) @ end.outward)
        return beyond

    def depth(self, places: Array, connector: int) -> Array:
        """Returns the distance of positions (n, 2) of a connector behind the kerb, 0 before it (n,) [m]."""
        (kerb, kerb_behind), start, end = self._kerbs, self._start, self._end
        drawing = self._drawing(1.0 if connector == self.connector else DRAWN_OUT)
        from_middle = (places - self._corner) @ drawing.T - self._middle
        distance = np.maximum(pn.hypot(*from_middle.T), 1e-9)
        scale = pn.hypot(*((from_middle / distance[:, None]) @ drawing).T)  # drawn length of a metre outwards
        rounded = (from_middle @ start.along > 0.0) & (from_middle @ end.along < 0.0)
        depth = self.beyond(places)
        depth = np.where(rounded, np.minimum(depth, (self._radius - distance) / scale), depth)
        # The kerb ends at the mouths: another street begins there.
        between = ((places - kerb) @ start.along > 0.0) & ((places - kerb_behind) @ end.along < 0.0)
        result: Array = np.where(between, np.maximum(depth, 0.0), 0.0)
        return result


def mouths(town: Town, junction: Junction) -> Array:
    """Returns the edge points (n, 2) of all lanes at a junction, and of connectors without a lane at an end [m]."""
    edges = [np.empty((0, 2))]
    for number in junction.connectors:
        before, after = town.predecessors(number), tuple(link.target for link in town.successors(number))
        for lanes, own_end, its_end in ((before, 0, -1), (after, -1, 0)):
            outside = [(k, its_end) for k in lanes if town.lanes[k].junction_id != junction.id]
            edges += [end_of(town, lane, end).edges for lane, end in outside]
            if not lanes:
                edges.append(end_of(town, number, own_end).edges)
    return np.concatenate(edges)


def end_of(town: Town, lane: int, point: int) -> LaneEndPose:
    """Returns the first (point 0) or last (point -1) end of a lane."""
    row = town.lanes[lane]
    heading = row.headings[point]
    along = np.array([pn.cos(heading), pn.sin(heading)])
    return LaneEndPose(place=row.points[point, :2], along=along, width=float(row.widths[point]), sign=town.traffic.sign)


def corners(town: Town, connectors: Iterable[int], kerb_lanes: frozenset[int], edges: Array) -> list[Corner]:
    """Returns the corners of turns from kerb to kerb; none where a third street lies in between.

    Args:
        town: the town.
        connectors: ids of the connectors of the junction.
        kerb_lanes: ids of the lanes with a kerb beside them.
        edges: mouths of the junction (n, 2) [m].
    """
    found = []
    for number in connectors:
        before, after = town.predecessors(number), [link.target for link in town.successors(number)]
        if not (before and after and kerb_lanes.issuperset(before) and kerb_lanes.issuperset(after)):
            continue
        start, end = end_of(town, before[0], -1), end_of(town, after[0], 0)
        turn = float(pn.arctan2(start.along @ -end.outward, start.along @ end.along))
        shifted = [replace(pose, place=pose.edges[1], width=0.0) for pose in (start, end)]
        meeting = _meeting(*shifted)
        if meeting is None or not CORNER_TURNS[0] <= turn <= CORNER_TURNS[1]:
            continue
        corner = Corner(number, start, end, meeting, turn)
        if float(np.max(corner.beyond(edges))) < THIRD_MOUTH:
            found.append(corner)
    return found


def outside(edges: Array, start: LaneEndPose, end: LaneEndPose, room: float, places: Array) -> Array:
    """Returns the distance of positions (n, 2) from the ground between the mouths, 0 on it (n,) [m].

    Args:
        edges: mouths of the junction (m, 2) [m].
        start: start of the connector.
        end: end of the connector.
        room: half the width that a car on it needs [m].
        places: positions to check.
    """
    corner = _meeting(start, end)
    if corner is not None:
        bends = corner, corner
    else:  # S or U curve: both ends continue straight for at most half of the distance
        reach = room + 0.5 * float(pn.hypot(*(end.place - start.place)))
        bends = start.place + reach * start.along, end.place - reach * end.along
    aside = [
        bend + sign * room * pose.outward for bend, pose in zip(bends, (start, end), strict=True) for sign in (-1, 1)
    ]
    edges = np.concatenate((edges, np.array(aside)))
    try:
        hull = ConvexHull(edges)
    except QhullError:  # collinear, or fewer than three points: no ground
        return np.zeros(len(places))
    distance: Array = np.maximum(np.max(places @ hull.equations[:, :2].T + hull.equations[:, 2], axis=1), 0.0)
    return distance


def _meeting(start: LaneEndPose, end: LaneEndPose) -> Array | None:
    """Returns the intersection of the tangents of both ends, or None if it does not lie between them."""
    (d, e), gap = (start.along, end.along), end.place - start.place
    cross = float(d[0] * e[1] - d[1] * e[0])
    if abs(cross) < 1e-6:
        return None
    ahead, behind = (gap[0] * e[1] - gap[1] * e[0]) / cross, (d[0] * gap[1] - d[1] * gap[0]) / cross
    if min(ahead, behind) < 0.0 or max(ahead, behind) > FURTHEST_CORNER * float(pn.hypot(*gap)):
        return None
    meeting: Array = start.place + ahead * d
    return meeting


# --- Checks ----------------------------------------------------------------------------------------------------------

KERB_SLACK = 0.15
"""Tolerance of the side of the car beyond a kerb [m]: kerbs are estimates, and curves are polylines."""

LOOP = np.radians(190.0)
"""Smallest turn of a loop, in both directions together [rad]; some U-turns turn slightly more than a half circle. The
ground of a loop is that of its lane, as at the end of a dead-end street, where cars swing out to turn round."""

_SIDES = HALF_WIDTH * np.array([-1.0, 0.0, 1.0])


def kerb_faults(town: Town, samples: LaneSamples) -> Iterator[Fault]:
    """Yields connectors that leave the ground of their junction or cut a corner, and lanes across pavements."""
    beside_kerb = _kerb_lanes(town.lanes)
    faulty: set[int] = set()
    for junction in town.junctions:
        for fault in _junction_faults(town, junction, samples, beside_kerb):
            faulty.update(fault.lanes)
            yield fault
    for fault in _pavement_faults(town.sidewalks, samples):
        if faulty.isdisjoint(fault.lanes):
            yield fault


def _kerb_lanes(lanes: Sequence[Lane]) -> frozenset[int]:
    """Returns the lanes outside junctions with a kerb beside them, according to their lane numbers."""
    widest: dict[tuple[int, bool], int] = {}
    for lane in lanes:
        side = lane.road_id, lane.lane_id > 0
        if not lane.in_junction:
            widest[side] = max(widest.get(side, 0), abs(lane.lane_id))
    return frozenset(
        lane.id
        for lane in lanes
        if not lane.in_junction and widest[lane.road_id, lane.lane_id > 0] == abs(lane.lane_id)
    )


def _junction_faults(
    town: Town, junction: Junction, samples: LaneSamples, beside_kerb: frozenset[int]
) -> Iterator[Fault]:
    edges = mouths(town, junction)
    kerbs = corners(town, junction.connectors, beside_kerb, edges)
    for number in junction.connectors:
        rows = samples.rows(number)
        sides = _car_sides(samples, rows).reshape(-1, 2)  # (3 n, 2)
        off = np.zeros(len(sides))
        if float(np.abs(np.diff(town.lanes[number].headings)).sum()) <= LOOP:
            off = outside(edges, end_of(town, number, 0), end_of(town, number, -1), HALF_WIDTH, sides)
        if off.max() > KERB_SLACK:
            off[_on_lanes(town, samples, sides, samples.heights[rows])] = 0.0
        if off.max() > KERB_SLACK:
            yield _fault(samples, rows, off, "the edge of the junction's ground")
            continue
        over = np.max([np.zeros(len(sides)), *(kerb.depth(sides, number) for kerb in kerbs)], axis=0)
        if over.max() > KERB_SLACK:
            yield _fault(samples, rows, over, "the kerb of a corner")


def _fault(samples: LaneSamples, rows: slice, over: Array, what: str) -> Fault:
    """Returns the fault of a lane; `over` (n, 3) or (3 n,) holds how far the sides of the car protrude [m]."""
    worst = rows.start + int(np.argmax(over)) // len(_SIDES)
    lane, (x, y) = int(samples.owner[worst]), samples.points[worst]
    message = f"a car on lane {lane} gets {over.max():.1f} m over {what}"
    return Fault(kind=FaultKind.KERB, lanes=(lane,), position=(float(x), float(y)), message=message)


def _car_sides(samples: LaneSamples, rows: slice) -> Array:
    """Returns the left side, centre and right side of a car along a lane (n, 3, 2) [m]."""
    sides: Array = samples.points[rows, None] + _SIDES[:, None] * samples.right[rows, None]
    return sides


def _on_lanes(town: Town, samples: LaneSamples, places: Array, heights: Array) -> Array:
    """Returns which positions (3 n, 2) at heights (n,) lie on lanes outside junctions (3 n,), which are also paved."""
    road = np.flatnonzero(~np.array([lane.in_junction for lane in town.lanes])[samples.owner])
    if len(road) == 0:
        return np.zeros(len(places), dtype=np.bool_)
    _, index = cKDTree(samples.points[road]).query(places)
    row = road[index]
    offset = places - samples.points[row]
    along = np.abs(np.einsum("ij,ij->i", offset, samples.along[row]))
    across = np.abs(np.einsum("ij,ij->i", offset, samples.right[row]))
    level = np.abs(np.repeat(heights, len(_SIDES)) - samples.heights[row]) < SAME_GROUND
    paved: Array = level & (along <= SAMPLE_SPACING) & (across <= 0.5 * samples.widths[row])
    return paved


def _pavement_faults(sidewalks: Sequence[Sidewalk], samples: LaneSamples) -> Iterator[Fault]:
    """Yields lanes on which a car touches a pavement at the same height."""
    if not sidewalks:
        return
    places = np.concatenate([_along(sidewalk) for sidewalk in sidewalks])  # (m, 6)
    sides = _car_sides(samples, slice(0, len(samples.points)))  # (n, 3, 2)
    _, index = cKDTree(places[:, :2]).query(sides, distance_upper_bound=0.5 * places[:, 5].max() + SAMPLE_SPACING)
    found = index < len(places)
    place = places[np.where(found, index, 0)]  # (n, 3, 6)
    offset = sides - place[..., :2]
    along = np.abs(offset[..., 0] * place[..., 3] + offset[..., 1] * place[..., 4])
    across = np.abs(offset[..., 1] * place[..., 3] - offset[..., 0] * place[..., 4])
    level = np.abs(samples.heights[:, None] - place[..., 2]) < SAME_GROUND
    depth = np.where(found & level & (along <= 0.75 * SAMPLE_SPACING), 0.5 * place[..., 5] - across, 0.0)
    for lane in dict.fromkeys(samples.owner[np.max(depth, axis=1) > KERB_SLACK].tolist()):
        yield _fault(samples, samples.rows(lane), depth[samples.rows(lane)], "the edge of a pavement")


def _along(sidewalk: Sidewalk) -> Array:
    """Returns samples along a pavement, at most `SAMPLE_SPACING` apart: rows of x, y, z, direction x, y, and width."""
    steps = np.diff(sidewalk.points[:, :2], axis=0)
    length = pn.hypot(*steps.T)
    station = np.concatenate(([0.0], np.cumsum(length)))
    s = np.linspace(0.0, station[-1], max(2, int(np.ceil(station[-1] / SAMPLE_SPACING)) + 1))
    segment = np.clip(np.searchsorted(station, s, side="right") - 1, 0, len(length) - 1)
    place = [np.interp(s, station, column) for column in sidewalk.points.T]
    return np.column_stack((*place, steps[segment] / length[segment, None], np.full(len(s), sidewalk.width)))
