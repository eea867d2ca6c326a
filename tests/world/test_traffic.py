from __future__ import annotations

import itertools

import numpy as np
import pytest
from highway_env.vehicle.behavior import IDMVehicle

from dorothie_gym.ontology import PhysicalAction, PropKind
from dorothie_gym.world.config import WorldConfig
from dorothie_gym.world.town.right_of_way import right_of_way
from dorothie_gym.world.world import World
from tests.world.driving import network, run, world_at


def busy_world(name: str, vehicles: int = 10, seed: int = 2) -> World:
    site = network(name).town.sites[1]
    world = world_at(name, site.lane, site.station, WorldConfig(vehicles=vehicles, pedestrians=0), seed)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    return world


@pytest.mark.parametrize("name", ["brookside", "Town05"])
def test_vehicles_accelerate_and_steer_as_stock_does(name: str) -> None:
    world = busy_world(name)
    for _ in range(60):
        world.step(15)
        for vehicle in world.actors.vehicles:
            front, _ = world.road.neighbour_vehicles(vehicle)
            stock = IDMVehicle.acceleration(vehicle, vehicle, front)
            assert vehicle.acceleration(vehicle, front) == pytest.approx(stock, rel=1e-9, abs=1e-9)
            vehicle.aside = 0.0  # cyclists keep to the right of where stock steers
            steering = IDMVehicle.steering_control(vehicle, vehicle.target_lane_index)
            assert vehicle.steering_control(vehicle.target_lane_index) == pytest.approx(steering, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "seconds"),
    [("brookside", 120), ("Town02", 60), ("Town05", 60), pytest.param("brookside", 600, marks=pytest.mark.slow)],
)
def test_vehicles_keep_to_their_lanes_keep_moving_and_hardly_crash(name: str, seconds: int) -> None:
    world = busy_world(name)
    crashed: set[int] = set()
    moving, seen, off = 0, 0, 0
    for _ in range(2 * seconds):
        world.step(15)
        for vehicle in world.actors.vehicles:
            station, lateral = vehicle.lane.local_coordinates(vehicle.position)
            seen += 1
            off += abs(lateral) > 2.5
            moving += vehicle.speed > 0.5
            if vehicle.crashed:
                crashed.add(vehicle.key)
    assert len(world.actors.vehicles) == 10
    assert moving > 0.5 * seen
    assert off < 0.01 * seen
    assert len(crashed) <= 2


@pytest.mark.parametrize("name", ["brookside", "Town02"])
def test_crossing_connectors_are_never_driven_at_the_same_time(name: str) -> None:
    world = busy_world(name, vehicles=16)
    foes = right_of_way(world.town).foes
    for _ in range(300):
        world.step(6)
        for claims in world.junctions._inside.values():
            for one, two in itertools.combinations(claims, 2):
                assert one.key == two.key or two.connector not in foes(one.connector)


def test_crashed_vehicle_is_towed_and_another_comes() -> None:
    world = busy_world("brookside", vehicles=3)
    victim = world.actors.vehicles[0]
    victim.crashed = True
    run(world, 5.0)
    assert victim not in world.actors.vehicles
    assert victim not in world.road.vehicles
    assert len(world.actors.vehicles) == 3


def test_vehicle_before_a_roadblock_is_towed() -> None:
    world = busy_world("brookside", vehicles=0)
    lane = max((lane for lane in world.town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    world.actors.add_prop(PropKind.STREET_BARRIER, lane.id, lane.length - 20.0)
    assert world.actors.add_vehicle(lane.id, lane.length - 70.0, distance=5.0)
    vehicle = world.actors.vehicles[0]
    run(world, 12.0)
    assert vehicle in world.actors.vehicles
    assert not vehicle.crashed
    run(world, 40.0)
    assert vehicle not in world.actors.vehicles


def test_traffic_is_finite_and_the_same_for_a_seed() -> None:
    places = []
    for _ in range(2):
        world = busy_world("Town02")
        run(world, 30.0)
        places.append(np.array([vehicle.position for vehicle in world.actors.vehicles]))
    assert np.isfinite(places[0]).all()
    np.testing.assert_array_equal(places[0], places[1])
