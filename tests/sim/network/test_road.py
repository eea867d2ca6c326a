import math

import numpy as np
import pytest
from highway_env.road.road import Road
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle

from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.road import TownRoad

from .towns import (
    EAST_IN,
    EAST_OUT,
    SOUTH_OUT,
    WEST_EAST,
    WEST_IN,
    WEST_SOUTH,
    overpass_town,
    straight_town,
    t_junction_town,
)


def scattered(network, road_class, seed, *, count=15, vehicle_class=Vehicle):
    """The same vehicles and obstacles on a road of some class."""
    rng = np.random.default_rng(seed)
    road = road_class(network, np_random=np.random.default_rng(seed))
    for _ in range(count):
        position, heading = rng.uniform([0, -2], [300, 10]), rng.normal(scale=0.1)
        road.vehicles.append(vehicle_class(road, position, heading, rng.uniform(0, 15)))
    for _ in range(5):
        road.objects.append(Obstacle(road, rng.uniform([0, -2], [300, 10])))
    road.objects.append(Landmark(road, rng.uniform([0, -2], [300, 10])))
    return road


def place_in(things, thing):
    return None if thing is None else things.index(thing)


@pytest.mark.parametrize("seed", range(10))
def test_neighbours_on_a_straight_road_equal_highway_envs(seed):
    network = TownNetwork(straight_town(lanes=3, roads=1, length=300.0))
    ours, stock = scattered(network, TownRoad, seed), scattered(network, Road, seed)
    for mine, theirs in zip(ours.vehicles, stock.vehicles, strict=True):
        for index in (None, *network.lanes_dict()):
            found, expected = ours.neighbour_vehicles(mine, index), stock.neighbour_vehicles(theirs, index)
            assert [place_in(ours.vehicles + ours.objects, t) for t in found] == [
                place_in(stock.vehicles + stock.objects, t) for t in expected
            ]


def test_neighbours_with_equal_stations_equal_highway_envs():
    network = TownNetwork(straight_town(lanes=1, roads=1))
    roads = TownRoad(network), Road(network)
    for road in roads:
        road.vehicles = [Vehicle(road, [50.0 + 10 * i, y]) for i in (0, 1, -1) for y in (0.0, 0.5)]
    for vehicle, twin in zip(roads[0].vehicles, roads[1].vehicles, strict=True):
        found, expected = roads[0].neighbour_vehicles(vehicle), roads[1].neighbour_vehicles(twin)
        assert [place_in(roads[0].vehicles, t) for t in found] == [place_in(roads[1].vehicles, t) for t in expected]


def on(road, lane_id, station, vehicle_class=Vehicle, **options):
    lane = road.network.lane_of(lane_id)
    vehicle = vehicle_class(road, lane.position(station, 0), lane.heading_at(station), 5.0, **options)
    road.vehicles.append(vehicle)
    return vehicle


def test_neighbours_are_found_across_lane_ends_with_distances_along_the_lanes():
    road = TownRoad(TownNetwork(straight_town(lanes=2, roads=3)))
    rear, ego, front = on(road, 0, 70.0), on(road, 2, 40.0), on(road, 4, 15.0)
    assert road.neighbours(ego) == ((front, pytest.approx(75.0)), (rear, pytest.approx(70.0)))
    assert road.neighbour_vehicles(front) == (None, ego)
    on_other_lane = road.neighbours(ego, road.network.index_of(3))
    assert on_other_lane == ((None, math.inf), (None, math.inf))


def test_no_vehicle_is_a_neighbour_beyond_the_horizon():
    road = TownRoad(TownNetwork(straight_town(lanes=1, roads=3)))
    ego = on(road, 0, 10.0)
    on(road, 1, 20.0)
    assert road.neighbour_vehicles(ego) == (None, None)


def test_distance_round_a_corner_is_measured_along_it():
    road = TownRoad(TownNetwork(t_junction_town()))
    ego, front = on(road, WEST_IN, 70.0), on(road, SOUTH_OUT, 10.0)
    along = 10.0 + road.network.lane_of(WEST_SOUTH).length + 10.0
    assert road.neighbours(ego) == ((front, pytest.approx(along)), (None, math.inf))


def test_route_decides_which_vehicle_is_followed():
    network = TownNetwork(t_junction_town())
    road = TownRoad(network)
    right, straight = on(road, SOUTH_OUT, 8.0), on(road, EAST_OUT, 8.0)
    for connector, expected in ((WEST_EAST, straight), (WEST_SOUTH, right)):
        route = [network.index_of(WEST_IN), network.index_of(connector)]
        ego = on(road, WEST_IN, 70.0, ControlledVehicle, route=route)
        assert road.neighbour_vehicles(ego)[0] is expected
        ego.route, ego.target_lane_index = None, network.index_of(connector)
        assert road.neighbour_vehicles(ego)[0] is expected
        road.vehicles.remove(ego)
    assert len(road.neighbour_vehicles(right)) == 2


