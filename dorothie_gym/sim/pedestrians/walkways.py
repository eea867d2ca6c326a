"""Walkways of a town as arrays: pavements, ways round corners, crosswalks, strips beside streets."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dorothie_gym.maps.lane_neighbours import LaneEdges
from dorothie_gym.maps.model import LEVEL_HEIGHT, Array, Crosswalk, Lane, Sidewalk
from dorothie_gym.sim.pedestrians.walkway_position import street_walks
from dorothie_gym.sim.state.codes import NOBODY, Footway
from dorothie_gym.sim.state.town_records import CrossingRecord, LaneRecord, MouthRecord, PassageRecord, WalkwayRecord
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import RecordArray, empty_records, filled_records

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.sim.network.network import TownNetwork

SAME_END = 0.5
"""Distance within which ends of pavements are one place [m]."""

LONGEST_CORNER = 45.0
"""Longest footway between the ends of two pavements, if no lane lies between [m]."""

CORNER_WIDTH = 1.4
"""Width of such footways round corners [m]."""

BOWS = 0.0, 2.0, -2.0, 4.0, -4.0, 6.0, -6.0
"""Offsets from the straight line at which such footways are tried [m]: round the outside of a bend they are curved."""

LANE_CLEARANCE = 0.8
"""Minimum distance of their centres from the lanes' edges [m]."""

STREET_HALF_WIDTH = 0.8
"""Half the width of a footway beside a street without a pavement [m]: half of `pacing.KERB`."""

HEEDED = 8.0
"""Distance from a crosswalk's line within which lanes end whose lights apply to the crosswalk [m]."""

KERB_REACH = 6.0
"""Distance from a crosswalk's end to its pavement, at most [m]."""

SAMPLE = 0.5
"""Step in which lanes are searched for crosswalks [m]."""

CROSSWALK_DEPTH = 3.0
"""Along the road (MUTCD 2009, section 3B.18: at least 6 feet) [m]."""


_End: TypeAlias = tuple[int, int]
"""Index of a footway, and 0 for its start or 1 for its end."""


class Walkways(NamedTuple):
    """Arrays of the pavements and crosswalks; see `TownArrays`. `heeded` are lists of lanes, for `CROSSING.light`."""

    points: Array
    walks: RecordArray[WalkwayRecord]
    mouths: RecordArray[MouthRecord]
    crossings: RecordArray[CrossingRecord]
    passages: RecordArray[PassageRecord]
    heeded: NDArray[np.int32]


def build_walkways(network: TownNetwork, lanes: RecordArray[LaneRecord]) -> Walkways:
    """Builds all footways and crosswalks, and writes passages to `lanes`.

    Args:
        network: network of the town.
        lanes: `town_records.LaneRecord`, complete but for the passages.
    """
    town = network.town
    edges = LaneEdges(town)
    pavements = [_pavement(walk.points, walk.width) for walk in town.sidewalks]
    corners = _corners(town.sidewalks, edges)
    ways = pavements + [_pavement(corner.points, CORNER_WIDTH) for corner in corners.laid]
    streets = street_walks(network.table.points, lanes, town, edges)
    rows = ways + [street.points for street in streets]
    firsts = np.concatenate(([0], np.cumsum([len(row) for row in rows]))).astype(int)
    walks = empty_records(WalkwayRecord, max(len(rows), 1))
    walks["next_walk"] = walks["lane"] = NOBODY
    for k, row in enumerate(rows):
        walks[k].first, walks[k].last, walks[k].length = firsts[k], firsts[k + 1] - 1, row[-1, 2]
        walks[k].half_width = row[0, 5] / 2
    walks["kind"][len(pavements) : len(ways)] = Footway.CORNER
    walks["kind"][len(ways) : len(rows)] = Footway.STREET
    walks["half_width"][len(ways) : len(rows)] = STREET_HALF_WIDTH
    walks["lane"][len(ways) : len(rows)] = [street.lane for street in streets]
    for (walk, end), (after, which) in corners.onward.items():
        walks[walk].next_walk[end], walks[walk].next_end[end] = after, which
    crossings, mouths = _crossings(network, walks, pavements)
    passages = _passages(town, lanes, crossings)
    heeded = _lights(town, lanes, crossings, passages)
    points = np.concatenate(rows) if rows else np.zeros((1, 6))
    return Walkways(np.ascontiguousarray(points), walks, mouths, crossings, passages, heeded)


