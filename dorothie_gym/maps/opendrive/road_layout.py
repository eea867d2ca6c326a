"""Roads for the lanes of a town: lanes side by side along a common axis, as OpenDRIVE has them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import NO_JUNCTION, NO_STREET, Lane
from dorothie_gym.maps.opendrive.plan_view import Axis
from dorothie_gym.maps.opendrive.strands import LineSamples, Strand, own_strand, sample_line, strand_beside
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array, Sidewalk
    from dorothie_gym.maps.town import Town

# Largest gap between successive lanes of an axis [m].
_JOINED = 0.005

# Largest overlap of lanes side by side, if no lane change leads from one to the other [m].
_OVERLAP = 0.3

# Largest difference of height of lanes side by side [m]: between their points, both are up to 5 mm too high or too low.
_LEVEL = 0.015

# Distances of the end of a lane from that of the axis [m], and its largest tangent, at which both end side by side.
_BESIDE, _FARTHEST_END, _SKEW = 1.5, 40.0, 0.07

# Places of a road that are compared with sidewalks, and number of those tried for each sidewalk.
_PLACES, _NEAREST = 20, 60

# Largest distance across from a lane to one that passes it in the other direction [m], and cosine of their directions.
_OPPOSITE, _OPPOSITE_COSINE = 30.0, -0.8


@dataclass(frozen=True, kw_only=True, eq=False)
class RoadLayout:
    """Road with its lanes.

    Attributes:
        number: id of the road, unique in the file.
        junction: junction that it crosses, or -1.
        street: street of its lanes, or -1.
        axis: its reference line, along the lanes of one direction.
        strands: lanes and sidewalks along it.
    """

    number: int
    junction: int = NO_JUNCTION
    street: int = NO_STREET
    axis: Axis
    strands: tuple[Strand, ...]

    @property
    def edges(self) -> tuple[float, ...]:
        """Distances at which lane sections begin, and the length of the road [m]."""
        found = {0.0, self.axis.length}
        for strand in self.strands:
            found |= {strand.begin, strand.end}
        return tuple(sorted(found))


def lay_roads(town: Town, *, keeps_left: bool, apart: Iterable[int] = ()) -> list[RoadLayout]:
    """Returns roads that have every lane and every sidewalk of a town once, by number.

    Lanes with one road id are lanes of one road, as far as they lie side by side along a common axis, and their links
    lead to the ends of the road or to its next lane section.

    Args:
        town: the town.
        keeps_left: whether traffic keeps to the left.
        apart: ids of lanes that get roads of their own.
    """
    layout = _Layout(town, keeps_left, frozenset(apart))
    layout.add_lanes([lane for lane in town.lanes if not lane.in_junction])
    layout.add_lanes([lane for lane in town.lanes if lane.in_junction])
    layout.add_sidewalks(town.sidewalks)
    return sorted(layout.roads, key=lambda road: road.number)


class _Layout:
    """Roads so far, and the road of each lane."""

    def __init__(self, town: Town, keeps_left: bool, apart: frozenset[int]) -> None:
        self._town = town
        self._keeps_left = keeps_left
        self._apart = apart
        self.roads: list[RoadLayout] = []
        self._road_of: dict[int, int] = {}
        self._next = max((lane.road_id for lane in town.lanes), default=-1) + 1
        self._after = [tuple(link.target for link in town.successors(lane.id)) for lane in town.lanes]
        self._changes = {(link.source, link.target) for link in town.links if link.type.is_lane_change}

    def add_lanes(self, lanes: Sequence[Lane]) -> None:
        """Adds the roads of some lanes."""
        for group in self._groups(lanes):
            left = group
            while left:
                axis, strands = self._row(left)
                taken = {strand.lane for strand in strands}
                self._add(axis, strands, [lane for lane in left if lane.id in taken])
                left = [lane for lane in left if lane.id not in taken]

    def _add(self, axis: Axis, strands: list[Strand], lanes: list[Lane]) -> None:
        number = min(lane.road_id for lane in lanes)
        if number < 0 or any(road.number == number for road in self.roads):
            number, self._next = self._next, self._next + 1
        streets = {lane.street for lane in lanes}
        self._road_of.update((lane.id, number) for lane in lanes)
        self.roads.append(
            RoadLayout(
                number=number,
                junction=lanes[0].junction_id,
                street=streets.pop() if len(streets) == 1 else NO_STREET,
                axis=axis,
                strands=tuple(strands),
            )
        )

    # --- Groups of lanes that may be one road ------------------------------------------------------------------------

    def _groups(self, lanes: Sequence[Lane]) -> list[list[Lane]]:
        """Returns the lanes of each road; connectors of a road differ in the roads that they link."""
        host = self._hosts(lanes)
        groups: defaultdict[tuple[object, ...], list[Lane]] = defaultdict(list)
        for lane in lanes:
            key: tuple[object, ...] = (lane.junction_id, host.get(lane.road_id, lane.road_id))
            if lane.id in self._apart:
                key = ("apart", lane.id)
            elif lane.in_junction:
                linked = (self._town.predecessors(lane.id), self._after[lane.id])
                key = (*key, *(tuple(sorted({self._place(k) for k in ids})) for ids in linked))
            groups[key].append(lane)
        return list(groups.values())

    def _place(self, lane: int) -> tuple[int, int, bool]:
        """Returns the junction, the road and the direction of a lane."""
        found = self._town.lanes[lane]
        return found.junction_id, self._road_of.get(lane, found.road_id), found.lane_id > 0

    def _hosts(self, lanes: Sequence[Lane]) -> dict[int, int]:
        """Returns for each road the one that it belongs to: some begin where a turn lane opens beside other lanes."""
        members: defaultdict[int, list[Lane]] = defaultdict(list)
        for lane in lanes:
            if not lane.in_junction:
                members[lane.road_id].append(lane)
        host = {road: road for road in members}

        def find(road: int) -> int:
            while host[road] != road:
                road = host[road]
            return road

        for lane in (lane for of in members.values() for lane in of):
            for other in (self._town.lanes[k] for k in self._after[lane.id]):
                if other.in_junction or find(lane.road_id) == find(other.road_id):
                    continue
                passing = [*((beside, other) for beside in members[lane.road_id])]
                passing += [(beside, lane) for beside in members[other.road_id]]
                if any(_passes(beside, met) for beside, met in passing):
                    first, second = sorted((find(lane.road_id), find(other.road_id)))
                    host[second] = first
        return {road: find(road) for road in host}

    # --- Lanes along one axis ----------------------------------------------------------------------------------------

    def _row(self, group: list[Lane]) -> tuple[Axis, list[Strand]]:
        """Returns the axis along the longest way through a group, and the lanes along it."""
        spine = self._spine(group)
        points = np.concatenate([spine[0].points[:1], *(lane.points[1:] for lane in spine)])
        points = points[:, :2] * (1.0, -1.0)
        axis = Axis(points, _directions(points, group))
        strands = self._beside(axis, spine, group)
        while bad := self._broken(strands, axis):
            if any(lane.id in bad for lane in spine):
                return self._row(spine[:1])  # it has no joints
            strands = [strand for strand in strands if strand.lane not in bad]
        return axis, strands

    def _spine(self, group: list[Lane]) -> list[Lane]:
        """Returns the longest sequence of linked lanes, preferably along the reference line of its file."""
        ids = {lane.id for lane in group}
        onward = {lane.id: [k for k in self._after[lane.id] if self._is_joint(lane.id, k, ids)] for lane in group}
        entered = {k for targets in onward.values() for k in targets}
        starts = [lane for lane in group if lane.id not in entered] or group[:1]
        ways = [self._way(lane, onward) for lane in starts]
        return max(ways, key=lambda way: (sum(lane.length for lane in way) + (way[0].lane_id < 0), -way[0].id))

    def _way(self, lane: Lane, onward: dict[int, list[int]]) -> list[Lane]:
        way, seen = [lane], {lane.id}
        while ahead := [self._town.lanes[k] for k in onward[way[-1].id] if k not in seen]:
            way.append(max(ahead, key=lambda other: (other.length, -other.id)))
            seen.add(way[-1].id)
        return way

    def _is_joint(self, source: int, target: int, ids: set[int]) -> bool:
        """Returns whether two lanes meet at one place, and all lanes that are linked there are of one group."""
        end, start = self._town.lanes[source].points[-1], self._town.lanes[target].points[0]
        inside = {*self._after[source], *self._town.predecessors(target)} <= ids
        return inside and bool(np.max(np.abs(end - start)) < _JOINED)

    def _beside(self, axis: Axis, spine: list[Lane], group: list[Lane]) -> list[Strand]:
        """Returns the lanes of a group that lie along an axis side by side, those of its own first."""
        found: list[Strand] = []
        others: list[Strand] = []
        edges = [0.0, axis.length]
        for lane in (*spine, *(lane for lane in group if lane not in spine)):
            strand = strand_beside(axis, sample_line(lane.points, lane.widths), edges, lane=lane.id)
            if strand is None:
                if lane in spine:
                    raise AssertionError(f"lane {lane.id} does not follow itself")
                continue
            edges += [strand.begin, strand.end]
            (found if lane in spine else others).append(strand)
        for strand in sorted(others, key=lambda strand: abs(float(strand.aside.mean()))):
            if _is_level(strand, found) and all(self._fits(strand, other) for other in found):
                found.append(strand)
        return found

    def _fits(self, strand: Strand, other: Strand) -> bool:
        """Returns whether two lanes lie side by side, opposite ones on the side that traffic there keeps to."""
        at = strand.shared(other)
        if not len(at):
            return True
        (aside, width), (other_aside, other_width) = strand.place(at), other.place(at)
        apart = aside - other_aside
        if strand.forward != other.forward:
            apart = -apart if strand.forward != self._keeps_left else apart
        elif apart[0] < 0.0:
            apart = -apart
        beside = (strand.lane, other.lane) in self._changes or (other.lane, strand.lane) in self._changes
        least = 0.5 * np.minimum(width, other_width) if beside else 0.5 * (width + other_width) - _OVERLAP
        return bool(np.all(apart > least))

    def _broken(self, strands: list[Strand], axis: Axis) -> set[int]:
        """Returns the lanes with a link inside of their road that leads out of it or to another place of it."""
        of = {strand.lane: strand for strand in strands}
        bad = set()
        for strand in strands:
            lane = -1 if strand.lane is None else strand.lane
            for at_end, linked in ((False, self._town.predecessors(lane)), (True, self._after[lane])):
                place = strand.end if strand.forward == at_end else strand.begin
                if place in (0.0, axis.length):
                    continue
                for other in (of.get(k) for k in linked):
                    if (
                        other is None
                        or other.forward != strand.forward
                        or place != (other.begin if other.forward == at_end else other.end)
                    ):
                        bad.add(lane)
        return bad

    # --- Sidewalks ---------------------------------------------------------------------------------------------------

    def add_sidewalks(self, sidewalks: Sequence[Sidewalk]) -> None:
        """Adds sidewalks to the roads of their streets; those that lie beside none get roads of their own."""
        places = [road.axis.place(np.linspace(0.0, road.axis.length, _PLACES))[:, :2] for road in self.roads]
        tree = cKDTree(np.concatenate(places)) if places else None
        for sidewalk in sidewalks:
            samples = sample_line(sidewalk.points, np.full(len(sidewalk.points), sidewalk.width))
            middle = samples.places[len(samples.places) // 2]
            found = () if tree is None else np.atleast_1d(tree.query(middle, k=min(_NEAREST, tree.n))[1])
            near = dict.fromkeys(int(row) // _PLACES for row in found)
            if not any(self._add_beside(k, sidewalk, samples) for k in near):
                axis = Axis(sidewalk.points[:, :2] * (1.0, -1.0))
                strand = strand_beside(axis, samples, (0.0, axis.length), sidewalk=sidewalk.id)
                strands = (strand or own_strand(samples, sidewalk.id),)
                self.roads.append(RoadLayout(number=self._next, street=sidewalk.street, axis=axis, strands=strands))
                self._next += 1

    def _add_beside(self, k: int, sidewalk: Sidewalk, samples: LineSamples) -> bool:
        """Adds a sidewalk to a road, if it lies along it; returns whether it does."""
        road = self.roads[k]
        if road.street != sidewalk.street:
            return False
        strand = strand_beside(road.axis, samples, road.edges, sidewalk=sidewalk.id)
        if strand is None or not _is_level(strand, road.strands) or not _is_outside(strand, road.strands):
            return False
        self.roads[k] = replace(road, strands=(*road.strands, strand))
        return True


def _directions(points: Array, group: Iterable[Lane]) -> tuple[float | None, float | None]:
    """Returns the directions at both ends of a line (n, 2) at which the ends of lanes beside it lie straight across.

    The points of a curve give its direction at its ends less exactly.

    Returns:
        Directions in the frame of OpenDRIVE [rad]; None where no lane ends beside the line.
    """
    ends = np.concatenate([lane.points[[0, -1], :2] for lane in group]) * (1.0, -1.0)
    found: list[float | None] = []
    for place, ahead in ((points[0], points[1] - points[0]), (points[-1], points[-1] - points[-2])):
        across = ends - place
        length = pn.hypot(*across.T)
        c, n = ahead / pn.hypot(*ahead)
        along, aside = (across[:, 0] * c + across[:, 1] * n), (across[:, 1] * c - across[:, 0] * n)
        beside = (length > _BESIDE) & (length < _FARTHEST_END) & (np.abs(along) < _SKEW * np.abs(aside))
        if np.any(beside):
            k = int(np.argmax(np.where(beside, length, 0.0)))
            left = across[k] if aside[k] > 0.0 else -across[k]
            found.append(pm.atan2(float(-left[0]), float(left[1])))
        else:
            found.append(None)
    return found[0], found[1]


def _passes(beside: Lane, other: Lane) -> bool:
    """Returns whether a lane passes the middle of another one in the opposite direction."""
    half = 0.5 * other.length
    station, aside = beside.project(other.position(half))
    turn = pm.cos(beside.heading_at(station) - other.heading_at(half))
    return 0.0 < station < beside.length and abs(aside) < _OPPOSITE and turn < _OPPOSITE_COSINE


def _is_level(strand: Strand, others: Iterable[Strand]) -> bool:
    """Returns whether a strand has the height of others along it."""
    for other in others:
        at = strand.shared(other)
        if len(at):
            gap = np.interp(at, strand.stations, strand.heights) - np.interp(at, other.stations, other.heights)
            if float(np.max(np.abs(gap))) > _LEVEL:
                return False
    return True


def _is_outside(strand: Strand, others: Iterable[Strand]) -> bool:
    """Returns whether a sidewalk lies outside of all lanes along it, and beside other sidewalks."""
    sides = []
    for other in others:
        at = strand.shared(other)
        if not len(at):
            continue
        (aside, width), (other_aside, other_width) = strand.place(at), other.place(at)
        apart = aside - other_aside
        if not np.all(np.abs(apart) > 0.5 * (width + other_width) - _OVERLAP):
            return False
        if other.lane is not None:
            sides.append(bool(apart[0] > 0.0))
            if np.any((apart > 0.0) != sides[-1]):
                return False
    return bool(sides) and len(set(sides)) == 1
