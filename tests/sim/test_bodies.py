from __future__ import annotations

import copy
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Obstacle, RoadObject

from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.bodies import Bodies, Cyclist, Pedestrian, Prop, TrafficVehicle
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_pedestrian, add_prop, add_vehicle, populate
from dorothie_gym.sim.road import TownRoad, enlarged
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from tests.sim.network.towns import (
    EAST_OUT,
    WEST_EAST,
    WEST_IN,
    WEST_SOUTH,
    find_town,
    straight_town,
    t_junction_town,
)

DT = 1.0 / 15.0


@pytest.fixture(scope="module")
def brookside() -> TownNetwork:
    return TownNetwork(find_town("brookside"))


def crowd(network: TownNetwork, *, seconds: float = 8.0) -> tuple[Any, TownRoad, Bodies]:
    """Traffic, pedestrians and a prop after a while: holder of the arrays, road and views."""
    town = town_arrays(network)
    world = empty_world(town, vehicles=14, pedestrians=8, seed=2)
    populate(network, town, world, seed=2, vehicles=12, pedestrians=6, cyclists=0.4)
    add_prop(network, town, world, PropKind.DUMPSTER, 3, 12.0)
    step_alone(town, world, round(seconds / DT), DT)
    holder, road = SimpleNamespace(arrays=world), TownRoad(network)
    bodies = Bodies(road, holder)
    road.vehicles, road.objects = list(bodies.vehicles()), [*bodies.pedestrians(), *bodies.props()]
    return holder, road, bodies


def on(network: TownNetwork, lane: int, station: float, speed: float = 5.0) -> TrafficVehicle:
    """One vehicle alone in a town, thinking of no change of lanes for a second."""
    town = town_arrays(network)
    world = empty_world(town, vehicles=1, pedestrians=0, seed=1)
    row = add_vehicle(town, world, lane, station, desired=8.0)
    world.vehicles[row].speed, world.vehicles[row].timer = speed, 0.01
    road = TownRoad(network)
    view = TrafficVehicle(road, SimpleNamespace(arrays=world), row)
    road.vehicles.append(view)
    return view


def test_vehicles_are_highway_envs_and_show_what_the_arrays_hold(brookside: TownNetwork) -> None:
    holder, _, bodies = crowd(brookside)
    vehicles = bodies.vehicles()
    assert len(vehicles) == 12
    assert max(vehicle.speed for vehicle in vehicles) > 3.0
    for vehicle in vehicles:
        record = holder.arrays.vehicles[vehicle.row]
        assert isinstance(vehicle, Vehicle)
        assert isinstance(vehicle, Cyclist) == (record.kind == Kind.CYCLIST)
        assert vehicle.position.tolist() == [record.x, record.y]
        assert (vehicle.heading, vehicle.speed, vehicle.height) == (record.heading, record.speed, record.height)
        assert (vehicle.LENGTH, vehicle.WIDTH, vehicle.diagonal) == (record.length, record.width, 2 * record.radius)
        assert (vehicle.key, vehicle.kind, vehicle.crashed) == (record.key, record.kind, record.crashed)
        assert vehicle.velocity == pytest.approx(record.speed * vehicle.direction)
        assert (vehicle.lane_id, vehicle.station) == (record.lane, record.own_station)
        assert vehicle.lane is brookside.lane_of(record.lane)
        assert vehicle.lane_index == brookside.get_closest_lane_index(vehicle.position, vehicle.heading)
        assert vehicle.lane_offset[:2].tolist() == list(vehicle.lane.local_coordinates(vehicle.position))
        assert vehicle.target_lane_index == vehicle.route[0] == brookside.index_of(record.plan[0])
        assert vehicle.target_speed == record.desired
        assert vehicle.on_road


def test_views_follow_the_world_during_steps(brookside: TownNetwork) -> None:
    holder, _, bodies = crowd(brookside)
    vehicle = max(bodies.vehicles(), key=lambda each: each.speed)
    before, place = vehicle.position.copy(), vehicle.position
    step_alone(town_arrays(brookside), holder.arrays, 5, DT)
    assert math.dist(vehicle.position, before) > 1.0
    assert (place == vehicle.position).all()  # as highway-env's own, which move their array in place


def test_views_are_cached_and_follow_grown_arrays(brookside: TownNetwork) -> None:
    holder, _, bodies = crowd(brookside)
    vehicles = bodies.vehicles()
    assert all(one is other for one, other in zip(vehicles, bodies.vehicles(), strict=True))
    old, town = holder.arrays, town_arrays(brookside)
    holder.arrays = enlarged(town, old, 40)
    assert [vehicle.key for vehicle in vehicles] == [vehicle.key for vehicle in bodies.vehicles()]
    vehicles[0].speed = 1.25
    assert holder.arrays.vehicles[vehicles[0].row].speed == 1.25 != old.vehicles[vehicles[0].row].speed
    for _ in range(28):
        add_vehicle(town, holder.arrays, 3, 20.0, desired=5.0)
    assert len(bodies.vehicles()) == 40


