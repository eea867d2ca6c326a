import numpy as np
import pytest

from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_vehicle
from dorothie_gym.sim.randomness import POOL, begin_stream, choose, draw, draw_normal, draw_share, seed_of, seed_stream
from dorothie_gym.sim.state.records import LocalizerRecord
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import empty_records
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


@compiled
def fill_shares(stream, first, second, pool, numbers):
    seed_stream(stream, first, second, pool)
    for k in range(len(numbers)):
        numbers[k] = draw_share(stream)


def test_seeded_streams_are_those_of_numpy():
    pool, drawn, stream = np.zeros(POOL, dtype=np.int64), np.empty(20), empty_records(LocalizerRecord, 1)[0]
    numbers = np.random.default_rng(1).integers(0, 1 << 32, (500, 2)).tolist()
    for first, second in [(0, 0), (1, 0), ((1 << 32) - 1, (1 << 32) - 1), *numbers]:
        fill_shares(stream, first, second, pool, drawn)
        assert drawn.tobytes() == np.random.default_rng((first, second)).random(20).tobytes()
    plain = getattr(seed_stream, "py_func", seed_stream)
    other = empty_records(LocalizerRecord, 1)[0]
    plain(other, first, second, pool)
    seed_stream(stream, first, second, pool)
    assert other == stream


@compiled
def fill(stream, numbers):
    for k in range(len(numbers)):
        numbers[k] = draw_normal(stream)


@pytest.mark.parametrize("seed", [0, 1, 2, 2**31 - 1, 2**63])
def test_normal_numbers_are_those_of_numpy(seed):
    generator = np.random.default_rng(seed)
    generator.standard_normal(seed % 7)
    stream = empty_records(LocalizerRecord, 1)[0]
    begin_stream(stream, generator)
    for count in (1, 6, 1_000_000):  # one in 4,000 lies in the tail
        drawn = np.empty(count)
        fill(stream, drawn)
        assert drawn.tobytes() == generator.standard_normal(count).tobytes()
    assert np.abs(drawn).max() > 4.0
    state = generator.bit_generator.state["state"]
    assert (int(stream.state_high) << 64) + int(stream.state_low) == state["state"]


def test_normal_numbers_are_the_same_in_plain_python():
    generator, stream = np.random.default_rng(3), empty_records(LocalizerRecord, 1)[0]
    begin_stream(stream, generator)
    plain = getattr(draw_normal, "py_func", draw_normal)
    assert [plain(stream) for _ in range(200)] == generator.standard_normal(200).tolist()


def test_generators_of_other_kinds_have_no_stream():
    with pytest.raises(TypeError, match="PCG64, not MT19937"):
        begin_stream(empty_records(LocalizerRecord, 1)[0], np.random.Generator(np.random.MT19937(0)))
