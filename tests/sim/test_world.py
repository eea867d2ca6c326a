from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from dorothie_gym.maps import LinkType
from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.ontology import ObjectClass, PhysicalAction, PropKind, Sensor, WeatherParameter
from dorothie_gym.sim.bodies import Pedestrian
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.population import free_places
from dorothie_gym.sim.state.codes import Footway, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.traffic_rules import WorldEventKind
from dorothie_gym.sim.world import World
from tests.sim.driving import PROPS, long_lane, network, run, world_at
from tests.sim.forcing import park


def stops_before_a_prop(world: World, station: float, kind: PropKind) -> list[WorldEventKind]:
    world.actors.add_prop(kind, world.planner.lane, station)
    events = run(world, 60.0, lambda: world.car.speed < 0.05 and world.time > 3.0)
    assert world.collisions == 0
    return [event.kind for event in events]


@pytest.mark.parametrize("trouble", ["none", "fog", "blind"])
@pytest.mark.parametrize("kind", PROPS)
def test_car_stops_behind_roadblock_and_can_turn_round(kind: PropKind, trouble: str) -> None:
    town = network("brookside").town
    world = world_at("brookside", long_lane(town), 2.0)
    if trouble == "fog":
        for parameter in (WeatherParameter.FOG_DENSITY, WeatherParameter.WETNESS):
            world.weather.set_share(parameter, 1.0)
    if trouble == "blind":
        world.set_fault(Sensor.VIEW, True)
    lane = world.planner.lane
    stops_before_a_prop(world, 60.0, kind)
    assert 9.0 < 60.0 - kind.length / 2 - world.planner.station - world.car.LENGTH / 2 < 14.0
    assert world.planner.command(PhysicalAction.U_TURN, 0, 0.0) is None
    run(world, 30.0, lambda: world.planner.manoeuvre[0] is None)
    assert world.planner.manoeuvre[0] is None
    assert world.planner.lane != lane
    assert world.collisions == 0


def test_car_switches_lanes_round_a_roadblock() -> None:
    town = network("Town05").town
    lane = next(
        lane.id
        for lane in town.lanes
        if lane.length > 110.0 and not lane.in_junction and town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT)
    )
    world = world_at("Town05", lane, 2.0)
    stops_before_a_prop(world, 70.0, PropKind.STREET_BARRIER)
    assert world.planner.command(PhysicalAction.LANE_SWITCH, 90, 0.0) is None
    run(world, 30.0, lambda: world.planner.manoeuvre[0] is None)
    assert world.planner.lane == town.neighbour(lane, LinkType.LANE_CHANGE_LEFT)
    assert world.collisions == 0


@pytest.mark.parametrize(
    ("beyond", "refused"), [(-20.0, False), (-12.0, True), (11.5, True), (21.0, True), (30.0, False)]
)
def test_car_makes_a_u_turn_only_where_it_can_leave_before_the_next_roadblock(beyond: float, refused: bool) -> None:
    town = network("brookside").town
    lane, opposite = next(
        (lane.id, oncoming)
        for lane in town.lanes
        if lane.length > 90.0 and (oncoming := oncoming_lanes(town).at(lane.id, 45.0)) is not None
    )
    world = world_at("brookside", lane, 45.0)
    world.actors.add_prop(PropKind.STREET_BARRIER, opposite.lane, opposite.station + beyond)
    world.step(1)
    reason = world.planner.command(PhysicalAction.U_TURN, 0, 0.0)
    assert reason == ("a roadblock is too close on the oncoming lane" if refused else None)


@pytest.mark.parametrize("speed", [0.0, 3.0, 8.0])
@pytest.mark.parametrize("ahead", [0.0, 12.0, 20.0, 30.0, 45.0, 60.0])
def test_car_that_switched_lanes_before_a_roadblock_can_switch_back(ahead: float, speed: float) -> None:
    town = network("midtown").town
    right, left = next(
        (lane.id, beside)
        for lane in town.lanes
        if lane.length > 100.0 and (beside := town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT)) is not None
    )
    world = world_at("midtown", right, 20.0)
    station = town.lanes[left].project(town.lanes[right].position(20.0))[0]
    world.actors.add_prop(PropKind.STREET_BARRIER, left, station + ahead)
    world.step(1)
    world.car.speed = speed
    reason = world.planner.command(PhysicalAction.LANE_SWITCH, 90, speed)
    assert reason in (None, "a roadblock is too close on the lane to the left")
    if ahead <= 12.0:
        assert reason is not None
    if ahead == 60.0:
        assert reason is None
    if reason is None:
        run(world, 15.0)
        assert world.planner.lane == left and world.car.speed < 0.05
        assert world.planner.command(PhysicalAction.LANE_SWITCH, -90, 0.0) is None
        run(world, 15.0)
        assert world.planner.lane != left
        assert world.collisions == 0


