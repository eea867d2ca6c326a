"""Streets and landmark sites inferred for maps that do not define them.

Both depend on lanes and links alone, so that a map always yields the same streets and sites.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from dorothie_gym.maps.model import NO_STREET, Array, Lane, LaneLink, Site, Street
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.portable_math import wrap_degrees

# Largest change of direction at which a street continues across a junction [degrees].
STREET_BEND = 35.0
# Minimum number of streets of a large map, and maximum number of any map.
FEWEST_STREETS, MOST_STREETS = 8, 14
# Shortest length of lane in each part of a divided street [m].
SHORTEST_PART = 100.0

# Distance from the lane's edge to a landmark [m].
SITE_OFFSET = 6.0
# Spacing of the candidate sites [m].
SITE_STEP = 5.0
# (shortest lane, distance from both of its ends) [m]: the next pair is tried if there are too few candidates.
SITE_RULES = ((40.0, 15.0), (25.0, 10.0), (12.0, 5.0), (2.0, 1.0))
# Largest speed limit of a lane with a site [m/s]: just above 70 km/h.
FASTEST_STOP = 20.0
# Smallest difference between the distances of a landmark to the nearest other lane and to its own [m].
SITE_CLEARANCE = 0.5


@dataclass(frozen=True)
class _Joint:
    """Connection between the ends of two roads; an end is (road id, 0 at its start or 1 at its end)."""

    ends: tuple[tuple[int, int], tuple[int, int]]
    bend: float  # degrees, not negative
    crosses: bool  # through a junction


def name_streets(lanes: Sequence[Lane], links: Sequence[LaneLink]) -> tuple[tuple[Lane, ...], tuple[Street, ...]]:
    """Joins roads that continue straight across junctions to streets.

    Every lane outside junctions belongs to one street; a connector belongs to the common street of all lanes at both of
    its ends, if there is one. If there are too many streets, the shortest is merged into the one that it meets most
    straight; if a large map has too few, the longest is divided at a junction.

    Args:
        lanes: lanes of the town; `street` is ignored.
        links: links between them.

    Returns:
        The lanes with `street` set, and the streets, longest first, with placeholder names.
    """
    length: dict[int, float] = defaultdict(float)
    for lane in lanes:
        if not lane.in_junction:
            length[lane.road_id] += lane.length
    joints = _joints(lanes, links)
    streets = _chains(sorted(length), joints)
    streets = _divide(streets, joints, length)
    streets = _gather(streets, joints, length)
    street_of = {road: k for k, roads in enumerate(streets) for road in roads}
    numbers = _lane_streets(lanes, links, street_of)
    total = [0.0] * len(streets)
    for lane, number in zip(lanes, numbers, strict=True):
        if number != NO_STREET:
            total[number] += lane.length
    order = sorted(range(len(streets)), key=lambda k: (-total[k], min(streets[k])))
    rank = {NO_STREET: NO_STREET} | {k: place for place, k in enumerate(order)}
    named = tuple(replace(lane, street=rank[number]) for lane, number in zip(lanes, numbers, strict=True))
    return named, tuple(
        Street(id=k, name=f"Street {k + 1}", lanes=tuple(lane.id for lane in named if lane.street == k))
        for k in range(len(streets))
    )


def _ways_on(lanes: Sequence[Lane], links: Sequence[LaneLink]) -> Iterator[tuple[Lane, Lane, bool]]:
    """Yields pairs of successive lanes outside junctions, with whether a junction lies between them."""
    after = _followers(lanes, links)
    for lane in lanes:
        if lane.in_junction:
            continue
        seen: dict[int, None] = {}
        todo = [(target, False) for target in reversed(after[lane.id])]
        while todo:
            target, crosses = todo.pop()
            if not lanes[target].in_junction:
                yield lane, lanes[target], crosses
            elif target not in seen:
                seen[target] = None
                todo.extend((further, True) for further in reversed(after[target]))


def _followers(lanes: Sequence[Lane], links: Sequence[LaneLink]) -> list[list[int]]:
    after: list[list[int]] = [[] for _ in lanes]
    for link in links:
        if not link.type.is_lane_change:
            after[link.source].append(link.target)
    return after


def _joints(lanes: Sequence[Lane], links: Sequence[LaneLink]) -> list[_Joint]:
    """Returns each connection between roads once, at its smallest change of direction, the straightest first."""
    best: dict[tuple[tuple[int, int], tuple[int, int]], _Joint] = {}
    for source, target, crosses in _ways_on(lanes, links):
        if source.road_id == target.road_id:
            continue
        leaves, enters = (source.road_id, int(source.lane_id < 0)), (target.road_id, int(target.lane_id > 0))
        ends = min(leaves, enters), max(leaves, enters)
        bend = abs(wrap_degrees(float(np.degrees(target.headings[0] - source.headings[-1]))))
        if ends not in best or bend < best[ends].bend:
            best[ends] = _Joint(ends, bend, crosses)
    return sorted(best.values(), key=lambda joint: (joint.crosses, joint.bend, joint.ends))


def _unbroken(joints: list[_Joint]) -> frozenset[tuple[int, int]]:
    """Returns the pairs of roads, smaller id first, that touch without a junction: the name does not change there."""
    touching = (joint.ends for joint in joints if not joint.crosses)
    return frozenset(_pair(a[0], b[0]) for a, b in touching)


def _chains(roads: list[int], joints: list[_Joint]) -> list[list[int]]:
    """Returns the roads of each street in driving order; each end of a road is joined at most once."""
    beyond: dict[tuple[int, int], tuple[int, int]] = {}
    for joint in joints:
        a, b = joint.ends
        if joint.bend < STREET_BEND and a not in beyond and b not in beyond:
            beyond[a], beyond[b] = b, a
    unbroken = _unbroken(joints)
    # Streets with an end first, from that end; the rest are rings, opened at a junction if they cross one.
    starts = [(road, side) for road in roads for side in (0, 1) if (road, side) not in beyond]
    rings = sorted(roads, key=lambda road: _pair(road, beyond.get((road, 0), (road, 0))[0]) in unbroken)
    chains, done = [], dict.fromkeys(roads, False)
    for start, side in (*starts, *((road, 0) for road in rings)):
        chain, road = [], start
        while not done[road]:
            done[road] = True
            chain.append(road)
            road, side = beyond.get((road, 1 - side), (road, side))
        if chain:
            chains.append(chain)
    return chains


def _pair(a: int, b: int) -> tuple[int, int]:
    return min(a, b), max(a, b)


def _divide(streets: list[list[int]], joints: list[_Joint], length: dict[int, float]) -> list[list[int]]:
    """Divides streets until there are enough or the parts become too short.

    The longest street that crosses a junction is cut at the junction nearest its centre; if there is none, the longest
    street of several roads is cut where two of them touch (exporters begin a new road at corners).
    """
    streets = [list(roads) for roads in streets]
    unbroken = _unbroken(joints)
    while len(streets) < FEWEST_STREETS:
        cuts = []
        for k, roads in enumerate(streets):
            before = np.cumsum([length[road] for road in roads]).tolist()
            for i in range(len(roads) - 1):
                part = min(before[i], before[-1] - before[i])
                if part >= SHORTEST_PART:
                    cuts.append((_pair(roads[i], roads[i + 1]) not in unbroken, before[-1], -k, part, i + 1))
        if not cuts:
            break
        _, _, minus_k, _, at = max(cuts)
        roads = streets[-minus_k]
        streets[-minus_k : -minus_k + 1] = [roads[:at], roads[at:]]
    return streets


def _gather(streets: list[list[int]], joints: list[_Joint], length: dict[int, float]) -> list[list[int]]:
    """Merges the shortest street into the one that it meets most straight until there are few enough."""
    streets = [list(roads) for roads in streets]
    while len(streets) > MOST_STREETS:
        short = min(range(len(streets)), key=lambda k: (sum(length[r] for r in streets[k]), min(streets[k])))
        street_of = {road: k for k, roads in enumerate(streets) for road in roads}
        meeting = [
            (joint.bend, met[int(met[0] == short)])
            for joint in joints
            if short in (met := (street_of[joint.ends[0][0]], street_of[joint.ends[1][0]])) and met[0] != met[1]
        ]
        # A street that meets no other (a map in two parts) is merged into the shortest of the rest.
        others = (k for k in range(len(streets)) if k != short)
        host = min(meeting)[1] if meeting else min(others, key=lambda k: sum(length[r] for r in streets[k]))
        streets[host].extend(streets[short])
        del streets[short]
    return streets


def _lane_streets(lanes: Sequence[Lane], links: Sequence[LaneLink], street_of: dict[int, int]) -> list[int]:
    """Returns the street of each lane; that of a connector is the common street of all paths through it."""
    touched: list[dict[int, None]] = [{} for _ in lanes]
    after = _followers(lanes, links)
    before: list[list[int]] = [[] for _ in lanes]
    for source, targets in enumerate(after):
        for target in targets:
            before[target].append(source)
    for table in (after, before):
        for lane in lanes:
            if lane.in_junction:
                for end in _plain_ends(lanes, table, lane.id):
                    touched[lane.id][street_of[lanes[end].road_id]] = None
    return [
        (next(iter(touched[lane.id])) if len(touched[lane.id]) == 1 else NO_STREET)
        if lane.in_junction
        else street_of[lane.road_id]
        for lane in lanes
    ]


def _plain_ends(lanes: Sequence[Lane], table: list[list[int]], start: int) -> Iterator[int]:
    """Yields the first lanes outside junctions on all paths along `table` from a connector."""
    seen, todo = {start: None}, [start]
    while todo:
        for lane in table[todo.pop()]:
            if not lanes[lane].in_junction:
                yield lane
            elif lane not in seen:
                seen[lane] = None
                todo.append(lane)


def lay_sites(
    lanes: Sequence[Lane], links: Sequence[LaneLink], count: int = 24, avoid: Collection[int] = ()
) -> tuple[Site, ...]:
    """Places landmark sites at the kerb, spread over the town by farthest-point sampling.

    A site lies to the right of the outermost lane of a road, at half the lane width plus 6 m, where no other lane is as
    close. Its lane belongs to the largest strongly connected part of the town.

    Args:
        lanes: lanes of the town, with streets.
        links: links between them, lane changes included.
        count: number of sites.
        avoid: lanes without sites.

    Returns:
        At most `count` sites; fewer if the map has no room.
    """
    usable = _calm([lane for lane in _kerb_lanes(lanes, links) if lane.id not in avoid])
    for shortest, margin in SITE_RULES:
        places = _candidates([lane for lane in usable if lane.length >= shortest], margin)
        if len(places):
            places = places[_is_clear(lanes, places)]
        if len(places) >= count:
            break
    chosen = _spread(places[:, 2:4], count) if len(places) else []
    return tuple(_site(k, lanes[int(places[row, 0])], places[row]) for k, row in enumerate(sorted(chosen)))


def _kerb_lanes(lanes: Sequence[Lane], links: Sequence[LaneLink]) -> list[Lane]:
    """Returns the outermost lanes outside junctions in the largest strongly connected part of the town."""
    pairs = np.array([(link.source, link.target) for link in links], dtype=int).reshape(-1, 2)
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(lanes), len(lanes)))
    _, part = connected_components(graph, directed=True, connection="strong")
    largest = int(np.argmax(np.bincount(part)))
    outermost: dict[tuple[int, bool], int] = defaultdict(int)
    for lane in lanes:
        side = lane.road_id, lane.lane_id > 0
        outermost[side] = max(outermost[side], abs(lane.lane_id))
    return [
        lane
        for lane in lanes
        if not lane.in_junction
        and part[lane.id] == largest
        and abs(lane.lane_id) == outermost[lane.road_id, lane.lane_id > 0]
    ]


def _calm(lanes: list[Lane]) -> list[Lane]:
    """Returns the lanes that are slow enough for stops, or all lanes if most of the map is fast."""
    calm = [lane for lane in lanes if lane.speed_limit <= FASTEST_STOP]
    return calm if 2 * len(calm) >= len(lanes) else lanes


def _candidates(lanes: Iterable[Lane], margin: float) -> Array:
    """Returns candidate sites along lanes: rows of lane, station, landmark x, y, waypoint x, y [m]."""
    tables = [np.empty((0, 6))]
    for lane in lanes:
        room = lane.length - 2.0 * margin
        if room <= 0.0:
            continue
        s = np.linspace(margin, lane.length - margin, int(room / SITE_STEP) + 1) if room > SITE_STEP else [margin]
        station = np.asarray(s, dtype=float)
        x, y, heading, width = (
            np.interp(station, lane.stations, column)
            for column in (lane.points[:, 0], lane.points[:, 1], lane.headings, lane.widths)
        )
        aside = 0.5 * width + SITE_OFFSET
        number = np.full(len(station), float(lane.id))
        place = (x - aside * pn.sin(heading), y + aside * pn.cos(heading))
        tables.append(np.column_stack((number, station, *place, x, y)))
    return np.concatenate(tables)


def _is_clear(lanes: Sequence[Lane], places: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Returns which candidates have their own waypoint as the closest point of all lanes (n,)."""
    points, owner = [], []
    for lane in lanes:
        s = np.linspace(0.0, lane.length, int(np.ceil(lane.length)) + 1)
        points.append([np.interp(s, lane.stations, lane.points[:, k]) for k in (0, 1)])
        owner.append(np.full(len(s), lane.id))
    tree, owners = cKDTree(np.concatenate(points, axis=1).T), np.concatenate(owner)
    aside = pn.hypot(*(places[:, 2:4] - places[:, 4:6]).T)
    # Lanes are sampled every metre, which is at most 2 cm off their true distance: the waypoint must be closest.
    near, index = tree.query(places[:, 2:4], k=1)
    clear = (owners[index] == places[:, 0].astype(int)) & (near >= aside - 0.05)
    rows = np.flatnonzero(clear)
    around = tree.query_ball_point(places[rows, 2:4], aside[rows] + SITE_CLEARANCE)
    clear[rows] = [bool(np.all(owners[found] == place)) for found, place in zip(around, places[rows, 0], strict=True)]
    result: np.ndarray[tuple[int], np.dtype[np.bool_]] = clear
    return result


def _spread(positions: Array, count: int) -> list[int]:
    """Returns rows of positions (n, 2) by farthest-point sampling."""
    middle = positions.mean(axis=0)
    chosen = [int(np.argmax(pn.hypot(*(positions - middle).T)))]
    distance = pn.hypot(*(positions - positions[chosen[0]]).T)
    while len(chosen) < min(count, len(positions)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, pn.hypot(*(positions - positions[chosen[-1]]).T))
    return chosen


def _site(number: int, lane: Lane, row: Array) -> Site:
    """Returns the site of a candidate; its waypoint is projected exactly."""
    station, _ = lane.project(row[2:4])
    x, y = lane.position(station)
    return Site(
        id=number,
        lane=lane.id,
        station=station,
        position=(float(row[2]), float(row[3])),
        waypoint=(float(x), float(y)),
        street=lane.street,
    )
