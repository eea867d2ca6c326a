from __future__ import annotations

import itertools
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.maps import LinkType, load_town
from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.maps.routing import SHORT_CHANGE, LaneEntry, Router, router
from dorothie_gym.maps.routing_graph import CHANGE_LEAD
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.ego.limits import LEAD, MIN_SWITCH
from tests.maps.opendrive_text import shared_map
from tests.maps.routes import (
    NAMES,
    SIDE,
    Place,
    beside,
    check_clear,
    check_drivable,
    pairs,
    small_town,
    turn_lane,
    two_lanes,
)
from tests.sim.driving import network, planner_on


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


def test_routes_pass_a_roadblock_on_the_lane_beside() -> None:
    town = two_lanes(300.0)
    route = Router(town).route((1, 30.0), (1, 280.0), [(1, 150.0)])
    assert route is not None
    assert [leg.entry for leg in route.legs] == [LaneEntry.FOLLOW, LaneEntry.CHANGE_LEFT, LaneEntry.CHANGE_RIGHT]
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
    assert [leg.entry for leg in route.legs][2] is LaneEntry.CHANGE_LEFT
    check_drivable(town, route, start, goal)
    change, turn = route.turns(town)
    assert (change.type, turn.type, turn.angle) == (LinkType.LANE_CHANGE_LEFT, LinkType.LEFT, 90)
    planner = planner_on(town, 1, route.legs[1].end - CHANGE_LEAD)
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
        *(LaneEntry.FOLLOW, LaneEntry.FOLLOW),
        *(LaneEntry.CHANGE_LEFT, LaneEntry.CHANGE_LEFT),
        LaneEntry.FOLLOW,
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
def test_goal_just_behind_the_start_needs_a_detour(name: str) -> None:
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


@pytest.mark.parametrize("lane", [-1, 2, 10**6])
def test_lane_that_the_town_does_not_have_is_refused(lane: int) -> None:
    search = Router(two_lanes(80.0))
    for call in (
        lambda: search.route((lane, 5.0), (0, 70.0)),
        lambda: search.route((0, 5.0), (lane, 70.0)),
        lambda: search.route((0, 5.0), (1, 70.0), [(lane, 40.0)]),
        lambda: search.distances_to((lane, 5.0)),
        lambda: search.reachable((lane, 5.0)),
    ):
        with pytest.raises(IndexError, match=f"the town has no lane {lane}; its lanes are 0 to 1"):
            call()


def test_crossed_junctions_are_listed_in_order() -> None:
    town = network("brookside").town
    start, goal = pairs(town, 9)[8]
    route = router(town).route(start, goal)
    assert route is not None
    ids = {junction.id for junction in town.junctions}
    assert set(route.junctions(town)) <= ids


@pytest.mark.parametrize("name", NAMES)
def test_following_the_instructions_of_a_route_leads_along_its_lanes(name: str) -> None:
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
            if instruction.entry is LaneEntry.FOLLOW:
                (way,) = [way for way in town.exits(lanes[-1]) if way.angle == instruction.angle]
                assert (way.type, way.junction_id) == (instruction.type, instruction.junction_id)
                assert (way.lane, town.lanes[way.lane].street) == (instruction.onto, instruction.street)
                assert instruction.choice == (len(town.exits(lanes[-1])) > 1)
                lanes.append(way.connector)
                turned += 1
            else:
                assert (instruction.angle, instruction.choice) == (
                    {LaneEntry.CHANGE_LEFT: 90, LaneEntry.CHANGE_RIGHT: -90, LaneEntry.U_TURN: -180}[instruction.entry],
                    True,
                )
                lanes.append(instruction.onto)
        while lanes[-1] != goal[0]:
            (only,) = town.successors(lanes[-1])
            lanes.append(only.target)
        assert tuple(lanes) == route.lanes
        crossed = [step.junction_id for step in told if step.entry is LaneEntry.FOLLOW]
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
