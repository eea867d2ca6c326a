"""Respawning: the vehicles concerned, and their new places."""

import numpy as np
import pytest

from dorothie_gym.maps import LightColour
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_vehicle, populate
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.parameters import CLEAR_OF_CAR, OUT_OF_SIGHT, TOW_CRASHED, TOW_FACING, TOW_STUCK
from dorothie_gym.sim.traffic.respawn import tow
from tests.sim.network.towns import find_town, straight_town
from tests.sim.state.states import DT


def with_car(network, others):
    """The session's car, which stands at 250 m of a straight road of 600 m, and others."""
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=1 + len(others), pedestrians=0)
    add_vehicle(arrays, world, 4, 50.0, kind=Kind.EGO, desired=8.0)
    for lane, station in others:
        add_vehicle(arrays, world, lane, station, desired=8.0)
    return arrays, world


def tow_for(arrays, world, seconds, **options):
    """Steps time and respawning only: no body moves."""
    for _ in range(round(seconds / DT)):
        tow(arrays, world, DT, **options)
        world.clock[0].frame += 1
        world.clock[0].time += DT
    rebuild(arrays, world)


def straight_network():
    return TownNetwork(straight_town(lanes=2, roads=6, length=100.0))


def test_crashed_vehicle_comes_back_out_of_sight_with_a_new_key():
    for station in (10.0, 20.0, 30.0, 45.0, 60.0, 70.0):
        arrays, world = with_car(straight_network(), [(4, station)])
        vehicle = world.vehicles[1]
        vehicle.crashed, key = True, int(vehicle.key)
        tow_for(arrays, world, TOW_CRASHED - 0.5)
        assert vehicle.crashed and vehicle.key == key
        tow_for(arrays, world, 1.0)
        assert not vehicle.crashed and vehicle.key != key and vehicle.kind == Kind.CAR
        assert abs(vehicle.x - 250.0) >= OUT_OF_SIGHT


def test_vehicle_that_stands_for_long_respawns_unless_its_light_is_red():
    network = TownNetwork(find_town("midtown"))
    town, arrays = network.town, town_arrays(network)
    lit = next(lane.id for lane in town.lanes if town.light(lane.id, 0.0) is not None and lane.length > 40.0)
    reds = [t for t in np.arange(0.0, 600.0, 0.5) if town.light(lit, float(t)) is LightColour.RED]
    world = empty_world(arrays, vehicles=1, pedestrians=0)
    add_vehicle(arrays, world, lit, town.lanes[lit].length - 25.0, desired=8.0)  # behind others, as it were
    key = int(world.vehicles[0].key)
    for time in reds[:180]:  # 90 s of red light
        world.clock[0].time, world.lamps.until = float(time), -np.inf
        for frame in range(15):
            world.clock[0].frame = frame
            tow(arrays, world, DT)
    assert world.vehicles[0].key == key and world.vehicles[0].stuck < 1.0
    other = straight_network()
    arrays, world = with_car(other, [(0, 50.0)])
    key = int(world.vehicles[1].key)
    tow_for(arrays, world, TOW_STUCK - 1.0)
    assert world.vehicles[1].key == key
    tow_for(arrays, world, 2.0)
    assert world.vehicles[1].key != key


def test_queue_before_a_red_light_across_another_junction_does_not_respawn():
    network = TownNetwork(find_town("midtown"))
    town, arrays = network.town, town_arrays(network)
    lit = arrays.lanes.programme >= 0
    ways = (
        (lane.id, link.target, after.target)
        for lane in town.lanes
        if not lane.in_junction and not lit[lane.id] and lane.length > 40.0
        for link in town.successors(lane.id)
        if town.lanes[link.target].in_junction
        for after in town.successors(link.target)
    )
    way = next(way for way in ways if lit[way[2]])
    reds = [t for t in np.arange(0.0, 900.0, 0.5) if town.light(way[2], float(t)) is LightColour.RED]
    greens = [t for t in np.arange(0.0, 900.0, 0.5) if town.light(way[2], float(t)) is LightColour.GREEN]
    world = empty_world(arrays, vehicles=1, pedestrians=0)
    add_vehicle(arrays, world, way[0], 20.0, desired=8.0)
    world.vehicles[0].plan[:3], world.vehicles[0].planned = way, 3
    for times, towed in ((reds[:180], False), (greens[:130], True)):  # 90 s, 65 s
        key = int(world.vehicles[0].key)
        for time in times:
            world.clock[0].time, world.lamps.until = float(time), -np.inf
            for frame in range(15):
                world.clock[0].frame = frame
                tow(arrays, world, DT)
        assert (world.vehicles[0].key != key) == towed


@pytest.mark.parametrize(("turning", "towed"), [(True, True), (False, False)])
def test_vehicle_before_the_turning_ego_is_respawned(turning, towed):
    arrays, world = with_car(straight_network(), [(4, 58.0), (4, 90.0)])
    world.vehicles[0].kind = Kind.DRIVEN
    keys = world.vehicles.key.copy()
    tow_for(arrays, world, TOW_FACING + 1.0, turning=turning)
    assert (world.vehicles[1].key != keys[1]) == towed
    assert world.vehicles[2].key == keys[2]


def test_no_body_respawns_close_to_others():
    network = TownNetwork(straight_town(lanes=2, roads=3, length=100.0))
    for seed in range(20):
        arrays = town_arrays(network)
        world = empty_world(arrays, vehicles=8, pedestrians=0, seed=seed)
        for k in range(8):
            add_vehicle(arrays, world, k % 6, 20.0 + 35.0 * (k // 6), desired=8.0)
        world.vehicles[7].crashed = True
        tow_for(arrays, world, TOW_CRASHED + 0.5)
        moved, others = world.vehicles[7], world.vehicles[:7]
        beside = np.abs(others.y - moved.y) < 2.5
        assert (np.abs(others.x - moved.x)[beside] >= 14.0).all()


def test_vehicle_without_room_is_removed():
    network = TownNetwork(straight_town(lanes=1, roads=1, length=60.0))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=2, pedestrians=0)
    add_vehicle(arrays, world, 0, 30.0, kind=Kind.EGO, desired=8.0)
    add_vehicle(arrays, world, 0, 40.0, desired=8.0)
    world.vehicles[1].crashed = True
    tow_for(arrays, world, TOW_CRASHED + 0.5)
    assert world.vehicles[1].kind == Kind.EMPTY
    step_alone(arrays, world, 30, DT)


def test_no_body_is_added_close_to_the_ego():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    for seed in range(5):
        world = empty_world(arrays, vehicles=40, pedestrians=40, seed=seed)
        add_vehicle(arrays, world, 0, 40.0, kind=Kind.EGO, desired=8.0)
        populate(network, arrays, world, seed=seed, vehicles=39, pedestrians=40)
        car, others = world.vehicles[0], world.vehicles[1:][world.vehicles.kind[1:] != Kind.EMPTY]
        assert np.hypot(others.x - car.x, others.y - car.y).min() > CLEAR_OF_CAR - 2.0
        assert np.hypot(world.pedestrians.x - car.x, world.pedestrians.y - car.y).min() > 7.0
