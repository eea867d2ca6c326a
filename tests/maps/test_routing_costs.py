from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from dorothie_gym.maps import Lane, LinkType, Town
from dorothie_gym.maps.routing import CHANGE_COST, TURN_COST, LaneEntry, Router, router
from dorothie_gym.maps.routing_graph import SPEEDS, USUAL_SPEED
from tests.maps.reference_routing import ReferenceGraph, ReferenceRouter, RoutingEdges
from tests.maps.routes import Place, Points, pairs, small_town, two_lanes
from tests.plain_python import printed_compiled_and_plain
from tests.sim.driving import network


def bellman_ford(moves: RoutingEdges, source: int) -> dict[int, float]:
    edges = list(zip(moves.source.tolist(), moves.target.tolist(), moves.cost.tolist(), strict=True))
    cost = {source: 0.0}
    changed = True
    while changed:
        changed = False
        for one, two, more in edges:
            if one in cost and cost[one] + more < cost.get(two, math.inf) - 1e-9:
                cost[two], changed = cost[one] + more, True
    return cost


def test_costs_are_those_of_a_plain_search() -> None:
    town = network("brookside").town
    search, graph = Router(town), ReferenceGraph(town)
    for start, goal in pairs(town, 6, seed=3):
        ends = [graph.departures(start, goal, ()), graph.arrivals(goal)]
        cost = bellman_ford(RoutingEdges.join([graph.edges, *ends]), graph.start)
        route = search.route(start, goal)
        assert route is not None
        assert route.cost == pytest.approx(cost[graph.goal])


@pytest.mark.parametrize("name", ["brookside", "midtown", "Town05"])
def test_routes_and_distances_are_those_of_scipy(name: str) -> None:
    town = network(name).town
    search, reference = Router(town), ReferenceRouter(town)
    rng, sites = np.random.default_rng(4), [(site.lane, site.station) for site in town.sites]

    def place() -> Place:
        lane = town.lanes[int(rng.integers(len(town.lanes)))]
        return lane.id, float(rng.choice([0.0, rng.uniform(0.0, lane.length), lane.length], p=[0.1, 0.8, 0.1]))

    for k in range(150):
        start, goal = place(), place() if k % 2 else sites[k % len(sites)]
        blocked = [place() for _ in range(int(rng.choice([0, 0, 1, 3, 12])))]
        if k % 3 == 0:  # in or just before the cell of the start, and a goal on its lane
            length = town.lanes[start[0]].length
            blocked.append((start[0], min(start[1] + float(rng.uniform(-5.0, 15.0)), length)))
            goal = start[0], float(rng.uniform(0.0, length))
        route, expected = search.route(start, goal, blocked), reference.route(start, goal, blocked)
        assert (route is None) == (expected is None)
        if route is not None and expected is not None:
            assert [(leg.lane, leg.entry) for leg in route.legs] == [(leg.lane, leg.entry) for leg in expected.legs]
            stations = [[(leg.start, leg.end) for leg in found.legs] for found in (route, expected)]
            np.testing.assert_allclose(stations[0], stations[1], rtol=0, atol=1e-9)
            assert (route.length, route.cost) == pytest.approx((expected.length, expected.cost), abs=1e-9)
        if k % 5 == 0:
            distances = search.distances_to(goal, blocked)
            np.testing.assert_allclose(distances, reference.distances_to(goal, blocked), rtol=0, atol=1e-9)


@pytest.mark.long
def test_routes_are_the_same_without_compilation() -> None:
    program = """
from dorothie_gym.maps import load_town
from dorothie_gym.maps.routing import router
town = load_town("brookside")
search, places = router(town), [(site.lane, site.station) for site in town.sites[::5]]
for start in places:
    for goal in places:
        print(search.route(start, goal), search.route(start, goal, [(goal[0], 20.0), (start[0], start[1] + 12.0)]))
    print(search.distances_to(start, places[:2]).tolist())
"""
    compiled, plain = printed_compiled_and_plain(program)
    assert compiled == plain != ""


@pytest.mark.parametrize("name", ["brookside", "Town05"])
def test_distances_to_a_goal_are_the_costs_of_routes_there(name: str) -> None:
    town = network(name).town
    search = router(town)
    goal = (town.sites[3].lane, town.sites[3].station)
    distances = search.distances_to(goal)
    for lane in town.lanes[::7]:
        route = search.route((lane.id, 0.0), goal)
        assert route is not None
        # a route may begin with a U-turn or lane change at once, where the table counts from the middle of the cell on
        assert route.cost <= distances[search.cell(lane.id, 0.0)] + 1e-6
        if len(route.legs) > 1 and route.legs[1].entry is LaneEntry.FOLLOW:
            assert route.cost == pytest.approx(distances[search.cell(lane.id, 0.0)])


