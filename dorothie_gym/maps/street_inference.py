"""Streets inferred for maps that do not define them.

They depend on lanes and links alone, so that a map always yields the same streets.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dorothie_gym.maps.model import NO_STREET, Lane, LaneLink, Street
from dorothie_gym.maps.two_way_roads import RoadWay, two_way_roads
from dorothie_gym.support.portable_math import wrap_degrees

# Largest change of direction at which a street continues across a junction [degrees].
STREET_BEND = 35.0
# Minimum number of streets of a large map, and maximum number of any map.
FEWEST_STREETS, MOST_STREETS = 8, 14
# Shortest length of lane in each part of a divided street [m].
SHORTEST_PART = 100.0


@dataclass(frozen=True)
class _Joint:
    """Connection between the ends of two roads; an end is (road id, 0 at its start or 1 at its end)."""

    ends: tuple[tuple[int, int], tuple[int, int]]
    bend: float  # degrees, not negative
    crosses: bool  # through a junction


def name_streets(
    lanes: Sequence[Lane], links: Sequence[LaneLink], fewest: int = FEWEST_STREETS
) -> tuple[tuple[Lane, ...], tuple[Street, ...]]:
    """Joins roads that continue straight across junctions to streets.

    Two roads for the two directions of a street, as SUMO writes them, count as one. Every lane outside junctions
    belongs to one street; a connector belongs to the common street of all lanes at both of its ends, if there is one.
    If there are too many streets, the shortest is merged into the one that it meets most straight; if a large map has
    too few, the longest is divided at a junction.

    Args:
        lanes: lanes of the town; `street` is ignored.
        links: links between them.
        fewest: number of streets below which the longest are divided.

    Returns:
        The lanes with `street` set, and the streets, longest first, with placeholder names.
    """
    ways = two_way_roads(lanes)
    length: dict[int, float] = defaultdict(float)
    for lane in lanes:
        if not lane.in_junction:
            length[ways[lane.road_id].road] += lane.length
    joints = _joints(lanes, links, ways)
    streets = _chains(sorted(length), joints)
    streets = _divide(streets, joints, length, fewest)
    streets = _gather(streets, joints, length)
    number_of = {road: k for k, roads in enumerate(streets) for road in roads}
    street_of = {road: number_of[way.road] for road, way in ways.items() if way.road in number_of}
    of_lane = {lane.id: street_of[lane.road_id] for lane in lanes if not lane.in_junction}
    numbers = common_streets(lanes, links, of_lane)
    total = [0.0] * len(streets)
    for lane, number in zip(lanes, numbers, strict=True):
        if number != NO_STREET:
            total[number] += lane.length
    order = sorted(range(len(streets)), key=lambda k: (-total[k], min(streets[k])))
    rank = {NO_STREET: NO_STREET} | {k: place for place, k in enumerate(order)}
    named = tuple(replace(lane, street=rank[number]) for lane, number in zip(lanes, numbers, strict=True))
    return named, tuple(
        Street(id=k, name=Street.placeholder(k + 1), lanes=tuple(lane.id for lane in named if lane.street == k))
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


def _joints(lanes: Sequence[Lane], links: Sequence[LaneLink], ways: Mapping[int, RoadWay]) -> list[_Joint]:
    """Returns each connection between roads once, at its smallest change of direction, the straightest first."""
    best: dict[tuple[tuple[int, int], tuple[int, int]], _Joint] = {}
    for source, target, crosses in _ways_on(lanes, links):
        origin, goal = ways[source.road_id], ways[target.road_id]
        if origin.road == goal.road:
            continue
        leaves = origin.road, int((source.lane_id < 0) != origin.flipped)
        enters = goal.road, int((target.lane_id > 0) != goal.flipped)
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


def _divide(streets: list[list[int]], joints: list[_Joint], length: dict[int, float], fewest: int) -> list[list[int]]:
    """Divides streets until there are enough or the parts become too short.

    The longest street that crosses a junction is cut at the junction nearest its centre; if there is none, the longest
    street of several roads is cut where two of them touch (exporters begin a new road at corners).
    """
    streets = [list(roads) for roads in streets]
    unbroken = _unbroken(joints)
    while len(streets) < fewest:
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


def common_streets(lanes: Sequence[Lane], links: Sequence[LaneLink], street_of: Mapping[int, int]) -> list[int]:
    """Returns the street of each lane; that of a connector is the common street of all paths through it.

    Args:
        lanes: lanes of the town.
        links: links between them.
        street_of: street of each lane outside junctions, by its id.
    """
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
                    touched[lane.id][street_of[end]] = None
    return [
        (next(iter(touched[lane.id])) if len(touched[lane.id]) == 1 else NO_STREET)
        if lane.in_junction
        else street_of[lane.id]
        for lane in lanes
    ]


def _plain_ends(lanes: Sequence[Lane], table: list[list[int]], start: int) -> Iterator[int]:
    """Yields the ids of the first lanes outside junctions on all paths along `table` from a connector."""
    seen, todo = {start: None}, [start]
    while todo:
        for lane in table[todo.pop()]:
            if not lanes[lane].in_junction:
                yield lane
            elif lane not in seen:
                seen[lane] = None
                todo.append(lane)
