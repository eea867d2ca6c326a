from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.maps import LinkType, town_names
from dorothie_gym.ontology import ObjectClass, PhysicalAction, PropKind
from tests.sim.driving import drive, long_lane, network, off_centre, on_lane

LEFT, RIGHT = LinkType.LANE_CHANGE_LEFT, LinkType.LANE_CHANGE_RIGHT
EVERY = [
    *(pytest.param(name, marks=[pytest.mark.slow] * (name in ("midtown", "northgate"))) for name in town_names()),
    "Town01",
    "Town02",
    pytest.param("Town05", marks=pytest.mark.slow),
]


@pytest.mark.parametrize("name", EVERY)
def test_jturn_with_the_angle_of_an_exit_ends_in_its_lane(name: str) -> None:
    roads = network(name)
    town, tried, failed, worst = roads.town, 0, [], 0.0
    for lane in town.lanes:
        if lane.in_junction:
            continue
        for way in town.exits(lane.id):
            world = on_lane(roads, lane.id, max(0.0, lane.length - 45.0))
            car, ego = world.car, world.ego
            assert ego.planner.command(PhysicalAction.J_TURN, way.angle, 0.0) is None
            far = min(12.0, town.lanes[way.lane].length / 2)
            planner = ego.planner
            trip = drive(world, lambda p=planner, w=way, f=far: p.lane == w.lane and p.station > f)
            tried += 1
            worst = max(worst, trip.worst)
            if not trip.arrived or off_centre(town, way.lane, car) > 0.5:
                failed.append((lane.id, way.angle))
    assert tried > 50
    assert len(failed) <= 0.005 * tried, failed
    assert worst < 0.5


@pytest.mark.parametrize("name", EVERY)
def test_u_turn_where_legal_ends_in_the_oncoming_lane(name: str) -> None:
    roads = network(name)
    tried, failed = 0, []
    for lane in roads.town.lanes:
        if lane.in_junction or lane.length < 20.0:
            continue
        for station in np.linspace(2.0, lane.length - 2.0, 3):
            world = on_lane(roads, lane.id, float(station))
            car, ego = world.car, world.ego
            if not ego.planner.may_turn_round(0.0):
                assert ego.planner.command(PhysicalAction.U_TURN, 0, 0.0) is not None
                continue
            assert ego.planner.command(PhysicalAction.U_TURN, 0, 0.0) is None
            planner = ego.planner
            trip = drive(world, lambda p=planner: p.manoeuvre[0] is None and not p.in_manoeuvre, 40.0)
            before = lane.heading_at(float(station))
            turned = abs(np.angle(np.exp(1j * (float(car.heading) - before))))
            tried += 1
            if not trip.arrived or off_centre(roads.town, planner.lane, car) > 0.5 or trip.worst > 0.5 or turned < 2.0:
                failed.append((lane.id, float(station)))
    assert tried > 40
    assert len(failed) <= 0.005 * tried, failed


