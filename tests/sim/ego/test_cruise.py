"""Cruise speed without a request: that of the town, or the limit of the lane."""

from pathlib import Path

import numpy as np

from dorothie_gym.maps import load_town
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.network.network import network_of
from dorothie_gym.sim.world import World
from tests.maps.ending_lanes import ring

EMPTY = WorldConfig(vehicles=0, pedestrians=0)


def world_on(path: str | Path, config: WorldConfig = EMPTY, lane: int = 0) -> World:
    town = load_town(path)
    return World(town, config, seed=np.random.SeedSequence(1), departure=(lane, 10.0), network=network_of(town))


def test_shipped_towns_keep_their_cruise_speed() -> None:
    for name in ("brookside", "northgate"):
        town = load_town(name)
        fast = max(town.lanes, key=lambda lane: (lane.speed_limit, lane.length))
        world = world_on(name, lane=fast.id)
        world.step(60)
        assert world.ego.cruise == 40.0


def test_car_drives_as_fast_as_the_lane_allows(tmp_path: Path) -> None:
    world = world_on(ring(tmp_path / "ring.xodr"))
    assert world.ego.cruise == 50.0
    speeds = []
    for _ in range(40):
        world.step(15)
        speeds.append(world.car.speed)
    assert 12.0 < max(speeds) < 50.0 / 3.6 + 0.5


def test_speed_that_is_set_counts(tmp_path: Path) -> None:
    world = world_on(ring(tmp_path / "ring.xodr"))
    assert world.ego.apply(PhysicalAction.SPEED_CHANGE, up=False) is None
    world.step(60)
    assert world.ego.cruise == 45.0
    assert (
        world_on(tmp_path / "ring.xodr", WorldConfig(vehicles=0, pedestrians=0, cruise_speed=20.0)).ego.cruise == 20.0
    )
