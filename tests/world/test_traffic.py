from __future__ import annotations

import numpy as np
import pytest
from highway_env.vehicle.behavior import IDMVehicle

from dorothie_gym.ontology import PhysicalAction, PropKind
from dorothie_gym.world.config import WorldConfig
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
    for _ in range(300):
        world.step(6)
        held = [(key, claim.connector) for key, claims in world.junctions._held.items() for claim in claims]
        for k, (one, first) in enumerate(held):
            for two, second in held[k + 1 :]:
                assert one == two or not world.junctions.crosses(first, second)


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


def test_unused_grant_lapses() -> None:
    world = busy_world("brookside", vehicles=0)
    control, town = world.junctions, world.town
    junction = town.junctions[0]
    first = junction.connectors[0]
    second = next(c for c in junction.connectors if control.crosses(first, c))
    assert control.request(7, first, 0.0, room=True)
    assert not control.request(8, second, 0.1, room=True)
    for step in range(1, 20):  # the one that holds it drives elsewhere
        control.note(7, next(lane.id for lane in town.lanes if not lane.in_junction), 8.0, 0.1 * step)
    assert control.holds(7) is None
    assert control.request(8, second, 2.0, room=True)


def test_first_come_first_served_and_nobody_waits_for_who_has_no_room() -> None:
    world = busy_world("brookside", vehicles=0)
    control = world.junctions
    junction = world.town.junctions[0]
    first = junction.connectors[0]
    second = next(c for c in junction.connectors if control.crosses(first, c))
    assert not control.request(1, first, 0.0, room=False)
    assert control.request(2, second, 0.1, room=True)
    assert not control.request(1, first, 0.2, room=True)
    control.release(2)
    assert control.request(1, first, 0.3, room=True)


def test_closed_junction_lets_nobody_in() -> None:
    control = busy_world("brookside", vehicles=0).junctions
    junction = network("brookside").town.junctions[0]
    assert control.close(0, junction.id, 0.0)
    assert not control.request(1, junction.connectors[0], 0.5, room=True)
    assert control.request(1, junction.connectors[0], 2.0, room=True)
    assert not control.close(0, junction.id, 2.1)


def test_traffic_is_finite_and_the_same_for_a_seed() -> None:
    places = []
    for _ in range(2):
        world = busy_world("Town02")
        run(world, 30.0)
        places.append(np.array([vehicle.position for vehicle in world.actors.vehicles]))
    assert np.isfinite(places[0]).all()
    np.testing.assert_array_equal(places[0], places[1])