@pytest.mark.parametrize("step", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_lane_switch_ends_in_the_lane_beside(step: int) -> None:
    roads = network("Town05")
    cases = [
        (lane, side, beside)
        for lane in roads.town.lanes
        for side in (LEFT, RIGHT)
        if not lane.in_junction and (beside := roads.town.neighbour(lane.id, side)) is not None
    ]
    for lane, side, beside in cases[::step]:
        world = on_lane(roads, lane.id, 0.0)
        car, ego = world.car, world.ego
        planner = ego.planner
        accepted = planner.may_switch(side)
        reason = planner.command(PhysicalAction.LANE_SWITCH, 90 if side is LEFT else -90, 0.0)
        assert (reason is None) == accepted
        if not accepted:
            assert reason == f"there is no room left to switch to the {'left' if side is LEFT else 'right'}"
            continue
        trip = drive(world, lambda p=planner: p.manoeuvre[0] is None and not p.in_manoeuvre, 25.0)
        assert trip.arrived, lane.id
        assert off_centre(roads.town, beside, car) < 0.5
        assert trip.worst < 0.3


def choice_lane(name: str = "brookside") -> int:
    town = network(name).town
    return next(
        lane.id for lane in town.lanes if lane.length > 60.0 and not lane.in_junction and len(town.exits(lane.id)) > 1
    )


def test_car_waits_at_the_end_of_its_lane_without_an_instruction_and_turns_with_one() -> None:
    roads = network("brookside")
    lane = roads.town.lanes[choice_lane()]
    world = on_lane(roads, lane.id, lane.length - 50.0)
    car, ego = world.car, world.ego
    drive(world, lambda: False, 20.0)
    nose = ego.planner.station + car.LENGTH / 2
    assert car.speed == 0.0
    assert ego.planner.waits_at_end
    assert ego.planner.lane == lane.id
    assert 0.0 < lane.length - nose < 2.0
    for way in roads.town.exits(lane.id)[:1]:
        assert ego.planner.command(PhysicalAction.J_TURN, way.angle, 0.0) is None
        assert drive(world, lambda w=way: ego.planner.lane == w.lane, 20.0).arrived


def test_stop_and_start() -> None:
    roads = network("brookside")
    world = on_lane(roads, long_lane(roads.town), 2.0)
    car, ego = world.car, world.ego
    planner = ego.planner
    assert planner.command(PhysicalAction.START, 0, 0.0) == "the car is not stopped"
    drive(world, lambda: car.speed > 8.0)
    before = planner.station
    assert planner.command(PhysicalAction.STOP, 0, float(car.speed)) is None
    assert planner.command(PhysicalAction.STOP, 0, float(car.speed)) == "the car is stopped already"
    assert drive(world, lambda: car.speed == 0.0, 8.0).arrived
    assert planner.station - before < 8.0**2 / (2 * 3.0) + 8.0
    drive(world, lambda: False, 3.0)
    assert car.speed == 0.0
    assert planner.command(PhysicalAction.START, 0, 0.0) is None
    assert drive(world, lambda: car.speed > 3.0, 5.0).arrived


def test_any_manoeuvre_restarts_a_stopped_car() -> None:
    roads = network("brookside")
    ego = on_lane(roads, choice_lane(), 2.0).ego
    planner = ego.planner
    for action in (PhysicalAction.LANE_FOLLOW, PhysicalAction.J_TURN, PhysicalAction.U_TURN):
        planner.command(PhysicalAction.STOP, 0, 0.0)
        assert planner.command(action, 0, 0.0) is None
        assert not planner.held


@pytest.mark.parametrize("action", [PhysicalAction.SPEED_CHANGE, PhysicalAction.LIGHT_CHANGE])
def test_other_actions_than_navigation_are_refused(action: PhysicalAction) -> None:
    roads = network("brookside")
    ego = on_lane(roads, choice_lane(), 2.0).ego
    assert ego.planner.command(action, 0, 0.0) == f"{action.label} is no navigation action"


def test_plan_is_fixed_once_the_car_cannot_stop_before_the_junction() -> None:
    roads = network("brookside")
    town, lane = roads.town, roads.town.lanes[choice_lane()]
    first, second = town.exits(lane.id)[:2]
    for room, late in ((25.0, False), (6.0, True)):
        ego = on_lane(roads, lane.id, lane.length - room).ego
        planner = ego.planner
        assert planner.command(PhysicalAction.J_TURN, first.angle, 8.0) is None
        assert planner.feasible(8.0).j_turn is not late
        assert (planner.command(PhysicalAction.J_TURN, second.angle, 8.0) is not None) == late
        assert (planner.command(PhysicalAction.LANE_FOLLOW, 0, 8.0) is not None) == late


def test_u_turn_is_refused_while_the_car_is_too_fast_before_a_roadblock() -> None:
    roads = network("brookside")
    world = on_lane(roads, long_lane(roads.town), 30.0)
    planner = world.planner
    world.actors.arrays.car[0].roadblock = 15.0
    assert planner.command(PhysicalAction.U_TURN, 0, 6.0) == "the car is too fast to turn round before the roadblock"
    assert planner.command(PhysicalAction.U_TURN, 0, 0.0) is None


def test_turn_changes_lanes_before_the_junction_only_where_another_lane_fits_much_better() -> None:
    roads = network("Town05")
    town, changed = roads.town, 0
    for lane in town.lanes[:200]:
        beside = town.neighbour(lane.id, LEFT)
        exits = town.exits(lane.id)
        if beside is None or lane.in_junction or lane.length < 60.0 or len(exits) < 2:
            continue
        for way in town.exits(beside):
            if min(abs((way.angle - own.angle + 180) % 360 - 180) for own in exits) < 30 or len(town.exits(beside)) < 2:
                continue
            ego = on_lane(roads, lane.id, 2.0).ego
            assert ego.planner.command(PhysicalAction.J_TURN, way.angle, 0.0) is None
            assert ego.planner.lanes_ahead[1] == beside
            changed += 1
    if not changed:
        pytest.skip("no lane of this map has another one beside it that leads elsewhere")


def test_no_lane_is_changed_for_a_turn_while_a_prop_stands_on_the_new_lane() -> None:
    roads = network("northgate")
    town = roads.town
    lane, beside, angle = next(
        (lane.id, beside, way.angle)
        for lane in town.lanes
        for beside in (town.neighbour(lane.id, side) for side in (LEFT, RIGHT))
        if beside is not None and not lane.in_junction and lane.length > 60.0 and len(town.exits(lane.id)) > 1
        for way in town.exits(beside)
        if min(abs((way.angle - own.angle + 180) % 360 - 180) for own in town.exits(lane.id)) > 60
    )
    world = on_lane(roads, lane, 2.0)
    assert world.planner.command(PhysicalAction.J_TURN, angle, 0.0) is None
    path = world.planner.path
    first, last = np.flatnonzero(path.manoeuvre)[[0, -1]]
    assert path.lanes[first] == beside
    prop = world.actors.add_prop(PropKind.STREET_BARRIER, beside, float(path.stations[last]) + 12.0)
    drive(world, lambda: False, 15.0)
    assert off_centre(town, lane, world.car) < 0.3 and world.car.speed == 0.0
    assert world.hazard is not None and world.hazard.kind is ObjectClass.STATIC
    world.actors.remove_prop(prop)
    assert drive(world, lambda: off_centre(town, beside, world.car) < 0.3, 30.0).arrived


@pytest.mark.parametrize("name", ["brookside", "midtown"])
@pytest.mark.parametrize("begun", [2.0, 6.0, 12.0])
def test_a_turn_that_is_asked_for_during_a_u_turn_does_not_disturb_it(name: str, begun: float) -> None:
    roads = network(name)
    town, tried = roads.town, 0
    for lane in town.lanes:
        if lane.in_junction or lane.length < 60.0 or tried == 12:
            continue
        world = on_lane(roads, lane.id, 30.0)
        car, ego = world.car, world.ego
        planner = ego.planner
        if planner.command(PhysicalAction.U_TURN, 0, 0.0) is not None:
            continue
        assert drive(world, lambda p=planner: p.in_manoeuvre and p.s > begun).arrived
        ways = town.exits(planner.lane)
        if len(ways) < 2 or planner.command(PhysicalAction.J_TURN, ways[0].angle, float(car.speed)) is not None:
            continue
        trip = drive(world, lambda p=planner, w=ways[0]: p.lane == w.lane, 60.0)
        assert trip.arrived and trip.worst < 0.3, (lane.id, trip.worst)
        tried += 1
    assert tried > 5


def test_a_turn_that_is_asked_for_during_a_lane_switch_does_not_disturb_it() -> None:
    roads = network("midtown")
    town, tried = roads.town, 0
    for lane in town.lanes:
        beside = town.neighbour(lane.id, LEFT)
        if beside is None or town.predecessors(beside):
            continue  # not beside a turn lane
        world = on_lane(roads, lane.id, 0.0)
        car, ego = world.car, world.ego
        planner = ego.planner
        assert planner.command(PhysicalAction.LANE_SWITCH, 90, 10.0) is None
        assert drive(world, lambda p=planner: p.in_manoeuvre and p.s > 8.0).arrived
        planner.command(PhysicalAction.J_TURN, 0, float(car.speed))
        trip = drive(world, lambda p=planner: town.lanes[p.lane].in_junction, 60.0)
        assert trip.worst < 0.3, (lane.id, trip.worst)
        tried += 1
    assert tried > 5
