"""Worlds that are changed while they go on."""

import numpy as np
import pytest

from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import (
    add_pedestrian,
    add_prop,
    add_vehicle,
    free_places,
    move_prop,
    populate,
    remove_pedestrian,
    remove_vehicle,
)
from dorothie_gym.sim.state.codes import NOBODY, Kind, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world, grown
from dorothie_gym.sim.traffic.parameters import CLEAR_OF_CAR, CYCLIST_SPEEDS
from dorothie_gym.sim.traffic.respawn import is_free
from tests.sim.network.towns import find_town, straight_town
from tests.sim.state.states import DT, Pose, kernel_world


def crowd(network, *, vehicles, pedestrians, props):
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=vehicles, pedestrians=pedestrians, props=props, seed=9)
    populate(network, arrays, world, seed=9, vehicles=20, pedestrians=15)
    add_prop(network, arrays, world, PropKind.TRAFFIC_CONE, 3, 20.0)
    return arrays, world


def test_grown_world_evolves_as_one_with_room_from_the_start():
    network = TownNetwork(find_town("brookside"))
    arrays, small = crowd(network, vehicles=20, pedestrians=15, props=1)
    _, large = crowd(network, vehicles=27, pedestrians=22, props=4)
    step_alone(arrays, small, 100, DT)
    step_alone(arrays, large, 100, DT)
    small = grown(arrays, small, vehicles=27, pedestrians=22, props=4)
    for world in (small, large):
        add_pedestrian(arrays, world, 2, 10.0, pace=1.2)
        add_vehicle(arrays, world, 5, 20.0, desired=7.0)
        step_alone(arrays, world, 300, DT)
    for name in ("vehicles", "pedestrians", "props", "clock", "lamps", "busy", "heads"):
        assert getattr(small, name).tobytes() == getattr(large, name).tobytes(), name


def test_traffic_takes_the_first_free_places_that_were_drawn():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    filled, expected = (empty_world(arrays, vehicles=12, pedestrians=0, props=0, seed=4) for _ in range(2))
    populate(network, arrays, filled, seed=5, vehicles=12, pedestrians=0, cyclists=0.5)
    rng = np.random.default_rng(5)
    kinds = [Kind.CYCLIST if number < 0.5 else Kind.CAR for number in rng.random(12)]
    rideable = arrays.lanes["cycling"] & (arrays.lanes["right"] < 0) & (arrays.lanes["junction"] < 0)
    for lane, station in free_places(network.town, rng, 40 * 12):
        if not kinds:
            break
        free = is_free(arrays, expected, lane, station, int(NOBODY), CLEAR_OF_CAR)
        if free and (kinds[0] is Kind.CAR or rideable[lane]):
            speeds = CYCLIST_SPEEDS if kinds[0] is Kind.CYCLIST else (6.5, 10.0)
            add_vehicle(arrays, expected, lane, station, kind=kinds.pop(0), desired=rng.uniform(*speeds))
    assert filled.vehicles.tobytes() == expected.vehicles.tobytes()


def test_world_does_not_shrink():
    arrays, world = kernel_world(TownNetwork(straight_town()), [Pose(0, 50.0), Pose(0, 80.0)])
    with pytest.raises(ValueError, match="does not shrink"):
        grown(arrays, world, vehicles=1, pedestrians=0, props=16)


def test_removed_vehicle_no_longer_blocks_the_road():
    arrays, world = kernel_world(TownNetwork(straight_town(lanes=1)), [Pose(0, 20.0), Pose(0, 45.0, desired=0.01)])
    step_alone(arrays, world, 300, DT)
    assert world.vehicles[0].x < 45.0
    remove_vehicle(arrays, world, 1)
    step_alone(arrays, world, 300, DT)
    assert world.vehicles[0].x > 60.0 and world.vehicles[1].kind == Kind.EMPTY
    key = int(world.vehicles[1].key)
    assert add_vehicle(arrays, world, 0, 10.0, desired=5.0) == 1
    assert world.vehicles[1].key > key


def test_removed_pedestrian_is_absent():
    network = TownNetwork(find_town("brookside"))
    arrays = town_arrays(network)
    world = empty_world(arrays, vehicles=0, pedestrians=2)
    for station in (10.0, 30.0):
        add_pedestrian(arrays, world, 0, station, pace=1.2)
    world.pedestrians[0].crashed = True
    remove_pedestrian(world, 0)
    step_alone(arrays, world, 300, DT)
    assert world.pedestrians.state.tolist() == [Walk.EMPTY, Walk.WALKING]
    assert add_pedestrian(arrays, world, 0, 10.0, pace=1.2) == 0


def test_moved_prop_keeps_its_key_and_blocks_the_new_place():
    network = TownNetwork(straight_town(lanes=2))
    arrays, world = kernel_world(network, [Pose(0, 20.0)])
    number = add_prop(network, arrays, world, PropKind.STREET_BARRIER, 2, 20.0)
    key = int(world.props[number].key)
    move_prop(network, arrays, world, number, 3, 60.0)
    prop = world.props[number]
    assert prop.key == key and prop.x == pytest.approx(160.0) and prop.y == pytest.approx(4.0)
    assert 3 in prop.lane and np.flatnonzero(world.heads >= 0).tolist() == [0, *sorted(k for k in prop.lane if k >= 0)]


def test_random_numbers_of_a_body_depend_on_its_key_not_on_array_sizes():
    arrays = town_arrays(TownNetwork(straight_town()))
    numbers = []
    for room in (1, 5):
        world = empty_world(arrays, vehicles=room, pedestrians=room, seed=3)
        add_vehicle(arrays, world, 0, 20.0, desired=8.0)
        numbers.append(int(world.vehicles[0].random))
    assert numbers[0] == numbers[1] > 0