def test_a_row_that_becomes_a_cyclist_is_shown_as_one() -> None:
    view = on(TownNetwork(straight_town()), 0, 20.0)
    bodies = Bodies(view.road, view._holder)
    assert type(bodies.vehicles()[0]) is TrafficVehicle
    view.record.kind = Kind.CYCLIST
    assert type(bodies.vehicles()[0]) is Cyclist
    view.record.kind = Kind.EMPTY
    assert bodies.vehicles() == []


def test_attributes_written_by_highway_env_reach_the_arrays() -> None:
    network = TownNetwork(straight_town())
    view = on(network, 1, 20.0)
    view.position = (30.0, 8.5)
    view.position += np.array([1.0, 0.0])
    view.heading += 0.1
    view.speed, view.crashed, view.target_speed, view.timer = np.float64(3.0), np.bool_(True), 7, 0.5
    view.on_state_update()
    record = view.record
    assert (record.x, record.y, record.heading, record.speed) == (31.0, 8.5, 0.1, 3.0)
    assert (record.cos, record.sin) == (math.cos(0.1), math.sin(0.1))
    assert (record.crashed, record.desired, record.timer) == (True, 7.0, 0.5)
    assert record.lane == 2 and (record.own_station, record.own_lateral) == (31.0, 0.5)
    assert (view.lane_index, view.target_lane_index) == (network.index_of(2), network.index_of(1))
    view.lane_index = network.index_of(1)
    assert record.lane == 1 and record.own_lateral == 4.5
    view.action = {"acceleration": 1.5, "steering": 0.2}
    assert view.action == {"acceleration": 1.5, "steering": pytest.approx(0.2)}


def test_assigned_route_is_driven() -> None:
    network = TownNetwork(t_junction_town())
    for connector in (WEST_EAST, WEST_SOUTH):
        view = on(network, WEST_IN, 60.0)
        view.route = [network.index_of(WEST_IN), (*network.index_of(connector)[:2], None)]
        assert view.route[1] == network.index_of(connector)
        last = network.get_lane(view.route[-1])
        assert view.destination.tolist() == last.position(last.length).tolist()
        for _ in range(200):
            step_alone(town_arrays(network), view._holder.arrays, 1, DT)
            if view.lane_id != WEST_IN:
                break
        assert view.lane_id == connector
    view.route = [("no", "where", 0)]
    assert view.route[0] == network.index_of(WEST_SOUTH) and len(view.route) > 1  # the rest is drawn at random


def test_assigned_target_lane_is_followed() -> None:
    network = TownNetwork(t_junction_town())
    view = on(network, WEST_IN, 60.0)
    view.route = [network.index_of(WEST_IN), network.index_of(WEST_EAST), network.index_of(EAST_OUT)]
    view.target_lane_index = network.index_of(WEST_EAST)
    assert view.route[:2] == [network.index_of(WEST_EAST), network.index_of(EAST_OUT)]
    assert view.record.station < 0.0
    view.target_lane_index = network.index_of(WEST_SOUTH)
    assert view.target_lane_index == view.route[0] == network.index_of(WEST_SOUTH)


def test_features_of_vehicles_are_those_of_highway_env(brookside: TownNetwork) -> None:
    _, road, bodies = crowd(brookside)
    origin = Vehicle(road, [10.0, 20.0], 0.3, 4.0)
    for vehicle in bodies.vehicles():
        for options in ({}, {"origin_vehicle": origin}, {"origin_vehicle": origin, "observe_intentions": False}):
            told, expected = vehicle.to_dict(**options), Vehicle.to_dict(vehicle, **options)
            assert list(told) == list(expected)
            assert list(told.values()) == pytest.approx(list(expected.values()), rel=1e-14, abs=1e-14)


def test_single_vehicle_drives_as_highway_envs() -> None:
    network = TownNetwork(straight_town(lanes=1, roads=3))
    view = on(network, 0, 10.0)
    view.position += np.array([0.0, 0.7])
    view.on_state_update()
    twin = view.create_from(view)
    assert type(twin) is IDMVehicle
    for vehicle in (view, twin):
        vehicle.road = TownRoad(network)
    for _ in range(60):
        for vehicle in (view, twin):
            vehicle.act()
            vehicle.step(DT)
    assert view.position == pytest.approx(twin.position, abs=1e-9)
    assert (view.heading, view.speed) == pytest.approx((twin.heading, twin.speed), abs=1e-9)
    assert view.position[0] > 30.0 and abs(view.position[1]) < 0.1


