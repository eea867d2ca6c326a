from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Obstacle

from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.collisions import OrientedBox, boxes_touch
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_pedestrian, add_prop, add_vehicle, populate
from dorothie_gym.sim.road import CompiledRoad, TownRoad
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from tests.plain_python import printed_compiled_and_plain
from tests.sim.network.towns import find_town, lane, straight_town, town

DT = 1.0 / 15.0


@pytest.fixture(scope="module")
def brookside() -> TownNetwork:
    return TownNetwork(find_town("brookside"))


def empty_road(network: TownNetwork, *, vehicles: int = 4, pedestrians: int = 1) -> CompiledRoad:
    return CompiledRoad(network, empty_world(town_arrays(network), vehicles=vehicles, pedestrians=pedestrians, seed=3))


def guest_on(road: TownRoad, number: int, station: float, speed: float, kind: type[Vehicle] = Vehicle) -> Any:
    way = road.network.lane_of(number)
    guest = kind(road, way.position(station), way.heading_at(station), speed)
    road.vehicles.append(guest)
    return guest


def go(road: CompiledRoad, seconds: float) -> None:
    for _ in range(round(seconds / DT)):
        road.act()
        road.step(DT)


def test_a_guest_moves_as_on_highway_envs_road() -> None:
    network = TownNetwork(straight_town(lanes=1, roads=4))
    road, stock = empty_road(network), TownRoad(network)
    guests = [guest_on(each, 0, 10.0, 6.0, IDMVehicle) for each in (road, stock)]
    for _ in range(90):
        for each in (road, stock):
            each.act()
            each.step(DT)
        assert (guests[0].position == guests[1].position).all()
    assert (guests[0].speed, guests[0].heading) == (guests[1].speed, guests[1].heading)
    record = road.arrays.vehicles[0]
    assert record.kind == Kind.EGO and record.key == 0
    assert (record.x, record.y, record.speed) == (*guests[0].position, guests[0].speed)
    assert network.index_of(record.lane) == guests[0].lane_index
    assert road.time == stock.time == pytest.approx(road.arrays.clock[0].time)


def test_traffic_stops_behind_a_guest_that_stands() -> None:
    road = empty_road(TownNetwork(straight_town(lanes=1, roads=3)))
    guest = guest_on(road, 0, 80.0, 0.0)
    road.act()
    add_vehicle(road.town_arrays, road.arrays, 0, 20.0, desired=9.0)
    road.show()
    assert road.vehicles[0] is guest and len(road.vehicles) == 2
    go(road, 15.0)
    follower = road.vehicles[1]
    assert follower.speed < 0.3
    assert 3.0 < guest.position[0] - follower.position[0] - 5.0 < 12.0
    assert not guest.crashed and not follower.crashed


def test_touching_bodies_crash_on_both_sides_in_the_same_substep() -> None:
    road = empty_road(TownNetwork(straight_town(lanes=1, roads=3)))
    guest = guest_on(road, 0, 40.0, 12.0)
    road.act()
    add_vehicle(road.town_arrays, road.arrays, 0, 80.0, desired=3.0)
    road.show()
    other = road.vehicles[1]
    for _ in range(120):
        road.act()
        road.step(DT)
        assert guest.crashed == other.crashed == boxes_touch(OrientedBox.of(guest), OrientedBox.of(other))
        if guest.crashed:
            break
    assert guest.crashed
    keys = [vehicle.key for vehicle in road.vehicles[1:]]
    go(road, 6.0)
    assert [vehicle.key for vehicle in road.vehicles[1:]] == keys  # no body respawns near the guest
    assert guest.speed < 1.0


def test_guest_that_touches_a_pedestrian_has_crashed(brookside: TownNetwork) -> None:
    road = empty_road(brookside)
    walk = int(np.argmax(road.town_arrays.walks.length))
    add_pedestrian(road.town_arrays, road.arrays, walk, 5.0, pace=1.2)
    road.show()
    (walker,) = road.objects
    road.vehicles.append(Vehicle(road, walker.position - [6.0, 0.0], 0.0, 10.0))
    key = walker.key
    go(road, 1.5)
    assert road.vehicles[0].crashed and walker.crashed
    assert walker.key == key and math.dist(walker.position, road.vehicles[0].position) < 12.0


def test_a_hit_prop_is_marked() -> None:
    network = TownNetwork(straight_town(lanes=1, roads=3))
    road = empty_road(network)
    for station in (60.0, 150.0):
        add_prop(network, road.town_arrays, road.arrays, PropKind.DUMPSTER, 0 if station < 100 else 1, station % 100)
    road.show()
    guest = guest_on(road, 0, 30.0, 10.0)
    go(road, 4.0)
    assert guest.crashed
    assert [prop.crashed for prop in road.objects] == [True, False]


