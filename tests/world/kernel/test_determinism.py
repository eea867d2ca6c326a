"""The same bytes: compiled or not, in one call or in many, alone or among others, in this process or another."""

import os
import subprocess
import sys

import pytest

from dorothie_gym.world.kernel import empty_world, populate, step, town_arrays
from dorothie_gym.world.network.network import TownNetwork
from tests.world.kernel.states import DT
from tests.world.network.towns import find_town

TEN_SECONDS = """
import hashlib
from dorothie_gym.ontology import PropKind
from dorothie_gym.world.kernel import Walk, add_prop, add_street_walker, empty_world, populate, step, town_arrays
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.town import load_town
network = TownNetwork(load_town("brookside"))
town = town_arrays(network)
world = empty_world(town, vehicles=8, pedestrians=6, seed=5)
populate(network, town, world, seed=5, vehicles=8, pedestrians=4, cyclists=0.2)
add_prop(network, town, world, PropKind.STREET_BARRIER, 0, 20.0)
for lane in (0, 5):
    walker = world.pedestrians[add_street_walker(network, town, world, lane, 30.0)]
    walker.state, walker.far = Walk.STRAYING, 10.2
world.vehicles[1].crashed = world.pedestrians[0].crashed = True  # who comes back elsewhere
step(town, world, 300, 1 / 30)
assert world.vehicles.odometer.max() > 30.0
print(hashlib.sha256(world.tobytes()).hexdigest())
"""


def crowd(name="brookside", seed=3):
    network = TownNetwork(find_town(name))
    town = town_arrays(network)
    world = empty_world(town, vehicles=20, pedestrians=10, seed=seed)
    populate(network, town, world, seed=seed, vehicles=20, pedestrians=10)
    return town, world


def run(disabled):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
    return subprocess.run([sys.executable, "-c", TEN_SECONDS], env=environment, capture_output=True, text=True)


def test_ten_seconds_are_the_same_bytes_compiled_and_in_plain_python():
    compiled, plain = run("0"), run("1")
    assert compiled.returncode == plain.returncode == 0, compiled.stderr + plain.stderr
    assert compiled.stdout == plain.stdout


def test_one_long_call_is_many_short_ones():
    town, world = crowd()
    other = world.copy()
    step(town, world, 450, DT)
    for _ in range(30):
        step(town, other, 15, DT)
    assert world.tobytes() == other.tobytes()


def test_worlds_do_not_know_of_one_another():
    town, world = crowd(seed=1)
    alone = world.copy()
    _, other = crowd(seed=2)
    for _ in range(10):
        step(town, other, 15, DT)
        step(town, world, 15, DT)
    step(town, alone, 150, DT)
    assert world.tobytes() == alone.tobytes() != other.tobytes()


@pytest.mark.parametrize("seed", [1, 2])
def test_a_seed_gives_the_same_world(seed):
    (town, world), (_, other) = crowd(seed=seed), crowd(seed=seed)
    step(town, world, 30, DT)
    step(town, other, 30, DT)
    assert world.tobytes() == other.tobytes()


def test_further_worlds_take_less_than_64_kib():
    network = TownNetwork(find_town("millbrook"))
    assert empty_world(town_arrays(network), vehicles=31, pedestrians=20).nbytes <= 64 * 1024
