"""Vehicles and pedestrians beyond highway-env's: bends, cyclists, props, crosswalks."""

import numpy as np
import pytest

from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_pedestrian, add_prop, add_vehicle, populate, remove_prop
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.traffic.parameters import CURVE_ACCELERATION
from tests.sim.network.towns import curve_town, find_town, straight_town
from tests.sim.state.states import DT, Pose, kernel_world


def test_vehicle_takes_a_bend_no_faster_than_comfort_allows():
    arrays, world = kernel_world(TownNetwork(curve_town()), [Pose(0, 5.0, speed=5.0, desired=14.0)])
    fastest = 0.0
    for _ in range(120):
        step_alone(arrays, world, 1, DT)
        fastest = max(fastest, float(world.vehicles[0].speed))
    assert fastest == pytest.approx(np.sqrt(CURVE_ACCELERATION * 30.0), rel=0.05)


def test_car_stays_behind_a_cyclist_on_a_single_lane():
    network = TownNetwork(straight_town(lanes=1, roads=5))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=2, pedestrians=0)
    add_vehicle(arrays, world, 0, 60.0, kind=Kind.CYCLIST, desired=4.5)
    add_vehicle(arrays, world, 0, 30.0, desired=12.0)
    for _ in range(60):
        step_alone(arrays, world, 15, DT)
        assert world.vehicles[1].x < world.vehicles[0].x - 4.0
    assert not world.vehicles.crashed.any()


def test_traffic_stops_before_a_prop_on_a_single_lane_until_it_is_gone():
    network = TownNetwork(straight_town(lanes=1))
    arrays, world = kernel_world(network, [Pose(0, 20.0, speed=8.0)])
    prop = add_prop(network, arrays, world, PropKind.STREET_BARRIER, 1, 20.0)
    step_alone(arrays, world, 600, DT)
    assert world.vehicles[0].speed < 0.1 and 105.0 < world.vehicles[0].x < 117.0
    remove_prop(arrays, world, prop)
    step_alone(arrays, world, 300, DT)
    assert world.vehicles[0].x > 130.0


def test_vehicle_before_a_roadblock_is_respawned():
    network = TownNetwork(straight_town(lanes=1))
    arrays, world = kernel_world(network, [Pose(0, 20.0, speed=8.0), Pose(0, 5.0, speed=8.0)])
    add_prop(network, arrays, world, PropKind.DUMPSTER, 1, 20.0)
    step_alone(arrays, world, 1800, DT)
    assert world.clock[0].towed >= 2 and world.clock[0].collisions == 0


def test_traffic_passes_a_prop_by_the_lane_beside():
    network = TownNetwork(straight_town(lanes=2, roads=4))
    arrays, world = kernel_world(network, [Pose(0, 10.0, speed=8.0)])
    add_prop(network, arrays, world, PropKind.TRAFFIC_CONE, 2, 80.0)
    sides = set()
    for _ in range(100):
        step_alone(arrays, world, 9, DT)
        sides.add(int(world.vehicles[0].lane) % 2)
    assert world.vehicles[0].x > 200.0 and 1 in sides and not world.vehicles[0].crashed


def crosswalks_ahead(network, arrays):
    """For lanes at whose end people cross: the lane, its length, and the passage behind it, on a way through."""
    for lane in network.town.lanes:
        if lane.in_junction or lane.length < 40.0:
            continue
        for link in network.town.successors(lane.id):
            way = arrays.lanes[link.target]
            if way.passages and arrays.passages[way.passage].start < 5.0:
                yield lane.id, lane.length, arrays.passages[way.passage]
                break


def test_vehicles_stop_for_a_pedestrian_on_a_crosswalk():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    tested = 0
    for number, length, passage in crosswalks_ahead(network, arrays):
        world = empty_world(arrays, vehicles=1, pedestrians=1)
        add_vehicle(arrays, world, number, length + passage.start - 25.0, desired=8.0)
        crossing = arrays.crossings[passage.crossing]
        add_pedestrian(arrays, world, int(crossing.walk[0]), float(crossing.station[0]), pace=1.2)
        walker = world.pedestrians[0]
        walker.state, walker.crossing, walker.direction = Walk.CROSSING, passage.crossing, 1.0
        walker.station, walker.mouth = max(float(passage.across) - 4.0, 0.0), 0
        nearest = np.inf
        while walker.state == Walk.CROSSING:
            step_alone(arrays, world, 1, DT)
            if abs(walker.station - passage.across) < 1.5:
                assert world.vehicles[0].lane == number
                nearest = min(nearest, float(length + passage.start - world.vehicles[0].own_station) - 2.5)
        assert 0.0 < nearest < 20.0
        assert world.clock[0].run_over == 0
        step_alone(arrays, world, 1800, DT)  # there may be lights
        assert world.vehicles[0].lane != number  # and then go on
        tested += 1
    assert tested >= 2


def test_no_pedestrian_steps_in_front_of_a_vehicle_that_cannot_stop_with_ease():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    number, length, passage = next(crosswalks_ahead(network, arrays))
    world = empty_world(arrays, vehicles=1, pedestrians=1)
    add_vehicle(arrays, world, number, float(length + passage.start) - 12.0, desired=9.0)
    world.vehicles[0].speed = 9.0
    crossing = arrays.crossings[passage.crossing]
    add_pedestrian(arrays, world, int(crossing.walk[0]), float(crossing.station[0]), pace=1.2)
    walker = world.pedestrians[0]
    walker.state, walker.crossing, walker.direction = Walk.WAITING, passage.crossing, 1.0
    step_alone(arrays, world, 6, DT)
    assert walker.state == Walk.WAITING
    world.vehicles[0].kind = Kind.EMPTY
    step_alone(arrays, world, 6, DT)
    assert walker.state == Walk.CROSSING


@pytest.mark.parametrize("name", ["brookside", "midtown"])
def test_pedestrians_walk_on_pavements_and_cross_on_crosswalks_only(name):
    network = TownNetwork(find_town(name))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=20, seed=2)
    populate(network, arrays, world, seed=2, vehicles=0, pedestrians=20)
    crossed = 0
    for _ in range(200):
        step_alone(arrays, world, 15, DT)
        for walker in world.pedestrians:
            place = np.array([walker.x, walker.y])
            lane = network.get_lane(network.get_closest_lane_index(place, height=walker.height))
            on_road = abs(lane.local_coordinates(place)[1]) < lane.width / 2
            crossed += on_road
            assert not on_road or walker.state == Walk.CROSSING
    assert crossed > 20
    assert world.pedestrians.odometer.min() > 50.0


def test_world_without_room_refuses_one_more():
    network = TownNetwork(straight_town())
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=1, props=0)
    with pytest.raises(ValueError, match="room for 0 vehicles"):
        add_vehicle(arrays, world, 0, 10.0, desired=8.0)
    with pytest.raises(ValueError, match="room for 0 props"):
        add_prop(network, arrays, world, PropKind.TREE, 0, 10.0)
    with pytest.raises(ValueError, match="no footway 99"):
        add_pedestrian(arrays, world, 99, 1.0, pace=1.2)
