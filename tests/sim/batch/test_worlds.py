"""Many worlds in one set of arrays, stepped by several threads."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from dorothie_gym.sim.batch.worlds import VectorWorld, step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_vehicle, populate
from dorothie_gym.sim.state.codes import Kind
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.support.processors import available_processors
from tests.sim.network.towns import find_town

DT = 1.0 / 30.0
SUBSTEPS = 60


@functools.cache
def network() -> TownNetwork:
    return TownNetwork(find_town("brookside"))


def town() -> TownArrays:
    return town_arrays(network())


def crowd(seed: int) -> WorldArrays:
    """A world with an ego, traffic and people."""
    world = empty_world(town(), vehicles=9, pedestrians=4, seed=seed)
    add_vehicle(town(), world, seed % 4, 12.0, kind=Kind.EGO, desired=0.0)
    populate(network(), town(), world, seed=seed, vehicles=8, pedestrians=4)
    return world


def batch(seeds: list[int], threads: int | None) -> VectorWorld:
    worlds = VectorWorld(town(), crowd(seeds[0]), len(seeds), threads=threads)
    for number, seed in enumerate(seeds):
        worlds.put(number, crowd(seed))
    return worlds


def throttle(seed: int) -> float:
    return 0.3 + 0.1 * seed


@functools.cache
def alone(seed: int) -> bytes:
    """State of a world that is stepped by itself."""
    world = crowd(seed)
    step_alone(town(), world, SUBSTEPS, DT, throttle(seed), 0.01 * seed)
    return world.tobytes()


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("count", range(1, 8))
def test_every_world_evolves_as_a_single_world(threads: int, count: int) -> None:
    seeds = list(range(count))
    worlds = batch(seeds, threads)
    worlds.step(SUBSTEPS, DT, np.array([throttle(seed) for seed in seeds]), np.array([0.01 * seed for seed in seeds]))
    assert worlds.threads == min(threads, count)
    assert [worlds.world(k).tobytes() for k in range(count)] == [alone(seed) for seed in seeds]
    assert len({alone(seed) for seed in seeds}) == count


def test_the_place_in_the_batch_does_not_matter() -> None:
    seeds = [int(seed) for seed in np.random.default_rng(0).permutation(7)]
    worlds = batch(seeds, 2)
    for _ in range(4):
        worlds.step(
            SUBSTEPS // 4, DT, np.array([throttle(seed) for seed in seeds]), np.array([0.01 * seed for seed in seeds])
        )
    assert [worlds.world(k).tobytes() for k in range(7)] == [alone(seed) for seed in seeds]


def test_one_action_is_for_all_egos() -> None:
    worlds = batch([1, 2], 1)
    worlds.step(30, DT, acceleration=2.0)
    assert worlds.arrays.vehicles.speed[:, 0] == pytest.approx([2.0, 2.0])


def test_a_world_can_be_replaced_between_steps() -> None:
    worlds, other = batch([1, 2, 3], 2), batch([1, 2, 3], 2)
    worlds.step(30, DT)
    other.step(30, DT)
    worlds.put(1, crowd(5))
    assert worlds.world(1).tobytes() == crowd(5).tobytes()
    assert [worlds.world(k).tobytes() for k in (0, 2)] == [other.world(k).tobytes() for k in (0, 2)]


def test_a_world_with_other_array_sizes_is_refused() -> None:
    with pytest.raises(ValueError, match=r"vehicles of the shape \(9,\), this one \(3,\)"):
        batch([1], 1).put(0, empty_world(town(), vehicles=3, pedestrians=4))


@pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros((2, 1))])
def test_actions_are_one_for_each_world(wrong: np.ndarray) -> None:
    with pytest.raises(ValueError, match="steering must be one number or 2 numbers"):
        batch([1, 2], 1).step(1, DT, 0.0, wrong)


@pytest.mark.parametrize("broken", [0, 3])
def test_an_error_in_one_share_is_raised_when_all_have_finished(broken: int) -> None:
    worlds = batch([0, 1, 2, 3], 2)
    worlds.arrays.vehicles.x[broken, 0] = np.nan
    worlds.arrays.vehicles.speed[broken, 0] = 1.0
    with pytest.raises(ValueError, match="nowhere"):
        worlds.step(30, DT)
    intact = [k for k in range(4) if k // 2 != broken // 2]
    assert (worlds.arrays.clock.frame[intact] == 30).all()


@pytest.mark.parametrize(("worlds", "threads", "words"), [(0, None, "worlds"), (1, 0, "threads")])
def test_at_least_one_world_and_thread(worlds: int, threads: int | None, words: str) -> None:
    with pytest.raises(ValueError, match=f"{words} must be at least 1"):
        VectorWorld(town(), crowd(0), worlds, threads=threads)


def test_there_are_as_many_threads_as_processors() -> None:
    worlds = batch([0] * (available_processors() + 1), None)
    assert worlds.threads == available_processors()
    worlds.close()


def test_negative_numbers_count_from_the_end() -> None:
    worlds = batch([1, 2], 1)
    assert worlds.world(-1).tobytes() == crowd(2).tobytes()
    with pytest.raises(IndexError):
        worlds.world(2)