def test_hazard_stop_and_its_end_are_each_reported_once_with_their_reason() -> None:
    town = network("brookside").town
    world = world_at("brookside", long_lane(town), 2.0)
    prop = world.actors.add_prop(PropKind.DUMPSTER, world.planner.lane, 60.0)
    events = run(world, 20.0)
    assert [event.kind for event in events] == [WorldEventKind.HAZARD_STOP]
    assert events[0].data["reason"] == ObjectClass.STATIC.label
    assert type(events[0].data["distance"]) is float
    world.actors.remove_prop(prop)
    events = run(world, 5.0)
    assert [event.kind for event in events] == [WorldEventKind.HAZARD_END]
    assert events[0].data["reason"] == ObjectClass.STATIC.label
    assert events[0].data["seconds"] > 5.0


def test_car_stops_behind_a_standing_vehicle() -> None:
    town = network("brookside").town
    world = world_at("brookside", long_lane(town), 2.0)
    vehicle = park(world, 70.0)
    run(world, 14.0)
    assert world.car.speed < 0.05
    assert world.collisions == 0
    assert 1.5 < math.hypot(*(vehicle.position - world.car.position)) - 5.0 < 5.0


def across(world: World, walker: Pedestrian) -> float:
    """Returns the distance from a pedestrian's kerb to the opposite one [m]."""
    return float(town_arrays(world.network).walk_points[walker.record.segment, 5])


def step_out(world: World, walker: Pedestrian) -> None:
    """Makes a pedestrian beside a street cross it at once, whatever is coming."""
    record = walker.record
    record.state, record.far = Walk.STRAYING, across(world, walker)
    assert record.far > 6.0


def test_car_stops_for_a_crossing_pedestrian() -> None:
    town = network("brookside").town
    world = world_at("brookside", long_lane(town), 2.0)
    assert world.actors.add_pedestrian(world.planner.lane, 45.0)
    (walker,) = world.actors.pedestrians
    walker.record.pace = 0.01  # stays there until the car comes
    slowest, events = 40.0, []
    for _ in range(40):
        events += world.step(15)
        if walker.record.pace < 1.0 and world.planner.station > 26.0:
            walker.record.pace = 1.3
            step_out(world, walker)  # 19 m before the car
        if walker.state is Walk.STRAYING:
            slowest = min(slowest, float(world.car.speed))
    assert slowest < 3.0
    assert walker.state is Walk.WALKING and not walker.crashed
    assert world.collisions == 0
    assert not any(event.kind is WorldEventKind.COLLISION for event in events)


def beside_lanes(world: World, count: int) -> None:
    """People as the Ad-Wizard brings them: beside the lanes, and they cross anywhere."""
    for lane, station in free_places(world.town, np.random.default_rng(1), 20 * count):
        if len(world.actors.pedestrians) < count:
            world.actors.add_pedestrian(lane, station)
    assert len(world.actors.pedestrians) == count


def test_pedestrians_walk_on_no_lane() -> None:
    for name in ("brookside", "Town05"):
        roads = network(name)
        site = roads.town.sites[0]
        world = world_at(name, site.lane, site.station, WorldConfig(vehicles=0, pedestrians=0))
        beside_lanes(world, 12)
        for _ in range(60):
            world.step(15)
            for walker in world.actors.pedestrians:
                if walker.state is Walk.STRAYING:
                    continue  # crossing
                lane = roads.get_lane(roads.get_closest_lane_index(walker.position, height=walker.height))
                station, lateral = lane.local_coordinates(walker.position)
                assert abs(lateral) > lane.width_at(station) / 2
        assert min(walker.odometer for walker in world.actors.pedestrians) > 20.0


def ego_beside_a_pedestrian(behind: float) -> tuple[World, Pedestrian]:
    """Returns a world with the ego stopped, and a pedestrian `behind` its nose [m] that crosses the road now."""
    world = world_at("brookside", long_lane(network("brookside").town), 40.0)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    lane = world.town.lanes[world.planner.lane]
    assert world.actors.add_pedestrian(lane.id, 60.0)
    (walker,) = world.actors.pedestrians
    station = lane.project(walker.position)[0] + behind - world.car.LENGTH / 2
    world.car.position, world.car.heading = lane.position(station), lane.heading_at(station)
    step_out(world, walker)
    return world, walker


@pytest.mark.parametrize("behind", [-1.0, 1.0, 3.0])
def test_pedestrian_does_not_walk_into_a_car(behind: float) -> None:
    world, walker = ego_beside_a_pedestrian(behind)
    lane = world.town.lanes[world.planner.lane]
    kerb = nearest = float(lane.project(walker.position)[1])
    for _ in range(40):
        world.step(15)
        nearest = min(nearest, float(lane.project(walker.position)[1]))
        assert not walker.crashed
        assert not world.car.crashed
        if walker.state is Walk.WALKING:
            break
    if behind > 0.0:
        assert 1.0 < nearest < 2.3 < kerb  # it came up to the car, and went back
        assert lane.project(walker.position)[1] == pytest.approx(kerb, abs=0.5)
    else:
        assert nearest < -lane.width_at(60.0)  # before the car the way is free