@pytest.mark.parametrize("seed", range(12))
def test_no_other_path_is_cheaper_than_the_route(seed: int) -> None:
    """Every way through a small town is looked at and priced by hand; its lanes are far apart, so only turns matter."""
    rng = np.random.default_rng(seed)
    crossings = [(200.0 * (k % 3), 200.0 * (k // 3)) for k in range(9)]
    kinds = [LinkType.STRAIGHT, LinkType.LEFT, LinkType.RIGHT]
    courses: list[Points] = []
    ends = [(a, b) for a in range(9) for b in range(9) if abs(a % 3 - b % 3) + abs(a // 3 - b // 3) == 1]
    ends = [pair for pair in ends if rng.random() < 0.6]
    for a, b in ends:
        bulge = rng.uniform(-60.0, 60.0, 2)
        (ax, ay), (bx, by) = crossings[a], crossings[b]
        courses.append([(ax, ay), ((ax + bx) / 2 + bulge[0], (ay + by) / 2 + bulge[1]), (bx, by)])
    links = [
        (i, j, kinds[int(rng.integers(3))])
        for i, (_, b) in enumerate(ends)
        for j, (c, d) in enumerate(ends)
        if b == c and d != ends[i][0]
    ]
    limits = {k: float(rng.choice([5, 30, 40, 60, 90])) for k in range(len(ends))}
    # every lane in a junction of its own: there no car turns round; one lies outside, far away
    courses.append([(0.0, -500.0), (100.0, -500.0)])
    town = small_town(courses, links, connectors={k: k for k in range(len(ends))}, limits=limits)
    weight = [USUAL_SPEED / float(np.clip(lane.speed_limit, *SPEEDS)) for lane in town.lanes]
    turn = {(a, b): TURN_COST[kind] for a, b, kind in links}

    def ways(lane: int, goal: int, seen: tuple[int, ...]) -> list[tuple[int, ...]]:
        if lane == goal:
            return [seen]
        return [
            way
            for link in town.successors(lane)
            if link.target not in seen
            for way in ways(link.target, goal, (*seen, link.target))
        ]

    start, goal = 0, len(ends) - 1
    first, last = 0.3 * town.lanes[start].length, 0.6 * town.lanes[goal].length
    prices = []
    for way in ways(start, goal, (start,)):
        driven = sum(town.lanes[lane].length * weight[lane] for lane in way[:-1]) - first * weight[start]
        prices.append(driven + last * weight[goal] + sum(turn[pair] for pair in itertools.pairwise(way)))
    route = Router(town).route((start, first), (goal, last))
    assert (route is None) == (not prices)
    if route is not None:
        assert route.cost == pytest.approx(min(prices))
        metres = sum(town.lanes[lane].length for lane in route.lanes[:-1]) - first + last
        assert route.length == pytest.approx(metres)


def fork(detour: float, turn: LinkType, limit: float = 40.0) -> tuple[Town, Router]:
    """From lane 0 to lane 3 along lane 1, straight on, or along lane 2, which differs by `detour` metres and a turn."""
    town = small_town(
        [
            [(0, 0), (100, 0)],
            [(100, 0), (150, 40), (200, 0)],
            [(100, 0), (150, -40), (200 + detour, 0)],
            [(200, 0), (300, 0)],
        ],
        [
            (0, 1, LinkType.STRAIGHT),
            (0, 2, turn),
            (1, 3, LinkType.STRAIGHT),
            (2, 3, LinkType.STRAIGHT),
        ],
        limits={2: limit},
    )
    return town, Router(town)


def test_harder_turns_cost_more() -> None:
    costs = [TURN_COST[kind] for kind in (LinkType.STRAIGHT, LinkType.RIGHT, LinkType.LEFT, LinkType.U_TURN)]
    assert costs == sorted(set(costs))
    assert costs[0] == 0.0


@pytest.mark.parametrize("turn", [LinkType.LEFT, LinkType.RIGHT])
def test_a_turn_is_taken_where_it_saves_more_than_it_costs(turn: LinkType) -> None:
    for margin, lane in ((-1.5, 1), (1.5, 2)):
        saving = TURN_COST[turn] + margin
        town, search = fork(0.0, turn)
        short = town.lanes[1].length - saving
        # the second lane is made so long that it saves just that
        height = math.sqrt((short / 2) ** 2 - 50.0**2)
        lanes = list(town.lanes)
        lanes[2] = Lane(
            id=2,
            road_id=2,
            lane_id=-1,
            points=np.array([(100, 0, 0), (150, -height, 0), (200, 0, 0)], dtype=float),
            widths=np.full(3, 3.5),
            speed_limit=lanes[2].speed_limit,
        )
        search = Router(Town(name="fork", lanes=lanes, links=town.links, junctions=()))
        route = search.route((0, 10.0), (3, 50.0))
        assert route is not None
        assert route.lanes == (0, lane, 3)


def test_a_highway_is_taken_though_it_is_longer() -> None:
    for limit, lane in ((40.0, 1), (60.0, 2)):
        town, search = fork(30.0, LinkType.STRAIGHT, limit)
        assert town.lanes[2].length > town.lanes[1].length + 20.0
        route = search.route((0, 10.0), (3, 50.0))
        assert route is not None
        assert route.lanes == (0, lane, 3)
        assert route.length == pytest.approx(90.0 + town.lanes[lane].length + 50.0)


def test_cost_of_a_lane_change_equals_its_detour() -> None:
    town = two_lanes(200.0)
    route = Router(town).route((1, 10.0), (0, 190.0))
    assert route is not None
    assert [leg.entry for leg in route.legs] == [LaneEntry.FOLLOW, LaneEntry.CHANGE_LEFT]
    assert route.length == pytest.approx(180.0)
    assert route.cost == pytest.approx(180.0 + CHANGE_COST, abs=1.0)


def test_a_short_lane_change_costs_more_than_a_long_one() -> None:
    town = two_lanes(200.0)
    hurried, calm = (Router(town).route((1, 150.0), (0, goal)) for goal in (168.0, 190.0))
    assert hurried is not None and calm is not None
    assert hurried.cost > calm.cost + 10.0
    assert Router(town).route((1, 150.0), (0, 160.0)) is None
