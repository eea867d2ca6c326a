from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.highway_reference import run_stock, stock_lane, stock_road
from benchmarks.world import PROP_CLEARANCE, bytes_per_world, crowd, measure
from dorothie_gym.maps import load_town
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_arrays import town_arrays

KEYS = [
    "town", "lanes", "vehicles", "cyclists", "pedestrians", "props", "seed", "substeps_per_second", "best", "spread",
    "stock_substeps_per_second", "stock_best", "stock_spread", "ratio", "bytes_per_world", "repeats", "machine",
]  # fmt: skip


def test_figures_are_consistent() -> None:
    town = load_town("brookside")
    figures = measure("brookside", vehicles=4, pedestrians=3, props=1, seed=2, calls=4, stock_substeps=1, repeats=3)
    assert list(figures) == KEYS and json.loads(json.dumps(figures)) == figures
    assert figures["lanes"] == len(town.lanes)
    assert (figures["vehicles"], figures["pedestrians"]) == (4, 3)
    assert figures["ratio"] == pytest.approx(
        figures["substeps_per_second"] / figures["stock_substeps_per_second"], rel=2e-3
    )
    assert figures["best"] >= figures["substeps_per_second"] > 0.0
    assert figures["spread"] >= 0.0 and figures["stock_spread"] >= 0.0


def test_vehicles_that_do_not_fit_are_not_counted() -> None:
    figures = measure("brookside", vehicles=200, pedestrians=0, props=0, calls=1, stock_substeps=1, repeats=1)
    assert 20 < figures["vehicles"] < 200 and figures["pedestrians"] == 0 == figures["props"]


def test_crowd_has_all_actors_and_props_away_from_vehicles() -> None:
    network = TownNetwork(load_town("midtown"))
    arrays = town_arrays(network)
    world = crowd(network, arrays, vehicles=40, pedestrians=5, props=6, seed=1)
    kinds = world.vehicles.kind
    assert (kinds == Kind.CAR).sum() + (kinds == Kind.CYCLIST).sum() == 40 and (kinds == Kind.CYCLIST).any()
    props = world.props[world.props.present]
    assert len(props) == 6
    for prop in props:
        assert np.hypot(world.vehicles.x - prop.x, world.vehicles.y - prop.y).min() > PROP_CLEARANCE
    assert crowd(network, arrays, vehicles=40, pedestrians=5, props=6, seed=1).tobytes() == world.tobytes()


def test_memory_of_one_more_world_is_little_more_than_its_arrays() -> None:
    network = TownNetwork(load_town("brookside"))
    world = crowd(network, town_arrays(network), vehicles=5, pedestrians=5, props=0, seed=0)
    assert world.nbytes < bytes_per_world(world) < world.nbytes + 16_384


def test_stock_road_has_the_same_lanes_and_vehicles() -> None:
    network = TownNetwork(load_town("brookside"))
    world = crowd(network, town_arrays(network), vehicles=6, pedestrians=5, props=0, seed=3)
    road = stock_road(network, world)
    assert len(road.vehicles) == 6
    lanes = [lane for ends in road.network.graph.values() for between in ends.values() for lane in between]
    assert len(lanes) == len(network.town.lanes)
    for vehicle, row in zip(road.vehicles, world.vehicles, strict=True):
        assert vehicle.position.tolist() == [row.x, row.y] and vehicle.target_speed == row.desired
        assert network.lanes_dict()[vehicle.lane_index].town_lane.id == row.lane
    before = [vehicle.position.copy() for vehicle in road.vehicles]
    run_stock(road, 3, 1 / 30)
    moved = [np.hypot(*(vehicle.position - place)) for vehicle, place in zip(road.vehicles, before, strict=True)]
    assert max(moved) > 0.0


@pytest.mark.parametrize("town", ["brookside", "northgate"])
def test_stock_lanes_follow_those_of_the_town(town: str) -> None:
    for lane in load_town(town).lanes[::7]:
        stock = stock_lane(lane)
        assert stock.length == pytest.approx(lane.length, rel=0.01, abs=0.1)
        for share in (0.0, 0.5, 1.0):
            here = np.asarray(stock.position(share * stock.length, 0.0))
            assert np.hypot(*(here - lane.position(share * lane.length))) < 0.3
