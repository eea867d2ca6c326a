"""People on pavements: where they go on, how they pass one another, and when they cross."""

import numpy as np
import pytest

from dorothie_gym.maps import LightColour
from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_pedestrian, add_prop, add_vehicle, populate
from dorothie_gym.sim.state.codes import Footway, Kind, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.traffic.parameters import GOES_HOME
from tests.sim.network.towns import find_town
from tests.sim.state.states import DT

ALONE = dict(vehicles=0, pedestrians=1)


def longest_pavement(arrays):
    pavements = np.where(arrays.walks.kind == Footway.PAVEMENT, arrays.walks.length, 0.0)
    return int(pavements.argmax())


def distances(world):
    there = world.pedestrians[world.pedestrians.state != Walk.EMPTY]
    places = np.column_stack((there.x, there.y))
    apart = np.hypot(*(places[:, None] - places[None]).T)
    return apart[~np.eye(len(places), dtype=bool)]


@pytest.mark.parametrize("name", ["brookside", "millbrook", "midtown", "northgate"])
def test_every_end_of_a_pavement_continues_unless_it_ends_at_a_road(name):
    network = TownNetwork(find_town(name))
    walks, points = town_arrays(network).walks, town_arrays(network).walk_points
    pavements = [k for k in range(len(walks)) if walks.kind[k] == Footway.PAVEMENT]
    ends = {(k, end): points[(walks[k].first, walks[k].last)[end], :2] for k in pavements for end in (0, 1)}
    dead = [end for end in ends if walks[end[0]].next_walk[end[1]] < 0]
    assert len(dead) <= (16 if name == "northgate" else 0)
    for end in dead:
        for other, place in ends.items():
            if other[0] != end[0] and np.hypot(*(place - ends[end])) < 40.0:
                assert leads_over_a_lane(network, ends[end], place)


def leads_over_a_lane(network, start, stop):
    for share in np.linspace(0.0, 1.0, 80):
        place = (1.0 - share) * start + share * stop
        lane = network.get_lane(network.get_closest_lane_index(place))
        if abs(lane.local_coordinates(place)[1]) < lane.width / 2 + 1.0:
            return True
    return False


@pytest.mark.parametrize("name", ["brookside", "midtown", "northgate"])
def test_footways_between_pavements_avoid_lanes_and_join_their_ends(name):
    network = TownNetwork(find_town(name))
    arrays = town_arrays(network)
    corners = np.flatnonzero(arrays.walks.kind == Footway.CORNER)
    assert len(corners) > 10
    for k in corners:
        corner = arrays.walks[k]
        for end in (0, 1):
            after = arrays.walks[corner.next_walk[end]]
            here = arrays.walk_points[(corner.first, corner.last)[end], :2]
            there = arrays.walk_points[(after.first, after.last)[corner.next_end[end]], :2]
            assert after.kind == Footway.PAVEMENT and np.hypot(*(here - there)) < 0.01
        for a, b in zip(range(corner.first, corner.last), range(corner.first + 1, corner.last + 1), strict=True):
            for share in np.linspace(0.0, 1.0, 5):
                place = (1.0 - share) * arrays.walk_points[a, :2] + share * arrays.walk_points[b, :2]
                lane = network.get_lane(network.get_closest_lane_index(place))
                station, lateral = lane.local_coordinates(place)
                assert abs(lateral) > lane.width / 2 + 0.5 or not 0.0 < station < lane.length


def test_pedestrian_walks_round_the_corner_at_the_end_of_a_pavement():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, **ALONE)
    number = next(k for k in range(len(arrays.walks)) if arrays.walks.next_walk[k, 1] >= 0)
    add_pedestrian(arrays, world, number, float(arrays.walks[number].length) - 3.0, pace=1.4)
    walker = world.pedestrians[0]
    walker.direction = 1.0
    been = []
    for _ in range(150):
        step_alone(arrays, world, 5, DT)
        if not been or been[-1] != walker.walk:
            been.append(int(walker.walk))
    assert been[0] == number and arrays.walks.kind[been[1]] == Footway.CORNER
    assert arrays.walks.kind[been[2]] == Footway.PAVEMENT and been[2] != number
    assert walker.odometer == pytest.approx(150 * 5 * DT * 1.4, rel=0.05)


@pytest.mark.parametrize("name", ["brookside", "Town02.xodr"])
def test_pedestrians_do_not_walk_through_each_other(name):
    network = TownNetwork(find_town(name))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=80, seed=4)
    populate(network, arrays, world, seed=4, vehicles=0, pedestrians=80)
    met = 0
    for _ in range(1200):
        step_alone(arrays, world, 3, DT)
        apart = distances(world)
        met += (apart < 1.2).sum()
        assert apart.min() > 0.48
    assert met > 100
    assert world.pedestrians.odometer.min() > 60.0


def test_two_oncoming_pedestrians_pass_each_other():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=2)
    number = longest_pavement(arrays)
    for station in (30.0, 44.0):
        add_pedestrian(arrays, world, number, station, pace=1.3)
    world.pedestrians.direction = (1.0, -1.0)
    step_alone(arrays, world, 300, DT)
    assert world.pedestrians[0].station > 40.0 and world.pedestrians[1].station < 34.0


