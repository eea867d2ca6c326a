import numpy as np

from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_vehicle
from dorothie_gym.sim.randomness import POOL, choose, draw, seed_of
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from tests.sim.network.towns import straight_town


def body(seed: int):
    arrays = town_arrays(TownNetwork(straight_town()))
    world = empty_world(arrays, vehicles=1, pedestrians=0, seed=seed)
    add_vehicle(arrays, world, 0, 20.0, desired=8.0)
    return world.vehicles[0]


def test_random_numbers_follow_marsaglia():
    one = body(3)
    state = int(one.random)
    for _ in range(1000):
        state ^= state << 13 & 0xFFFFFFFF
        state ^= state >> 17
        state ^= state << 5 & 0xFFFFFFFF
        assert draw(one) == state / 2**32
        assert one.random == state


def test_choices_are_even_and_differ_by_seed():
    one, other = body(1), body(2)
    chosen = np.array([choose(one, 5) for _ in range(10_000)])
    assert (np.abs(np.bincount(chosen, minlength=5) - 2000) < 200).all()
    assert [choose(other, 1000) for _ in range(5)] != [choose(one, 1000) for _ in range(5)]


def test_seeds_are_those_of_numpy():
    pool = np.zeros(POOL, dtype=np.int64)
    numbers = np.random.default_rng(0).integers(0, 1 << 32, (500, 2)).tolist()
    for first, second in [(0, 0), (1, 0), ((1 << 32) - 1, (1 << 32) - 1), *numbers]:
        assert seed_of(first, second, pool) == np.random.SeedSequence((first, second)).generate_state(1)[0]
