"""Whether a car that follows the lanes stays off kerbs: those around junctions, and pavements."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from dorothie_gym.maps.lint.fault import HALF_WIDTH, Fault, FaultKind
from dorothie_gym.maps.lint.samples import SAME_LEVEL, SPACING, LaneSamples
from dorothie_gym.maps.model import Array, Junction, Lane, Sidewalk
from dorothie_gym.maps.town import Town

CORNER_TURNS = np.radians([20.0, 160.0])
"""Turns between these have a corner on their inner side [rad]."""

FURTHEST_CORNER = 3.0
"""The straights of a connector's ends meet no further away than this many times the distance between the ends."""

SHORTEST_EDGE = 0.1
"""The edges beside a corner are taken to be this long at least [m], so that there is a kerb to be rounded."""

DRAWN_OUT = 2.0
"""An arc is drawn out to at most this many times its length; what is left beside the further mouth is straight. With 2
sound crossings of five and more arms have no faults, with 1.5 some do."""

THIRD_MOUTH = 0.5
"""A mouth that lies this far to the right of both streets of a right turn is that of a third one between them [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneEndPose:
    """An end of a lane: its place and direction (2,), and its width [m]."""

    place: Array
    along: Array
    width: float

    @property
    def right(self) -> Array:
        """Direction to the right (2,)."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def edges(self) -> Array:
        """Left and right edge of the lane (2, 2) [m]."""
        aside = 0.5 * self.width * self.right
        return np.array([self.place - aside, self.place + aside])


class Corner:
    """The rounded kerb on the inner side of a right turn."""

    def __init__(self, connector: int, start: LaneEndPose, end: LaneEndPose, corner: Array, turn: float) -> None:
        """Round off a corner.

        Args:
            connector: the turn around it.
            start: where the turn begins.
            end: where it ends.
            corner: where the right edges of the two would meet (2,) [m].
            turn: change of direction [rad], positive.
        """
        self.connector = connector
        self._start, self._end = start, end
        self._kerbs = start.edges[1], end.edges[1]
        self._corner = corner
        self._radius = 1.0 / np.tan(0.5 * turn)
        self._middle = self._radius * start.right - start.along

    def _drawing(self, drawn_out: float) -> Array:
        """Matrix (2, 2) to draw the rounded part of both edges, seen from the corner, to length 1: the kerb is an arc.

        Args:
            drawn_out: the longer part is at most this many times as long as the shorter one.
        """
        edges = np.column_stack((-self._start.along, self._end.along))
        length = np.maximum([float(np.hypot(*(self._corner - kerb))) for kerb in self._kerbs], SHORTEST_EDGE)
        length = np.minimum(length, drawn_out * length.min())
        drawing: Array = edges @ np.diag(1.0 / length) @ np.linalg.inv(edges)
        return drawing

    def beyond(self, places: Array) -> Array:
        """How far places (n, 2) lie to the right of both streets, however far away (n,) [m]."""
        (kerb, kerb_behind), start, end = self._kerbs, self._start, self._end
        beyond: Array = np.minimum((places - kerb) @ start.right, (places - kerb_behind) @ end.right)
        return beyond

    def depth(self, places: Array, connector: int) -> Array:
        """How far places (n, 2) on a connector lie behind the kerb, 0 before it (n,) [m]."""
        (kerb, kerb_behind), start, end = self._kerbs, self._start, self._end
        drawing = self._drawing(1.0 if connector == self.connector else DRAWN_OUT)
        from_middle = (places - self._corner) @ drawing.T - self._middle
        distance = np.maximum(np.hypot(*from_middle.T), 1e-9)
        scale = np.hypot(*((from_middle / distance[:, None]) @ drawing).T)  # drawn length of a metre outwards
        rounded = (from_middle @ start.along > 0.0) & (from_middle @ end.along < 0.0)
        depth = self.beyond(places)
        depth = np.where(rounded, np.minimum(depth, (self._radius - distance) / scale), depth)
        # The kerb ends where the mouths are: what lies behind them is another street.
        between = ((places - kerb) @ start.along > 0.0) & ((places - kerb_behind) @ end.along < 0.0)
        result: Array = np.where(between, np.maximum(depth, 0.0), 0.0)
        return result