def test_the_faster_one_overtakes_the_slower_one():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=2)
    number = longest_pavement(arrays)
    for station, pace in ((30.0, 1.6), (34.0, 0.9)):
        add_pedestrian(arrays, world, number, station, pace=pace)
    world.pedestrians.direction = 1.0
    step_alone(arrays, world, 450, DT)
    assert world.pedestrians[0].station > world.pedestrians[1].station


def test_pedestrians_walk_round_a_prop():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, **ALONE)
    number = longest_pavement(arrays)
    add_pedestrian(arrays, world, number, 30.0, pace=1.3)
    world.pedestrians[0].direction = 1.0
    add_prop(network, arrays, world, PropKind.CONSTRUCTION_CONE, 0, 40.0)
    ahead = empty_world(arrays, **ALONE)
    add_pedestrian(arrays, ahead, number, 34.0, pace=1.3)
    world.props[0].x, world.props[0].y = ahead.pedestrians[0].x, ahead.pedestrians[0].y
    for _ in range(60):
        step_alone(arrays, world, 5, DT)
        walker, prop = world.pedestrians[0], world.props[0]
        assert np.hypot(walker.x - prop.x, walker.y - prop.y) > 0.25 + 0.5 * prop.width
    assert walker.station > 38.0


def at_a_crosswalk(arrays, lights):
    number = next(k for k in range(len(arrays.crossings)) if (arrays.crossings[k].lights > 0) == lights)
    crossing = arrays.crossings[number]
    world = empty_world(arrays, vehicles=2, pedestrians=1)
    add_pedestrian(arrays, world, int(crossing.walk[0]), float(crossing.station[0]), pace=1.3)
    walker = world.pedestrians[0]
    walker.state, walker.crossing, walker.direction, walker.mouth = Walk.WAITING, number, 1.0, 0
    return world, crossing


def test_pedestrians_cross_while_the_lights_of_vehicles_are_red():
    town = find_town("midtown")
    arrays = town_arrays(TownNetwork(town))
    crossed = 0
    for start in range(0, 90, 15):
        world, crossing = at_a_crosswalk(arrays, lights=True)
        number = int(world.pedestrians[0].crossing)
        world.clock[0].frame, world.clock[0].time = round(start / DT), float(start)
        lanes = arrays.neighbours[crossing.light : crossing.light + crossing.lights]
        for _ in range(300):
            step_alone(arrays, world, 5, DT)
            if world.pedestrians[0].state == Walk.CROSSING and world.pedestrians[0].crossing == number:
                crossed += 1
                assert {town.light(int(lane), float(world.clock[0].time)) for lane in lanes} == {LightColour.RED}
    assert crossed > 100


def test_pedestrians_walk_on_after_a_long_wait_at_a_crosswalk():
    arrays = town_arrays(TownNetwork(find_town("brookside")))
    world, crossing = at_a_crosswalk(arrays, lights=False)
    add_vehicle(arrays, world, 0, 20.0, desired=8.0)
    car = world.vehicles[0]
    car.crashed = True  # it stands on the crosswalk
    seen = set()
    for _ in range(1290):
        car.x, car.y = (crossing.x[0] + crossing.x[1]) / 2, (crossing.y[0] + crossing.y[1]) / 2
        car.speed, car.crash_age = 0.0, 0.0
        step_alone(arrays, world, 1, DT)
        seen.add(int(world.pedestrians[0].state))
    assert seen == {Walk.WAITING, Walk.WALKING}


def test_stuck_pedestrian_respawns_elsewhere():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, **ALONE)
    add_pedestrian(arrays, world, longest_pavement(arrays), 30.0, pace=0.0)
    walker = world.pedestrians[0]
    key, x, y = int(walker.key), float(walker.x), float(walker.y)
    step_alone(arrays, world, round((GOES_HOME - 1.0) / DT), DT)
    assert walker.key == key and np.hypot(walker.x - x, walker.y - y) < 0.1
    step_alone(arrays, world, round(2.0 / DT), DT)
    assert walker.key != key and np.hypot(walker.x - x, walker.y - y) > 3.0
    assert arrays.walks.kind[walker.walk] == Footway.PAVEMENT


def test_touched_pedestrian_respawns_after_three_seconds_out_of_sight():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=1, pedestrians=1)
    add_vehicle(arrays, world, 0, 20.0, kind=Kind.EGO, desired=8.0)
    add_pedestrian(arrays, world, longest_pavement(arrays), 30.0, pace=1.3)
    walker, car = world.pedestrians[0], world.vehicles[0]
    walker.x, walker.y = car.x + 1.0, car.y
    step_alone(arrays, world, 80, DT)
    assert walker.crashed and abs(walker.x - car.x - 1.0) < 0.1 and world.clock[0].run_over == 1
    step_alone(arrays, world, 15, DT)
    assert not walker.crashed and np.hypot(walker.x - car.x, walker.y - car.y) > 58.0
