from __future__ import annotations

import itertools
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.world.car.lanes import LEAD, MIN_SWITCH
from dorothie_gym.world.car.planner import LocalPlanner
from dorothie_gym.world.town import Junction, Lane, LaneLink, LinkType, Town, load_town
from dorothie_gym.world.town.cells import (
    CHANGE_LEAD,
    SHARED,
    SPEEDS,
    U_TURN_LENGTH,
    U_TURN_REST,
    USUAL_SPEED,
    CellGraph,
)
from dorothie_gym.world.town.moves import Moves
from dorothie_gym.world.town.oncoming import oncoming_lanes
from dorothie_gym.world.town.routing import (
    CHANGE_COST,
    CHANGE_LENGTH,
    SHORT_CHANGE,
    TURN_COST,
    Entry,
    Leg,
    Route,
    Router,
    router,
)
from tests.world.driving import network
from tests.world.town.opendrive_text import shared_map

NAMES = ["brookside", "Town02", "Town05"]
Place = tuple[int, float]
Points = list[tuple[float, float]]

SIDE = {Entry.CHANGE_LEFT: LinkType.LANE_CHANGE_LEFT, Entry.CHANGE_RIGHT: LinkType.LANE_CHANGE_RIGHT}


def small_town(
    courses: list[Points],
    links: list[tuple[int, int, LinkType]],
    connectors: dict[int, int] | None = None,
    limits: dict[int, float] | None = None,
) -> Town:
    """A town of lanes along some points; `connectors` tells the junctions of lanes, `limits` speeds [km/h]."""
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
    """A road (0) that goes on beside a turn lane (2) from which alone one turns left; 1 leads straight on.

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
        if two.entry is Entry.FOLLOW:
            assert two.lane in [link.target for link in town.successors(one.lane)]
            assert one.end == pytest.approx(town.lanes[one.lane].length)
            assert two.start == 0.0
        elif two.entry is Entry.U_TURN:
            oncoming = oncoming_lanes(town).at(one.lane, one.end)
            assert oncoming is not None
            assert (oncoming.lane, oncoming.station + U_TURN_REST) == (two.lane, pytest.approx(two.start))
            assert LocalPlanner(town, one.lane, one.end).may_turn_round(0.0)
            driven += U_TURN_LENGTH + U_TURN_REST
        else:
            assert town.neighbour(one.lane, SIDE[two.entry]) == two.lane
            driven += check_change(town, one, two)
    assert route.length == pytest.approx(driven, abs=1.0)


def check_change(town: Town, one: Leg, two: Leg) -> float:
    """A lane change has the room that the planner asks for, on both lanes; tells about how long it is [m]."""
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
        check_clear(town, around, start, [block])
    assert avoided > 5


@settings(max_examples=60, deadline=None, derandomize=True)
@given(data=st.data())
def test_routes_past_many_roadblocks_on_roads_with_several_lanes(data: st.DataObject) -> None:
    town = network("Town05").town
    wide = [lane.id for lane in town.lanes if any(town.neighbour(lane.id, side) is not None for side in SIDE.values())]
    share = st.floats(0.0, 1.0)

    def place(number: int, at: float) -> Place:
        return wide[number], at * town.lanes[wide[number]].length

    places = st.builds(place, st.integers(0, len(wide) - 1), share)
    start, goal = data.draw(places), data.draw(places)
    blocked = data.draw(st.lists(places, max_size=60))
    route = router(town).route(start, goal, blocked)
    if route is None:
        apart = router(town).cell(*start) != router(town).cell(*goal)
        assert not apart or not router(town).reachable(start, blocked)[router(town).cell(*goal)]
        return
    check_drivable(town, route, start, goal)
    check_clear(town, route, start, blocked)


def bellman_ford(moves: Moves, source: int) -> dict[int, float]:
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
    search, graph = Router(town), CellGraph(town)
    for start, goal in pairs(town, 6, seed=3):
        ends = [graph.departures(start, goal, ()), graph.arrivals(goal)]
        cost = bellman_ford(Moves.join([graph.moves, *ends]), graph.start)
        route = search.route(start, goal)
        assert route is not None
        assert route.cost == pytest.approx(cost[graph.goal])


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
        if len(route.legs) > 1 and route.legs[1].entry is Entry.FOLLOW:
            assert route.cost == pytest.approx(distances[search.cell(lane.id, 0.0)])


@pytest.mark.parametrize("seed", range(12))
def test_no_way_along_lanes_is_cheaper_than_the_route(seed: int) -> None:
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


def test_turns_are_the_dearer_the_harder_they_are() -> None:
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


def test_a_lane_change_costs_its_worth_in_detour() -> None:
    town = two_lanes(200.0)
    route = Router(town).route((1, 10.0), (0, 190.0))
    assert route is not None
    assert [leg.entry for leg in route.legs] == [Entry.FOLLOW, Entry.CHANGE_LEFT]
    assert route.length == pytest.approx(180.0)
    assert route.cost == pytest.approx(180.0 + CHANGE_COST, abs=1.0)


def test_a_hurried_lane_change_is_dearer_than_a_calm_one() -> None:
    town = two_lanes(200.0)
    hurried, calm = (Router(town).route((1, 150.0), (0, goal)) for goal in (168.0, 190.0))
    assert hurried is not None and calm is not None
    assert hurried.cost > calm.cost + 10.0
    assert Router(town).route((1, 150.0), (0, 160.0)) is None


@pytest.mark.parametrize(
    ("block", "possible"),
    [
        ((1, 42.0), False),  # on the lane that is left, while the car is still on it
        ((1, 35.0), False),  # the same in the start's own cell
        ((1, 25.0), True),  # behind the car
        ((1, 70.0), True),
        ((0, 42.0), True),  # beside the beginning of a change, which goes past it
        ((0, 70.0), False),  # on the lane that is entered, where every change is on it
        ((0, 20.0), True),
    ],
)
def test_lane_changes_do_not_jump_over_what_blocks_a_lane(block: Place, possible: bool) -> None:
    town = two_lanes(80.0)
    route = Router(town).route((1, 30.0), (0, 76.0), [block])
    assert (route is not None) == possible
    if route is not None:
        check_drivable(town, route, (1, 30.0), (0, 76.0))


def test_a_roadblock_is_driven_round_on_the_lane_beside() -> None:
    town = two_lanes(300.0)
    route = Router(town).route((1, 30.0), (1, 280.0), [(1, 150.0)])
    assert route is not None
    assert [leg.entry for leg in route.legs] == [Entry.FOLLOW, Entry.CHANGE_LEFT, Entry.CHANGE_RIGHT]
    assert route.legs[0].end < 140.0
    assert route.legs[2].start > 160.0
    check_drivable(town, route, (1, 30.0), (1, 280.0))


def test_a_roadblock_ahead_in_the_own_cell_counts_and_one_behind_does_not() -> None:
    town = small_town([[(0, 0), (100, 0)]], [])
    search = Router(town)
    assert search.route((0, 44.0), (0, 90.0), [(0, 47.0)]) is None
    assert search.route((0, 44.0), (0, 90.0), [(0, 41.0)]) is not None
    assert search.route((0, 41.0), (0, 44.0), [(0, 47.0)]) is not None
    assert search.route((0, 41.0), (0, 47.0), [(0, 44.0)]) is None


def test_least_room_for_a_lane_change_is_enough_for_the_planner() -> None:
    assert SHORT_CHANGE >= MIN_SWITCH + LEAD
    assert SHORT_CHANGE - CHANGE_LEAD >= MIN_SWITCH


@pytest.mark.parametrize("pocket", [16.0, 20.0, 28.0, 40.0])
@pytest.mark.parametrize("before", [6.0, 100.0])
def test_a_turn_lane_is_reached_by_a_change_that_the_planner_makes(pocket: float, before: float) -> None:
    town = turn_lane(pocket, before)
    start, goal = (0, 2.0), (6, 50.0)
    route = Router(town).route(start, goal)
    assert route is not None
    assert route.lanes == (0, 1, 2, 4, 6)
    assert [leg.entry for leg in route.legs][2] is Entry.CHANGE_LEFT
    check_drivable(town, route, start, goal)
    change, turn = route.turns(town)
    assert (change.type, turn.type, turn.angle) == (LinkType.LANE_CHANGE_LEFT, LinkType.LEFT, 90)
    planner = LocalPlanner(town, 1, route.legs[1].end - CHANGE_LEAD)
    assert planner.command(PhysicalAction.LANE_SWITCH, change.angle, 0.0) is None
    assert planner.lanes_ahead == [1, 2, 4, 6]


def test_a_turn_lane_too_short_to_change_to_is_not_used() -> None:
    assert Router(turn_lane(15.0)).route((0, 2.0), (6, 50.0)) is None
    assert Router(turn_lane(15.0)).route((0, 2.0), (5, 50.0)) is not None


def test_two_lanes_are_changed_within_a_turn_lane_of_usual_length() -> None:
    # three lanes of 40 m side by side behind a junction: from the rightmost to the turn lane
    town = small_town(
        [[(0, 7), (30, 7)], [(30, 7), (70, 7)], [(30, 3.5), (70, 3.5)], [(30, 0), (70, 0)], [(70, 0), (150, 0)]],
        [
            (0, 1, LinkType.STRAIGHT),
            (3, 4, LinkType.STRAIGHT),
            *beside(2, 1),
            *beside(3, 2),
        ],
    )
    route = Router(town).route((0, 5.0), (4, 40.0))
    assert route is not None
    assert [leg.entry for leg in route.legs] == [
        *(Entry.FOLLOW, Entry.FOLLOW),
        *(Entry.CHANGE_LEFT, Entry.CHANGE_LEFT),
        Entry.FOLLOW,
    ]
    check_drivable(town, route, (0, 5.0), (4, 40.0))


def test_a_lane_that_begins_further_on_is_only_changed_to_where_it_is() -> None:
    town = small_town([[(0, 0), (200, 0)], [(150, -3.5), (200, -3.5)]], beside(1, 0))
    route = Router(town).route((0, 10.0), (1, 45.0))
    assert route is not None
    assert route.legs[0].end >= 144.0
    check_drivable(town, route, (0, 10.0), (1, 45.0))


@pytest.mark.parametrize("name", NAMES)
def test_reachable_cells_are_those_that_have_a_route(name: str) -> None:
    town = network(name).town
    search = router(town)
    start = (town.sites[0].lane, town.sites[0].station)
    blocked = [(site.lane, site.station) for site in town.sites[5:20:3]]
    found = search.reachable(start, blocked)
    for site in town.sites:
        goal = (site.lane, site.station)
        cell = search.cell(*goal)
        if cell != search.cell(*start):
            route = search.route(start, goal, blocked)
            assert route is not None or not found[cell]
            # a cell counts as reached from its start on; a route may also come into the middle of it from the side
            if route is not None and search.cell(route.legs[-1].lane, route.legs[-1].start) != cell:
                assert found[cell]


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


@pytest.mark.parametrize("name", NAMES)
def test_who_does_what_a_route_tells_comes_along_its_lanes(name: str) -> None:
    town = network(name).town
    turned = 0
    for start, goal in pairs(town, 40, seed=5):
        route = router(town).route(start, goal)
        assert route is not None
        told, lanes = list(route.turns(town)), [start[0]]
        for instruction in told:
            # where nothing is told there is but one way on
            while lanes[-1] != instruction.lane:
                (only,) = town.successors(lanes[-1])
                lanes.append(only.target)
            if instruction.entry is Entry.FOLLOW:
                (way,) = [way for way in town.exits(lanes[-1]) if way.angle == instruction.angle]
                assert (way.type, way.junction_id) == (instruction.type, instruction.junction_id)
                assert (way.lane, town.lanes[way.lane].street) == (instruction.onto, instruction.street)
                assert instruction.choice == (len(town.exits(lanes[-1])) > 1)
                lanes.append(way.connector)
                turned += 1
            else:
                assert (instruction.angle, instruction.choice) == (
                    {Entry.CHANGE_LEFT: 90, Entry.CHANGE_RIGHT: -90, Entry.U_TURN: -180}[instruction.entry],
                    True,
                )
                lanes.append(instruction.onto)
        while lanes[-1] != goal[0]:
            (only,) = town.successors(lanes[-1])
            lanes.append(only.target)
        assert tuple(lanes) == route.lanes
        crossed = [step.junction_id for step in told if step.entry is Entry.FOLLOW]
        assert tuple(number for number, _ in itertools.groupby(crossed)) == route.junctions(town)
        distances = [step.distance for step in told]
        assert distances == sorted(distances)
    assert turned > 40


@pytest.mark.slow
def test_routes_are_found_at_once_in_a_large_town() -> None:
    town = load_town(shared_map("Town05"))
    oncoming_lanes(town)

    def shortest(times: int, call: object) -> float:
        assert callable(call)
        taken = []
        for _ in range(times):
            begin = time.process_time()
            call()
            taken.append(time.process_time() - begin)
        return min(taken)

    assert shortest(5, lambda: Router(town)) < 0.4
    search = router(town)
    for start, goal in pairs(town, 20):
        assert shortest(3, lambda start=start, goal=goal: search.route(start, goal)) < 0.015