def mouths(town: Town, junction: Junction) -> Array:
    """Edges (n, 2) of all lanes where they meet a junction, and of connectors that meet none there [m]."""
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
    """First (point 0) or last (point -1) end of a lane."""
    row = town.lanes[lane]
    heading = row.headings[point]
    along = np.array([np.cos(heading), np.sin(heading)])
    return LaneEndPose(place=row.points[point, :2], along=along, width=float(row.widths[point]))


def corners(town: Town, connectors: Iterable[int], kerb_lanes: frozenset[int], edges: Array) -> list[Corner]:
    """Corners beside the right turns from kerb to kerb; none where a third street comes in between.

    Args:
        town: the town.
        connectors: of the junction.
        kerb_lanes: lanes beside the kerb on their right.
        edges: the junction's mouths (n, 2) [m].
    """
    found = []
    for number in connectors:
        before, after = town.predecessors(number), [link.target for link in town.successors(number)]
        if not (before and after and kerb_lanes.issuperset(before) and kerb_lanes.issuperset(after)):
            continue
        start, end = end_of(town, before[0], -1), end_of(town, after[0], 0)
        turn = float(np.arctan2(start.along @ -end.right, start.along @ end.along))
        shifted = [LaneEndPose(place=pose.edges[1], along=pose.along, width=0.0) for pose in (start, end)]
        meeting = _meeting(*shifted)
        if meeting is None or not CORNER_TURNS[0] <= turn <= CORNER_TURNS[1]:
            continue
        corner = Corner(number, start, end, meeting, turn)
        if float(np.max(corner.beyond(edges))) < THIRD_MOUTH:
            found.append(corner)
    return found


def outside(edges: Array, start: LaneEndPose, end: LaneEndPose, room: float, places: Array) -> Array:
    """How far places (n, 2) lie off the ground between the mouths, 0 on it (n,) [m].

    Args:
        edges: the junction's mouths (m, 2) [m].
        start: where the connector in question begins.
        end: where it ends.
        room: space to either side that a car on it needs [m].
        places: to look at.
    """
    corner = _meeting(start, end)
    if corner is not None:
        bends = corner, corner
    else:  # an S or a U: each end goes straight on for half of the way at most
        reach = room + 0.5 * float(np.hypot(*(end.place - start.place)))
        bends = start.place + reach * start.along, end.place - reach * end.along
    aside = [
        bend + sign * room * pose.right for bend, pose in zip(bends, (start, end), strict=True) for sign in (-1, 1)
    ]
    edges = np.concatenate((edges, np.array(aside)))
    try:
        hull = ConvexHull(edges)
    except QhullError:  # all in a line, or fewer than three: there is no ground to leave
        return np.zeros(len(places))
    distance: Array = np.maximum(np.max(places @ hull.equations[:, :2].T + hull.equations[:, 2], axis=1), 0.0)
    return distance


def _meeting(start: LaneEndPose, end: LaneEndPose) -> Array | None:
    """Where the straight on from the start meets the one that comes to the end; None if not between them."""
    (d, e), gap = (start.along, end.along), end.place - start.place
    cross = float(d[0] * e[1] - d[1] * e[0])
    if abs(cross) < 1e-6:
        return None
    ahead, behind = (gap[0] * e[1] - gap[1] * e[0]) / cross, (d[0] * gap[1] - d[1] * gap[0]) / cross
    if min(ahead, behind) < 0.0 or max(ahead, behind) > FURTHEST_CORNER * float(np.hypot(*gap)):
        return None
    meeting: Array = start.place + ahead * d
    return meeting


# --- Whether a car that follows the lanes stays off kerbs: those around junctions, and pavements ---------------------

KERB_SLACK = 0.15
"""The car's side may come this far over a kerb before it is told [m]: kerbs are estimated, and curves are polylines."""

LOOP = np.radians(190.0)
"""A connector that turns by more is a loop [rad]; of U-turns some turn by a little more than a half circle."""

_SIDES = HALF_WIDTH * np.array([-1.0, 0.0, 1.0])