def _pavement(points: Array, width: float) -> Array:
    """Returns x, y, station, heading, height and width of the points (n, 3) of a pavement."""
    steps = np.diff(points[:, :2], axis=0)
    stations = np.concatenate(([0.0], np.cumsum(np.sqrt((steps * steps).sum(axis=1)))))
    headings = np.unwrap(pn.arctan2(steps[:, 1], steps[:, 0]))
    heading = np.concatenate((headings, headings[-1:]))
    return np.column_stack((points[:, :2], stations, heading, points[:, 2], np.full(len(stations), width)))


class _Corner(NamedTuple):
    """A footway between the ends of two pavements."""

    ends: tuple[_End, _End]
    points: Array


class _Corners(NamedTuple):
    """Footways round corners, numbered after the pavements, and the footways beyond each end of each footway."""

    laid: list[_Corner]
    onward: dict[_End, _End]


def _corners(sidewalks: Sequence[Sidewalk], edges: LaneEdges) -> _Corners:
    """Returns the footway from each end of a pavement to the nearest end of another one, across no lane.

    Ends at the same place need no footway between them. An end without a reachable other end is a dead end.
    """
    ends = [(k, end) for k in range(len(sidewalks)) for end in (0, 1)]
    found = _Corners([], {})
    if len(ends) < 2:
        return found
    places = np.array([sidewalks[k].points[(0, -1)[end]] for k, end in ends])
    numbers: dict[tuple[int, int], int] = {}
    for one, near in enumerate(_near(ends, places)):
        way = _way_on(places, one, near, edges)
        if way is None:
            continue
        other, points = way
        pair = min(one, other), max(one, other)
        if pn.hypot(*(places[one] - places[other])[:2]) < SAME_END:
            found.onward[ends[one]] = ends[other]
            continue
        if pair not in numbers:
            numbers[pair] = len(sidewalks) + len(found.laid)
            found.laid.append(_Corner((ends[pair[0]], ends[pair[1]]), points if pair[0] == one else points[::-1]))
            found.onward[numbers[pair], 0], found.onward[numbers[pair], 1] = ends[pair[0]], ends[pair[1]]
        found.onward[ends[one]] = (numbers[pair], 0 if pair[0] == one else 1)
    return found


def _near(ends: Sequence[_End], places: Array) -> list[list[int]]:
    """Returns the ends near each end, nearest first, without those of its own pavement unless they coincide."""
    near: list[list[tuple[float, int]]] = [[] for _ in ends]
    for one, other in sorted(cKDTree(places[:, :2]).query_pairs(LONGEST_CORNER)):
        gap = float(pn.hypot(*(places[one] - places[other])[:2]))
        if abs(places[one, 2] - places[other, 2]) < LEVEL_HEIGHT and (ends[one][0] != ends[other][0] or gap < SAME_END):
            near[one].append((gap, other))
            near[other].append((gap, one))
    return [[other for _, other in sorted(others)] for others in near]


def _way_on(places: Array, one: int, others: Sequence[int], edges: LaneEdges) -> tuple[int, Array] | None:
    """Returns the first of the given ends that is reachable without crossing a lane, and a straight or curved path."""
    for bow in BOWS:
        for other in others:
            line = places[[one, other]]
            across = line[1, :2] - line[0, :2]
            length = float(pn.hypot(*across))
            if length < SAME_END:
                return other, line
            if bow != 0.0:
                aside = bow / length * np.array([-across[1], across[0], 0.0])
                line = np.array([line[0], *(line[0] + s * (line[1] - line[0]) + aside for s in (0.25, 0.75)), line[1]])
            if all(edges.is_clear(leg, float(line[0, 2]), LANE_CLEARANCE) for leg in itertools.pairwise(line)):
                return other, line
    return None