@pytest.mark.parametrize("name", ["brookside", "Town05"])
def test_straying_pedestrian_reaches_the_far_kerb(name: str) -> None:
    roads = network(name)
    town = town_arrays(roads)
    crossings = 0
    for way in town.walks[town.walks.kind == Footway.STREET]:
        points = town.walk_points[way.first : way.last + 1]
        for here, there in itertools.pairwise(points):
            far = min(here[5], there[5])
            if far <= 0.0:
                continue
            middle, along = (here + there) / 2, (there - here)[:2]
            left = np.array((along[1], -along[0])) / np.hypot(*along)
            place = middle[:2] + far * left
            lane = roads.get_lane(roads.get_closest_lane_index(place, height=middle[4]))
            station, lateral = lane.local_coordinates(place)
            assert abs(lateral) > lane.width_at(station) / 2, f"{place} is on lane {lane.town_lane.id}"
            crossings += 1
    assert crossings > 100


def test_pedestrian_close_to_a_car_steps_away_from_it() -> None:
    world, walker = ego_beside_a_pedestrian(-0.6)
    lane = world.town.lanes[world.planner.lane]
    station = lane.project(walker.position)[0]
    walker.position = lane.position(station)  # 0.35 m before the car's nose
    for _ in range(16):
        world.step(15)
        assert not walker.crashed
        if walker.state is Walk.WALKING:
            break
    assert walker.state is Walk.WALKING  # on either side
    assert abs(lane.project(walker.position)[1]) > lane.width_at(station) / 2


@pytest.mark.parametrize("frames", [1, 15, 300])
def test_path_never_ends_at_any_decision_interval(frames: int) -> None:
    town = network("Town05").town
    site = town.sites[0]
    world = world_at("Town05", site.lane, site.station, WorldConfig(vehicles=0, pedestrians=0, cruise_speed=90.0))
    for _ in range(900 // frames):
        world.step(frames)
        assert world.planner.room > 0.0
        assert abs(world.planner.offset) < 0.6


def test_car_without_sight_drives_at_walking_pace_until_the_fault_ends() -> None:
    town = network("brookside").town
    world = world_at("brookside", long_lane(town), 2.0)
    assert world.set_fault(Sensor.VIEW, True) is None
    assert world.set_fault(Sensor.VIEW, True) == "the fault of view is on already"
    run(world, 5.0)
    assert world.car.speed < 2.0
    run(world, 24.5)
    assert Sensor.VIEW in world.faults
    run(world, 1.0)
    assert not world.faults


def test_same_seed_same_world_another_seed_another() -> None:
    site = network("brookside").town.sites[3]
    config = WorldConfig(vehicles=6, pedestrians=4)
    frames = []
    for seed in (5, 5, 6):
        world = world_at("brookside", site.lane, site.station, config, seed)
        run(world, 20.0)
        frames.append(np.array([*[v.position for v in world.actors.vehicles], *world.frames[:, 1:3]]))
    np.testing.assert_array_equal(frames[0], frames[1])
    assert frames[0].shape != frames[2].shape or not np.array_equal(frames[0], frames[2])


def drive_at_random(name: str, seed: int, seconds: float) -> World:
    """Turns, U-turns and lane switches at random among ten vehicles and four pedestrians."""
    town = network(name).town
    rng = np.random.default_rng(seed)
    site = town.sites[int(rng.integers(len(town.sites)))]
    world = world_at(name, site.lane, site.station, WorldConfig(), seed)
    planner = world.planner
    for _ in range(round(2 * seconds)):
        speed = float(world.car.speed)
        exits, distance = planner.exits()
        if exits and planner.manoeuvre[0] is None and distance < 60.0:
            planner.command(PhysicalAction.J_TURN, exits[int(rng.integers(len(exits)))].angle, speed)
        elif rng.random() < 0.03:
            planner.command(PhysicalAction.U_TURN, 0, speed)
        elif rng.random() < 0.03:
            planner.command(PhysicalAction.LANE_SWITCH, 90 if rng.random() < 0.5 else -90, speed)
        world.step(15)
        assert np.isfinite(world.frames).all()
        assert all(np.isfinite(vehicle.position).all() for vehicle in world.actors.vehicles)
    return world


@pytest.mark.parametrize("name", ["brookside", "Town02", "Town05"])
def test_random_driving_causes_no_collision_by_the_egos_fault(name: str) -> None:
    assert drive_at_random(name, 1, 60.0).collisions == 0


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("name", ["brookside", "Town02", "Town05"])
def test_long_random_driving_causes_no_collision_by_the_egos_fault(name: str, seed: int) -> None:
    assert drive_at_random(name, seed, 300.0).collisions == 0