def kerb_faults(town: Town, samples: LaneSamples) -> Iterator[Fault]:
    """Connectors that lead off the junction's ground or across a corner, and lanes that run over a pavement."""
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
    """Lanes outside junctions that run beside the kerb on their right, as their numbers tell."""
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
        if abs(float(town.lanes[number].headings[-1] - town.lanes[number].headings[0])) <= LOOP:
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
    """Fault of the lane at some rows, of which `over` (n, 3) or (3 n,) tells how far the car's sides get [m]."""
    worst = rows.start + int(np.argmax(over)) // len(_SIDES)
    lane, (x, y) = int(samples.owner[worst]), samples.points[worst]
    message = f"a car on lane {lane} gets {over.max():.1f} m over {what}"
    return Fault(kind=FaultKind.KERB, lanes=(lane,), position=(float(x), float(y)), message=message)


def _car_sides(samples: LaneSamples, rows: slice) -> Array:
    """Left side, middle and right side of a car along a lane (n, 3, 2) [m]."""
    sides: Array = samples.points[rows, None] + _SIDES[:, None] * samples.right[rows, None]
    return sides


def _on_lanes(town: Town, samples: LaneSamples, places: Array, heights: Array) -> Array:
    """Which places (3 n, 2) at heights (n,) lie on lanes outside junctions (3 n,): those are paved, too."""
    road = np.flatnonzero(~np.array([lane.in_junction for lane in town.lanes])[samples.owner])
    if len(road) == 0:
        return np.zeros(len(places), dtype=np.bool_)
    _, index = cKDTree(samples.points[road]).query(places)
    row = road[index]
    offset = places - samples.points[row]
    along = np.abs(np.einsum("ij,ij->i", offset, samples.along[row]))
    across = np.abs(np.einsum("ij,ij->i", offset, samples.right[row]))
    level = np.abs(np.repeat(heights, len(_SIDES)) - samples.heights[row]) < SAME_LEVEL
    paved: Array = level & (along <= SPACING) & (across <= 0.5 * samples.widths[row])
    return paved


def _pavement_faults(sidewalks: Sequence[Sidewalk], samples: LaneSamples) -> Iterator[Fault]:
    """Lanes on which a car gets onto a pavement of the same height."""
    if not sidewalks:
        return
    places = np.concatenate([_along(sidewalk) for sidewalk in sidewalks])  # (m, 6)
    sides = _car_sides(samples, slice(0, len(samples.points)))  # (n, 3, 2)
    _, index = cKDTree(places[:, :2]).query(sides, distance_upper_bound=0.5 * places[:, 5].max() + SPACING)
    found = index < len(places)
    place = places[np.where(found, index, 0)]  # (n, 3, 6)
    offset = sides - place[..., :2]
    along = np.abs(offset[..., 0] * place[..., 3] + offset[..., 1] * place[..., 4])
    across = np.abs(offset[..., 1] * place[..., 3] - offset[..., 0] * place[..., 4])
    level = np.abs(samples.heights[:, None] - place[..., 2]) < SAME_LEVEL
    depth = np.where(found & level & (along <= 0.75 * SPACING), 0.5 * place[..., 5] - across, 0.0)
    for lane in dict.fromkeys(samples.owner[np.max(depth, axis=1) > KERB_SLACK].tolist()):
        yield _fault(samples, samples.rows(lane), depth[samples.rows(lane)], "the edge of a pavement")


def _along(sidewalk: Sidewalk) -> Array:
    """Places along a pavement, at most `SPACING` apart: rows of x, y, z, direction x, y, and width."""
    steps = np.diff(sidewalk.points[:, :2], axis=0)
    length = np.hypot(*steps.T)
    station = np.concatenate(([0.0], np.cumsum(length)))
    s = np.linspace(0.0, station[-1], max(2, int(np.ceil(station[-1] / SPACING)) + 1))
    segment = np.clip(np.searchsorted(station, s, side="right") - 1, 0, len(length) - 1)
    place = [np.interp(s, station, column) for column in sidewalk.points.T]
    return np.column_stack((*place, steps[segment] / length[segment, None], np.full(len(s), sidewalk.width)))