def _crossings(
    network: TownNetwork, walks: RecordArray[WalkwayRecord], pavements: Sequence[Array]
) -> tuple[RecordArray[CrossingRecord], RecordArray[MouthRecord]]:
    town = network.town
    found: list[tuple[Array, list[tuple[float, int, float]]]] = []
    owners = np.repeat(np.arange(len(pavements)), [len(rows) for rows in pavements])
    rows = np.concatenate([each[:, :3] for each in pavements] or [np.zeros((1, 3))])
    for crosswalk in town.crosswalks if pavements else ():
        ends = _ends(network, crosswalk)
        sides = [_nearest_walk(rows, owners, end) for end in ends]
        if all(side[0] < KERB_REACH for side in sides):
            found.append((ends, sides))
    crossings = empty_records(CrossingRecord, max(len(found), 1))
    by_walk: defaultdict[int, list[tuple[float, int, int]]] = defaultdict(list)
    for k, (kerbs, sides) in enumerate(found):
        ends = _as_far_as(kerbs, np.array([_at(town.sidewalks[walk], s) for _, walk, s in sides]))
        across = ends[1, :2] - ends[0, :2]
        length = float(pn.hypot(*across))
        crossings[k].x, crossings[k].y = ends[:, 0], ends[:, 1]
        crossings[k].length, crossings[k].height = length, float(ends[:, 2].mean())
        crossings[k].cos, crossings[k].sin = across / max(length, 1e-6)
        for end, (_, walk, station) in enumerate(sides):
            crossings[k].walk[end], crossings[k].station[end] = walk, station
            by_walk[walk].append((station, k, end))
    mouths: list[tuple[float, int, int]] = []
    for walk in range(len(walks)):
        walks[walk].mouth, walks[walk].mouths = len(mouths), len(by_walk[walk])
        mouths += sorted(by_walk[walk])
    return crossings, filled_records(MouthRecord, mouths)


def _ends(network: TownNetwork, crosswalk: Crosswalk) -> Array:
    """Returns the two ends of a crosswalk (2, 2) [m], which crosses the lane closest to its centre."""
    middle = crosswalk.outline.mean(axis=0)[:2]
    lane = network.get_lane(network.get_closest_lane_index(middle)).town_lane
    heading = lane.heading_at(lane.project(middle)[0])
    across = np.array([-pm.sin(heading), pm.cos(heading)])
    reach = ((crosswalk.outline[:, :2] - middle) * across).sum(axis=1)
    ends: Array = middle + np.array([reach.min(), reach.max()])[:, None] * across
    return ends


def _as_far_as(ends: Array, places: Array) -> Array:
    """Extends the centre line of a crosswalk (2, 2) to places on the two pavements (2, 3) [m].

    Pedestrians walk from pavement to pavement, not from kerb to kerb, on the paint also where a pavement ends before
    it.
    """
    middle, across = ends.mean(axis=0), ends[1] - ends[0]
    reach = ((places[:, :2] - middle) * across).sum(axis=1) / (across * across).sum()
    return np.column_stack((middle + reach[:, None] * across, places[:, 2]))


def _nearest_walk(rows: Array, owners: NDArray[np.int64], place: Array) -> tuple[float, int, float]:
    """Returns distance [m], number and station [m] of the closest pavement.

    Args:
        rows: x, y, station of all points of all pavements.
        owners: number of the pavement of each.
        place: (2,) [m].
    """
    a, d = rows[:-1], np.diff(rows, axis=0)
    squared = np.maximum(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1], 1e-12)
    share = np.clip(((place - a[:, :2]) * d[:, :2]).sum(axis=1) / squared, 0.0, 1.0)
    nearest = a + share[:, None] * d
    gaps = pn.hypot(nearest[:, 0] - place[0], nearest[:, 1] - place[1])
    gaps[owners[1:] != owners[:-1]] = math.inf  # from one pavement to the next there is nothing
    at = int(gaps.argmin())
    return float(gaps[at]), int(owners[at]), float(nearest[at, 2])