def test_oncoming_traffic_is_no_neighbour():
    road = TownRoad(TownNetwork(t_junction_town()))
    ego = on(road, WEST_IN, 40.0)
    on(road, EAST_IN, 40.0)
    assert road.neighbour_vehicles(ego) == (None, None)


def test_objects_on_a_bridge_neither_collide_nor_are_followed():
    road = TownRoad(TownNetwork(overpass_town()))
    below, above = on(road, 0, 99.0), on(road, 1, 99.0)
    assert road.height_of(below) == pytest.approx(0.0)
    assert road.height_of(above) == pytest.approx(6.0)
    road.step(0.01)
    assert not below.crashed and not above.crashed
    assert road.neighbour_vehicles(on(road, 0, 60.0))[0] is below
    road.vehicles.remove(below)
    assert road.neighbour_vehicles(road.vehicles[-1])[0] is None


def test_own_height_of_an_object_overrides_that_of_its_lane():
    road = TownRoad(TownNetwork(overpass_town()))
    below, above = on(road, 0, 99.0), on(road, 1, 99.0)
    above.height = 0.5
    assert road.height_of(above) == 0.5
    road.step(0.01)
    assert below.crashed and above.crashed
    flat = TownRoad(TownNetwork(straight_town()))
    car, lamp = on(flat, 0, 50.0), Obstacle(flat, [50.0, 0.0])
    lamp.height = 5.0
    flat.objects.append(lamp)
    flat.step(0.01)
    assert not car.crashed


@pytest.mark.parametrize("seed", range(5))
def test_step_equals_highway_envs_at_one_height(seed):
    network = TownNetwork(straight_town(lanes=3, roads=1, length=300.0))
    ours, stock = scattered(network, TownRoad, seed, count=40), scattered(network, Road, seed, count=40)
    for _ in range(30):
        ours.step(1 / 15)
        stock.step(1 / 15)
    assert sum(vehicle.crashed for vehicle in stock.vehicles) > 0
    for mine, theirs in zip(ours.vehicles + ours.objects, stock.vehicles + stock.objects, strict=True):
        assert (mine.position == theirs.position).all()
        assert (mine.speed, mine.heading, mine.crashed, mine.hit) == (
            theirs.speed,
            theirs.heading,
            theirs.crashed,
            theirs.hit,
        )


@pytest.mark.parametrize("seed", range(3))
def test_idm_traffic_on_a_straight_road_drives_as_on_highway_envs_road(seed):
    network = TownNetwork(straight_town(lanes=3, roads=1, length=300.0))
    ours = scattered(network, TownRoad, seed, vehicle_class=IDMVehicle)
    stock = scattered(network, Road, seed, vehicle_class=IDMVehicle)
    for _ in range(40):
        for road in (ours, stock):
            road.act()
            road.step(1 / 15)
    for mine, theirs in zip(ours.vehicles, stock.vehicles, strict=True):
        assert (mine.position == theirs.position).all()
        assert mine.target_lane_index == theirs.target_lane_index


def test_empty_road_and_lone_vehicle():
    road = TownRoad(TownNetwork(straight_town()))
    road.act()
    road.step(0.1)
    assert road.neighbour_vehicles(on(road, 0, 5.0)) == (None, None)


@pytest.mark.parametrize("seed", range(5))
def test_close_objects_are_highway_envs(seed):
    network = TownNetwork(straight_town(lanes=3, roads=3))
    ours, stock = scattered(network, TownRoad, seed), scattered(network, Road, seed)
    for options in (
        {},
        {"count": 4},
        {"see_behind": False},
        {"sort": False, "count": 3},
        {"vehicles_only": True, "see_behind": False, "count": 0},
    ):
        for mine, theirs in zip(ours.vehicles, stock.vehicles, strict=True):
            found, expected = (
                ours.close_objects_to(mine, 90.0, **options),
                stock.close_objects_to(theirs, 90.0, **options),
            )
            assert [place_in(ours.vehicles + ours.objects, t) for t in found] == [
                place_in(stock.vehicles + stock.objects, t) for t in expected
            ]
    alone = TownRoad(network)
    assert alone.close_objects_to(on(alone, 0, 5.0), 50.0) == []