def test_objects_of_highway_envs_own_are_struck_by_guests() -> None:
    road = empty_road(TownNetwork(straight_town(lanes=1, roads=3)))
    obstacle = Obstacle(road, [60.0, 0.0])
    road.objects.append(obstacle)
    guest = guest_on(road, 0, 30.0, 10.0)
    go(road, 1.0)
    assert not guest.crashed
    go(road, 2.0)
    assert guest.crashed and obstacle.crashed and road.objects == [obstacle]


def test_lists_hold_the_present_bodies(brookside: TownNetwork) -> None:
    road = empty_road(brookside, vehicles=10, pedestrians=4)
    populate(brookside, road.town_arrays, road.arrays, seed=1, vehicles=10, pedestrians=4)
    add_prop(brookside, road.town_arrays, road.arrays, PropKind.TREE, 2, 10.0)
    road.show()
    assert (len(road.vehicles), len(road.objects)) == (10, 5)
    road.vehicles = road.vehicles[:3]
    road.objects = road.objects[1:4]
    road.step(DT)
    arrays = road.arrays
    assert (arrays.vehicles.kind != Kind.EMPTY).tolist() == [True] * 3 + [False] * 7
    assert (arrays.pedestrians.state != 0).tolist() == [False] + [True] * 3
    assert not arrays.props.present.any()
    assert (arrays.nodes.lane >= 0).sum() <= 6


def test_guests_make_the_arrays_grow(brookside: TownNetwork) -> None:
    road = empty_road(brookside, vehicles=2)
    populate(brookside, road.town_arrays, road.arrays, seed=1, vehicles=2, pedestrians=0)
    road.show()
    views, before = list(road.vehicles), [vehicle.position.copy() for vehicle in road.vehicles]
    guests = [guest_on(road, number, 8.0, 0.0) for number in (0, 4)]
    go(road, 3.0)
    assert len(road.arrays.vehicles) == 5
    assert (road.arrays.vehicles.kind == Kind.EGO).sum() == 2
    assert road.vehicles == [*views, *guests]
    assert all(math.dist(view.position, place) > 1.0 for view, place in zip(views, before, strict=True))
    road.vehicles.remove(guests[0])
    road.step(DT)
    assert (road.arrays.vehicles.kind == Kind.EGO).sum() == 1


def test_a_copy_evolves_equally_and_independently(brookside: TownNetwork) -> None:
    road = empty_road(brookside, vehicles=8, pedestrians=5)
    populate(brookside, road.town_arrays, road.arrays, seed=4, vehicles=7, pedestrians=5)
    road.show()
    guest_on(road, 2, 20.0, 3.0, IDMVehicle)
    go(road, 1.0)
    state, twin = road.arrays.tobytes(), copy.deepcopy(road)
    assert twin.network is brookside and twin.vehicles[-1].road is twin
    go(twin, 2.0)
    assert road.arrays.tobytes() == state
    go(road, 2.0)
    assert road.arrays.tobytes() == twin.arrays.tobytes() != state
    assert (twin.vehicles[0].position == road.vehicles[0].position).all()
    assert twin.vehicles[0].position is not road.vehicles[0].position


@pytest.mark.parametrize("level", [0, 1])
def test_guests_stay_on_their_level(level: int) -> None:
    decks = [lane(number, [(0, 0, 6.0 * number), (300, 0, 6.0 * number)], road=number) for number in (0, 1)]
    network = TownNetwork(town(decks))
    road = empty_road(network)
    guest = guest_on(road, level, 20.0, 10.0)
    guest.height = 6.0 * level
    road.act()
    add_vehicle(road.town_arrays, road.arrays, 1 - level, 60.0, desired=4.0)
    road.show()
    go(road, 8.0)
    assert guest.position[0] > road.vehicles[1].position[0] + 5.0
    assert not guest.crashed
    assert guest.height == 6.0 * level
    assert guest.lane_index == network.index_of(level)


TWO_SECONDS = """
import hashlib
from highway_env.vehicle.kinematics import Vehicle
from dorothie_gym.sim.road import CompiledRoad
from dorothie_gym.sim.population import populate
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.maps import load_town
network = TownNetwork(load_town("brookside"))
arrays = empty_world(town_arrays(network), vehicles=7, pedestrians=4, seed=5)
road = CompiledRoad(network, arrays)
start = network.lane_of(2)
road.vehicles.append(Vehicle(road, start.position(9.0), start.heading_at(9.0), 4.0))
road.show()
populate(network, road.town_arrays, arrays, seed=5, vehicles=6, pedestrians=4)
road.show()
for _ in range(30):
    road.act()
    road.step(1 / 15)
assert arrays.vehicles.speed.max() > 1.0
print(hashlib.sha256(arrays.tobytes()).hexdigest())
"""


@pytest.mark.long
def test_a_world_with_a_guest_is_the_same_bytes_compiled_and_in_plain_python() -> None:
    compiled, plain = printed_compiled_and_plain(TWO_SECONDS)
    assert compiled == plain != ""