def _at(walk: Sidewalk, station: float) -> Array:
    lengths = np.sqrt((np.diff(walk.points[:, :2], axis=0) ** 2).sum(axis=1))
    stations = np.concatenate(([0.0], np.cumsum(lengths)))
    return np.array([np.interp(station, stations, walk.points[:, column]) for column in range(3)])


def _passages(
    town: Town, lanes: RecordArray[LaneRecord], crossings: RecordArray[CrossingRecord]
) -> RecordArray[PassageRecord]:
    """Returns the passages of lanes over crosswalks, within half a crosswalk's depth of its centre line."""
    found: list[tuple[float, float, float, int]] = []
    reach = crossings["length"] / 2 + CROSSWALK_DEPTH
    middles = np.column_stack((crossings["x"].mean(axis=1), crossings["y"].mean(axis=1)))
    for lane in town.lanes:
        low, high = lane.points[:, :2].min(axis=0), lane.points[:, :2].max(axis=0)
        near = (middles > low - reach[:, None]).all(axis=1) & (middles < high + reach[:, None]).all(axis=1)
        passages = [(_passage(lane, crossings[k]), k) for k in np.flatnonzero(near & (crossings["length"] > 0.0))]
        own = sorted((*passage, int(k)) for passage, k in passages if passage is not None)
        lanes[lane.id].passage, lanes[lane.id].passages = len(found), len(own)
        found += own
    return filled_records(PassageRecord, found)


def _passage(lane: Lane, crossing: CrossingRecord) -> tuple[float, float, float] | None:
    """Returns first and last station of a lane on a crosswalk [m], and the distance along the crosswalk [m]."""
    stations = np.linspace(0.0, lane.length, int(lane.length / SAMPLE) + 2)
    x, y, z = (np.interp(stations, lane.stations, lane.points[:, column]) for column in range(3))
    dx, dy = x - crossing.x[0], y - crossing.y[0]
    along = dx * crossing.cos + dy * crossing.sin
    aside = np.abs(dy * crossing.cos - dx * crossing.sin)
    on = (aside < CROSSWALK_DEPTH / 2) & (along > 0.0) & (along < crossing.length)
    on &= np.abs(z - crossing.height) < LEVEL_HEIGHT
    if not on.any():
        return None
    return float(stations[on][0]), float(stations[on][-1]), float(along[on].mean())


def _lights(
    town: Town,
    lanes: RecordArray[LaneRecord],
    crossings: RecordArray[CrossingRecord],
    passages: RecordArray[PassageRecord],
) -> NDArray[np.int32]:
    """Records for each crosswalk the lanes that lead onto it from a light right before it."""
    passing: defaultdict[int, set[int]] = defaultdict(set)
    for lane in town.lanes:
        record = lanes[lane.id]
        for passage in passages[record.passage : record.passage + record.passages]:
            passing[int(passage.crossing)] |= {lane.id, *town.predecessors(lane.id)}
    heeded: list[int] = []
    for k, crossing in enumerate(crossings):
        crossing.light = len(heeded)
        for source in sorted(passing[k]):
            dx, dy = town.lanes[source].points[-1, :2] - (crossing.x[0], crossing.y[0])
            along, aside = dx * crossing.cos + dy * crossing.sin, abs(dy * crossing.cos - dx * crossing.sin)
            if lanes[source].programme >= 0 and aside < HEEDED and 0.0 < along < crossing.length:
                heeded.append(source)
        crossing.lights = len(heeded) - crossing.light
    return np.array(heeded, dtype=np.int32)
