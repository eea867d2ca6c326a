"""Memory of a world beside the others of its town."""

from __future__ import annotations

import gc
import tracemalloc

import numpy as np
import pytest

from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.population import populate
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.world import World
from tests.sim.driving import long_lane, network

KIB = 1024
WORLDS = 8
CROWD = WorldConfig(vehicles=30, pedestrians=20)


def world(seed: int) -> World:
    roads = network("northgate")
    departure = long_lane(roads.town, 60.0), 5.0
    return World(roads.town, CROWD, seed=np.random.SeedSequence(seed), departure=departure, network=roads)


def traced(make: object, count: int) -> float:
    """Memory that each of some worlds takes when others are there already [bytes]."""
    assert callable(make)
    kept = [make(seed) for seed in range(2)]
    gc.collect()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        kept += [make(2 + seed) for seed in range(count)]
        gc.collect()
        return (tracemalloc.get_traced_memory()[0] - before) / count
    finally:
        tracemalloc.stop()


@pytest.mark.long
def test_another_world_of_traffic_takes_less_than_48_kib() -> None:
    roads = network("northgate")
    arrays = town_arrays(roads)

    def make(seed: int) -> object:
        made = empty_world(arrays, vehicles=30, pedestrians=20, seed=seed)
        populate(roads, arrays, made, seed=seed, vehicles=30, pedestrians=20)
        return made

    assert 20 * KIB < traced(make, WORLDS) < 48 * KIB


def test_another_world_of_a_session_takes_less_than_80_kib_in_arrays_and_112_in_all() -> None:
    assert world(0).actors.arrays.nbytes < 80 * KIB
    assert traced(world, WORLDS) < 112 * KIB
