import numpy as np

from dorothie_gym.world.kernel import add_vehicle, empty_world, town_arrays
from dorothie_gym.world.kernel.randomness import choose, draw
from dorothie_gym.world.network.network import TownNetwork
from tests.world.network.towns import straight_town


def body(seed: int):
    arrays = town_arrays(TownNetwork(straight_town()))
    world = empty_world(arrays, vehicles=1, pedestrians=0, seed=seed)
    add_vehicle(arrays, world, 0, 20.0, desired=8.0)
    return world.vehicles[0]


def test_numbers_are_marsaglias():
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
