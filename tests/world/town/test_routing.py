from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.world.car.planner import LocalPlanner
from dorothie_gym.world.town import LinkType, Town
from dorothie_gym.world.town.oncoming import oncoming_lanes
from dorothie_gym.world.town.routing import Entry, Route, Router, router
from tests.world.driving import network

NAMES = ["brookside", "Town02", "Town05"]
Place = tuple[int, float]


def pairs(town: Town, count: int, seed: int = 0) -> list[tuple[Place, Place]]:
    rng = np.random.default_rng(seed)
    sites = [(site.lane, site.station) for site in town.sites]
    drawn = rng.integers(len(sites), size=(count, 2))
    return [(sites[int(a)], sites[int(b)]) for a, b in drawn]


def check_drivable(town: Town, route: Route, start: Place, goal: Place) -> None:
    assert (route.legs[0].lane, route.legs[0].start) == start
    assert (route.legs[-1].lane, route.legs[-1].end) == goal
    for one, two in zip(route.legs[:-1], route.legs[1:], strict=True):
        if two.entry is Entry.FOLLOW:
            assert two.lane in [link.target for link in town.successors(one.lane)]
            assert one.end == pytest.approx(town.lanes[one.lane].length)
            assert two.start == 0.0
        elif two.entry is Entry.U_TURN:
            oncoming = oncoming_lanes(town).at(one.lane, one.end)
            assert oncoming is not None
            assert oncoming.lane == two.lane
            assert LocalPlanner(town, one.lane, one.end).may_turn_round(0.0)
        else:
            side = LinkType.LANE_CHANGE_LEFT if two.entry is Entry.CHANGE_LEFT else LinkType.LANE_CHANGE_RIGHT
            assert town.neighbour(one.lane, side) == two.lane


@pytest.mark.parametrize("name", NAMES)
def test_routes_are_what_the_car_can_drive(name: str) -> None:
    town = network(name).town
    for start, goal in pairs(town, 60):
        route = router(town).route(start, goal)
        assert route is not None
        check_drivable(town, route, start, goal)


@pytest.mark.parametrize("name", NAMES)
def test_routes_avoid_roadblocks(name: str) -> None:
    town = network(name).town
    search, avoided = router(town), 0
    for start, goal in pairs(town, 30, seed=1):
        free = search.route(start, goal)
        assert free is not None
        longest = max(free.legs, key=lambda leg: leg.end - leg.start)
        block = (longest.lane, (longest.start + longest.end) / 2)
        if search.cell(*block) in (search.cell(*start), search.cell(*goal)):
            continue
        around = search.route(start, goal, [block])
        if around is None:
            assert not search.reachable(start, [block])[search.cell(*goal)]
            continue
        avoided += 1
        check_drivable(town, around, start, goal)
        for leg in around.legs:
            assert not (leg.lane == block[0] and leg.start + 10.0 < block[1] < leg.end - 10.0)
    assert avoided > 5


def test_costs_are_those_of_a_plain_search() -> None:
    town = network("brookside").town
    search = Router(town)
    graph = search._graph.tocoo()
    edges = list(zip(graph.row.tolist(), graph.col.tolist(), graph.data.tolist(), strict=True))
    start = search.cell(town.sites[0].lane, town.sites[0].station)
    cost = {start: 0.0}
    for _ in range(graph.shape[0]):  # Bellman and Ford
        changed = False
        for one, two, length in edges:
            if one in cost and cost[one] + length < cost.get(two, math.inf) - 1e-9:
                cost[two], changed = cost[one] + length, True
        if not changed:
            break
    for site in town.sites:
        distances = search.distances_to((site.lane, site.station))
        assert distances[start] == pytest.approx(cost[search.cell(site.lane, site.station)])


@pytest.mark.parametrize("name", NAMES)
def test_reachable_cells_are_those_that_have_a_route(name: str) -> None:
    town = network(name).town
    search = router(town)
    start = (town.sites[0].lane, town.sites[0].station)
    blocked = [(site.lane, site.station) for site in town.sites[5:20:3]]
    found = search.reachable(start, blocked)
    for site in town.sites:
        goal = (site.lane, site.station)
        if search.cell(*goal) != search.cell(*start):
            assert found[search.cell(*goal)] == (search.route(start, goal, blocked) is not None)


@pytest.mark.parametrize("name", NAMES)
def test_goal_just_behind_the_start_means_a_way_round(name: str) -> None:
    town = network(name).town
    site = town.sites[0]
    lane = town.lanes[site.lane]
    size = lane.length / max(1, round(lane.length / 10.0))
    start = (site.lane, (int(site.station / size) + 0.9) * size)
    goal = (site.lane, start[1] - 0.8 * size)
    route = router(town).route(start, goal)
    assert route is not None
    check_drivable(town, route, start, goal)
    assert len(route.legs) > 2
    assert route.length > 30.0


def test_place_ahead_in_the_same_cell_is_driven_to_straight() -> None:
    town = network("brookside").town
    route = router(town).route((0, 41.0), (0, 44.0))
    assert route is not None
    assert (route.lanes, route.length) == ((0,), pytest.approx(3.0))


def test_crossed_junctions_are_told_in_order() -> None:
    town = network("brookside").town
    start, goal = pairs(town, 9)[8]
    route = router(town).route(start, goal)
    assert route is not None
    ids = {junction.id for junction in town.junctions}
    assert set(route.junctions(town)) <= ids
