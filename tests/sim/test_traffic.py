"""Traffic around the session's car; how it drives and what it does at junctions is tested in `kernel`."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.traffic.parameters import OUT_OF_SIGHT
from dorothie_gym.sim.world import World
from tests.sim.driving import network, run, world_at


def busy_world(name: str, vehicles: int = 10, seed: int = 2) -> World:
    site = network(name).town.sites[1]
    world = world_at(name, site.lane, site.station, WorldConfig(vehicles=vehicles, pedestrians=0), seed)
    world.planner.command(PhysicalAction.STOP, 0, 0.0)
    return world


@pytest.mark.parametrize(
    ("name", "seconds"),
    [("brookside", 120), ("Town02", 60), ("Town05", 60), pytest.param("brookside", 600, marks=pytest.mark.slow)],
)
def test_vehicles_keep_their_lanes_keep_moving_and_rarely_crash(name: str, seconds: int) -> None:
    world = busy_world(name)
    crashed: set[int] = set()
    moving, seen, off = 0, 0, 0
    for _ in range(2 * seconds):
        world.step(15)
        others = world.actors.arrays.vehicles[1:]
        seen += len(others)
        off += int((np.abs(others.own_lateral) > 2.5).sum())
        moving += int((others.speed > 0.5).sum())
        crashed.update(others.key[others.crashed].tolist())
    assert len(world.actors.vehicles) == 10
    assert moving > 0.5 * seen
    assert off < 0.01 * seen
    assert len(crashed) <= 2


def test_crashed_vehicle_respawns_out_of_the_egos_sight() -> None:
    world = busy_world("brookside", vehicles=3)
    keys = [vehicle.key for vehicle in world.actors.vehicles]
    world.actors.vehicles[0].crashed = True
    place = world.actors.vehicles[0].position.copy()
    run(world, 2.5)
    assert [vehicle.key for vehicle in world.actors.vehicles] == keys
    assert math.dist(world.actors.vehicles[0].position, place) < 1.0
    for _ in range(30):
        world.step(1)
        (new,) = [v for v in world.actors.vehicles if v.key not in keys] or [None]
        if new is not None:
            break
    assert new is not None and not new.crashed
    assert math.dist(new.position, world.car.position) > OUT_OF_SIGHT - 1.0
    assert {vehicle.key for vehicle in world.actors.vehicles} == {*keys[1:], new.key}


def test_car_stays_behind_a_cyclist_where_there_is_one_lane() -> None:
    town = network("brookside").town
    lane = max((lane for lane in town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    world = world_at("brookside", lane.id, 5.0)
    world.ego.cruise = 12.0
    for _ in range(100):  # one in eight rides a bicycle
        assert world.actors.add_vehicle(lane.id, 25.0, distance=5.0)
        (cyclist,) = world.actors.vehicles
        if cyclist.kind is Kind.CYCLIST:
            break
        cyclist.kind = Kind.EMPTY
    assert cyclist.kind is Kind.CYCLIST
    gaps = []
    for _ in range(45):  # 15 s
        world.step(10)
        gaps.append(cyclist.station - world.planner.station)
    assert world.planner.lane == lane.id == cyclist.lane_id
    assert min(gaps) > 4.0 and gaps[-1] < 30.0
    assert abs(float(world.car.speed) - cyclist.speed) < 1.5
    assert world.collisions == 0
