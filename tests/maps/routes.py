"""Small towns for route search, and checks of routes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from dorothie_gym.maps import Junction, Lane, LaneLink, LinkType, Town
from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.maps.routing import CHANGE_LENGTH, SHORT_CHANGE, LaneEntry, Leg, Route, router
from dorothie_gym.maps.routing_graph import CHANGE_LEAD, SHARED, U_TURN_LENGTH, U_TURN_REST
from tests.sim.driving import planner_on

NAMES = ["brookside", "Town02", "Town05"]
Place = tuple[int, float]
Points = list[tuple[float, float]]

SIDE = {LaneEntry.CHANGE_LEFT: LinkType.LANE_CHANGE_LEFT, LaneEntry.CHANGE_RIGHT: LinkType.LANE_CHANGE_RIGHT}


def small_town(
    courses: list[Points],
    links: list[tuple[int, int, LinkType]],
    connectors: dict[int, int] | None = None,
    limits: dict[int, float] | None = None,
) -> Town:
    """Town of lanes along given points; `connectors` are the junctions of lanes, `limits` speed limits [km/h]."""
    connectors, limits = connectors or {}, limits or {}
    lanes = [
        Lane(
            id=k,
            road_id=k,
            lane_id=-1,
            junction_id=connectors.get(k, -1),
            points=np.array([(x, y, 0.0) for x, y in course]),
            widths=np.full(len(course), 3.5),
            speed_limit=limits.get(k, 40.0) / 3.6,
            street=k if k not in connectors else -1,
        )
        for k, course in enumerate(courses)
    ]
    junctions = [
        Junction(id=number, position=(0.0, 0.0), connectors=tuple(k for k, at in connectors.items() if at == number))
        for number in sorted(set(connectors.values()))
    ]
    return Town(name="small", lanes=lanes, links=[LaneLink(*row) for row in links], junctions=junctions)


def beside(left: int, right: int) -> list[tuple[int, int, LinkType]]:
    """Links between two lanes of one direction."""
    return [(left, right, LinkType.LANE_CHANGE_RIGHT), (right, left, LinkType.LANE_CHANGE_LEFT)]


def two_lanes(length: float) -> Town:
    """Lane 0 on the left of lane 1, both eastwards."""
    return small_town([[(0, 0), (length, 0)], [(0, 3.5), (length, 3.5)]], beside(0, 1))


def turn_lane(pocket: float, before: float = 100.0) -> Town:
    """Road (0) that continues beside a turn lane (2), the only lane with a left turn; 1 leads straight on.

    Lanes 3 and 4 are the connectors straight on and to the left, 5 and 6 the lanes behind the junction.
    """
    mouth = before + pocket
    return small_town(
        [
            [(0, 0), (before, 0)],
            [(before, 0), (mouth, 0)],
            [(before, -3.5), (mouth, -3.5)],
            [(mouth, 0), (mouth + 20, 0)],
            [(mouth, -3.5), (mouth + 6, -4.5), (mouth + 10, -10)],
            [(mouth + 20, 0), (mouth + 120, 0)],
            [(mouth + 10, -10), (mouth + 10, -110)],
        ],
        [
            (0, 1, LinkType.STRAIGHT),
            (1, 3, LinkType.STRAIGHT),
            (2, 4, LinkType.LEFT),
            (3, 5, LinkType.STRAIGHT),
            (4, 6, LinkType.STRAIGHT),
            *beside(2, 1),
        ],
        connectors={3: 7, 4: 7},
    )


def pairs(town: Town, count: int, seed: int = 0) -> list[tuple[Place, Place]]:
    rng = np.random.default_rng(seed)
    sites = [(site.lane, site.station) for site in town.sites]
    drawn = rng.integers(len(sites), size=(count, 2))
    return [(sites[int(a)], sites[int(b)]) for a, b in drawn]


def check_drivable(town: Town, route: Route, start: Place, goal: Place) -> None:
    assert (route.legs[0].lane, route.legs[0].start) == start
    assert (route.legs[-1].lane, route.legs[-1].end) == goal
    driven = sum(max(leg.end - leg.start, 0.0) for leg in route.legs)
    for leg in route.legs[:-1]:
        assert leg.start <= leg.end + 1e-9
    for one, two in itertools.pairwise(route.legs):
        if two.entry is LaneEntry.FOLLOW:
            assert two.lane in [link.target for link in town.successors(one.lane)]
            assert one.end == pytest.approx(town.lanes[one.lane].length)
            assert two.start == 0.0
        elif two.entry is LaneEntry.U_TURN:
            oncoming = oncoming_lanes(town).at(one.lane, one.end)
            assert oncoming is not None
            assert (oncoming.lane, oncoming.station + U_TURN_REST) == (two.lane, pytest.approx(two.start))
            assert planner_on(town, one.lane, one.end).may_turn_round(0.0)
            driven += U_TURN_LENGTH + U_TURN_REST
        else:
            assert town.neighbour(one.lane, SIDE[two.entry]) == two.lane
            driven += check_change(town, one, two)
    assert route.length == pytest.approx(driven, abs=1.0)


def check_change(town: Town, one: Leg, two: Leg) -> float:
    """Checks the room for a lane change on both lanes; returns its approximate length [m]."""
    lane, target = town.lanes[one.lane], town.lanes[two.lane]
    assert lane.length - (one.end - CHANGE_LEAD) >= SHORT_CHANGE - 1e-6
    assert not lane.in_junction
    assert np.hypot(*(target.position(target.project(lane.position(one.end))[0]) - lane.position(one.end))) < 6.0
    end, _ = lane.project(target.position(two.start))
    assert SHORT_CHANGE - CHANGE_LEAD - 0.5 <= end - one.end <= CHANGE_LENGTH - CHANGE_LEAD + 0.5
    return end - one.end


def check_clear(town: Town, route: Route, start: Place, blocked: list[Place]) -> None:
    """No leg passes a blocked cell, nor does a lane change while it is on its lane."""
    search = router(town)
    closed = search.cells_of(blocked)
    for one, two in itertools.zip_longest(route.legs, route.legs[1:]):
        parts = [(one.lane, one.start, one.end)]
        if two is not None and two.entry in SIDE:
            end, _ = town.lanes[one.lane].project(town.lanes[two.lane].position(two.start))
            parts.append((one.lane, one.end, one.end + SHARED * 0.98 * (end - one.end)))
            begin, _ = town.lanes[two.lane].project(town.lanes[one.lane].position(one.end))
            parts.append((two.lane, two.start - SHARED * 0.98 * (two.start - begin), two.start))
        for lane, first, last in parts:
            cells = set(range(search.cell(lane, first), search.cell(lane, max(last - 1e-6, first)) + 1))
            if lane == start[0] and one is route.legs[0]:
                cells -= {search.cell(*start)}
                assert not any(on == lane and start[1] < at < last for on, at in blocked)
            assert not cells & closed