def test_actions_are_limited_as_highway_env_does() -> None:
    view = on(TownNetwork(straight_town()), 0, 20.0)
    for speed, crashed, expected in ((45.0, False, -5.0), (-45.0, False, 5.0), (4.0, True, -4.0), (4.0, False, 2.0)):
        view.speed, view.crashed, view.action = speed, crashed, {"acceleration": 2.0, "steering": 0.1}
        view.clip_actions()
        assert view.action["acceleration"] == max(expected, 2.0) if speed < 0 else expected
        assert view.action["steering"] == (0.0 if crashed else pytest.approx(0.1))


def test_a_copy_has_a_world_of_its_own(brookside: TownNetwork) -> None:
    holder, road, _ = crowd(brookside)
    twin = copy.deepcopy(SimpleNamespace(road=road, holder=SimpleNamespace(arrays=holder.arrays.copy())))
    vehicle, copied = road.vehicles[0], copy.deepcopy(road.vehicles[0])
    copied._holder.arrays = holder.arrays.copy()
    copied.speed = vehicle.speed + 1.0
    assert copied.speed == vehicle.speed + 1.0
    assert copied.road is not road and copied.lane is vehicle.lane
    assert len(twin.road.vehicles) == len(road.vehicles)


def test_history_is_kept_until_a_respawn() -> None:
    view = on(TownNetwork(straight_town()), 0, 20.0)
    view.road.record_history = True
    for _ in range(3):
        view.act()
        view.step(DT)
    assert [type(state) for state in view.history] == [IDMVehicle] * 3
    assert view.history[0].position[0] > view.history[2].position[0]
    view.record.key += 1
    view.remember()
    assert len(view.history) == 1


def test_pedestrians_are_moving_objects_of_highway_env(brookside: TownNetwork) -> None:
    holder, road, bodies = crowd(brookside)
    people = bodies.pedestrians()
    assert len(people) == 6
    assert any(pedestrian.speed > 0.5 for pedestrian in people)
    for pedestrian in people:
        record = holder.arrays.pedestrians[pedestrian.row]
        assert isinstance(pedestrian, RoadObject) and isinstance(pedestrian, Pedestrian)
        assert (*pedestrian.position, pedestrian.heading, pedestrian.speed) == (
            record.x,
            record.y,
            record.heading,
            record.speed,
        )
        assert (pedestrian.key, pedestrian.crashed, pedestrian.state) == (record.key, False, Walk(record.state))
        assert pedestrian.lane_index == brookside.get_closest_lane_index(pedestrian.position, pedestrian.heading)
        assert pedestrian.station == pedestrian.lane.local_coordinates(pedestrian.position)[0]
        told = pedestrian.to_dict(Vehicle(road, [1.0, 2.0]))
        assert (told["x"], told["vx"]) == (record.x - 1.0, record.speed * record.cos)
        assert np.isfinite(list(told.values())).all()
    holder.arrays.pedestrians[0].state = Walk.EMPTY
    assert len(bodies.pedestrians()) == 5


@pytest.mark.parametrize("kind", PropKind)
def test_props_stand_where_they_were_put(kind: PropKind) -> None:
    network = TownNetwork(straight_town())
    town = town_arrays(network)
    holder = SimpleNamespace(arrays=empty_world(town, vehicles=1, pedestrians=0))
    add_prop(network, town, holder.arrays, kind, 1, 30.0)
    (prop,) = Bodies(TownRoad(network), holder).props()
    assert isinstance(prop, Obstacle) and isinstance(prop, Prop)
    assert (prop.kind, prop.LENGTH, prop.WIDTH) == (kind, kind.length, kind.width)
    assert (prop.lane_id, prop.station, prop.key) == (1, 30.0, 1)
    assert prop.position.tolist() == [30.0, 4.0] and prop.height == 0.0
    assert prop.polygon().min(axis=0) == pytest.approx([30.0 - kind.length / 2, 4.0 - kind.width / 2])
    assert prop.to_dict()["vx"] == 0.0 and not prop.crashed
    prop.crashed = True
    assert prop.crashed


def test_pedestrians_can_be_added_while_views_exist(brookside: TownNetwork) -> None:
    holder, _, bodies = crowd(brookside)
    walk = int(np.argmax(town_arrays(brookside).walks.length))
    row = add_pedestrian(town_arrays(brookside), holder.arrays, walk, 3.0, pace=1.2)
    assert row in [pedestrian.row for pedestrian in bodies.pedestrians()]
