"""Cyclists: slow, narrow, to the right, and overtaken where there is a lane for it."""

import numpy as np
import pytest

from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_vehicle, populate
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.traffic.parameters import CYCLIST_FROM_EDGE, CYCLIST_SPEEDS
from dorothie_gym.sim.traffic.respawn import tow
from tests.sim.network.towns import find_town, straight_town
from tests.sim.state.states import DT


def with_cyclist(network, lane, station, *, cars=()):
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=1 + len(cars), pedestrians=0)
    add_vehicle(arrays, world, lane, station, kind=Kind.CYCLIST, desired=5.0)
    for car_lane, car_station in cars:
        add_vehicle(arrays, world, car_lane, car_station, desired=10.0)
    return arrays, world


def test_cyclist_keeps_right_and_speeds_up_gently():
    arrays, world = with_cyclist(TownNetwork(straight_town(lanes=1)), 0, 20.0)
    cyclist = world.vehicles[0]
    fastest_gain = 0.0
    for _ in range(600):
        before = float(cyclist.speed)
        step_alone(arrays, world, 1, DT)
        fastest_gain = max(fastest_gain, (float(cyclist.speed) - before) / DT)
    assert fastest_gain == pytest.approx(1.0, abs=0.01)
    assert CYCLIST_SPEEDS[0] * 0.9 < cyclist.speed <= CYCLIST_SPEEDS[1] and cyclist.width < 1.0
    assert cyclist.own_lateral == pytest.approx(2.0 - CYCLIST_FROM_EDGE, abs=0.1)


def test_cyclist_moves_over_to_the_right_and_does_not_overtake():
    network = TownNetwork(straight_town(lanes=3, roads=6))
    arrays, _world = with_cyclist(network, 0, 20.0)
    add = empty_world(arrays, vehicles=2, pedestrians=0)
    add_vehicle(arrays, add, 0, 20.0, kind=Kind.CYCLIST, desired=5.0)
    add_vehicle(arrays, add, 2 + 3, 20.0, kind=Kind.CYCLIST, desired=4.2)  # 100 m ahead on the rightmost lane
    lanes = set()
    for _ in range(200):
        step_alone(arrays, add, 9, DT)
        lanes.add(int(add.vehicles[0].lane) % 3)
        assert add.vehicles[1].lane % 3 == 2
    assert lanes == {0, 1, 2} and add.vehicles[0].lane % 3 == 2
    assert add.vehicles[0].x < add.vehicles[1].x


def test_cyclist_stays_where_the_lane_to_the_right_is_taken():
    network = TownNetwork(straight_town(lanes=2, roads=3))
    arrays, world = with_cyclist(network, 0, 30.0, cars=[(1, 30.0)])
    for _ in range(20):
        world.vehicles[1].x, world.vehicles[1].speed = world.vehicles[0].x, world.vehicles[0].speed
        step_alone(arrays, world, 9, DT)
        assert world.vehicles[0].lane % 2 == 0


def test_cars_overtake_a_cyclist_where_there_are_two_lanes():
    network = TownNetwork(straight_town(lanes=2, roads=6))
    arrays, world = with_cyclist(network, 1, 60.0, cars=[(1, 25.0)])
    lanes = set()
    for _ in range(100):
        step_alone(arrays, world, 9, DT)
        lanes.add(int(world.vehicles[1].lane) % 2)
    assert lanes == {0, 1}
    assert world.vehicles[1].x > world.vehicles[0].x + 30.0 and not world.vehicles.crashed.any()


def test_about_one_vehicle_in_eight_is_a_cyclist_on_a_slow_rightmost_lane():
    network = TownNetwork(find_town("northgate"))
    arrays = town_arrays(network)
    cyclists = vehicles = 0
    for seed in range(12):
        world = empty_world(arrays, vehicles=40, pedestrians=0, seed=seed)
        populate(network, arrays, world, seed=seed, vehicles=40, pedestrians=0)
        vehicles += int((world.vehicles.kind != Kind.EMPTY).sum())
        for cyclist in world.vehicles[world.vehicles.kind == Kind.CYCLIST]:
            cyclists += 1
            assert arrays.lanes[cyclist.lane].right < 0 and arrays.lanes[cyclist.lane].limit < 17.0
    assert 0.08 < cyclists / vehicles < 0.17


def test_cyclists_avoid_fast_roads_in_routes_and_after_a_respawn():
    network = TownNetwork(find_town("northgate"))
    arrays = town_arrays(network)
    fast = arrays.lanes.limit > 17.0
    assert fast.sum() > 10
    world = empty_world(arrays, vehicles=20, pedestrians=0, seed=3)
    populate(network, arrays, world, seed=3, vehicles=20, pedestrians=0, cyclists=1.0)
    assert (world.vehicles.kind == Kind.CYCLIST).all()
    been = set()
    for k in range(400):
        step_alone(arrays, world, 30, DT)
        been |= set(world.vehicles.lane.tolist())
        if k % 40 == 0:
            world.vehicles.crashed, world.vehicles.crash_age = True, 10.0
            tow(arrays, world, DT)
            assert (arrays.lanes.right[world.vehicles.lane] < 0).all()
    assert len(been) > 60 and not fast[list(been)].any()
    assert np.isfinite(world.vehicles.x).all()
