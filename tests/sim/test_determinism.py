"""The same bytes: compiled or not, in one call or in many, alone or among others, in this process or another."""

import numpy as np
import pytest

from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import populate
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.world import World
from tests.plain_python import printed_compiled_and_plain
from tests.sim.network.towns import find_town
from tests.sim.state.states import DT

TEN_SECONDS = """
import hashlib
from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.population import add_prop, add_street_walker, populate
from dorothie_gym.sim.state.codes import Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.maps import load_town
network = TownNetwork(load_town("brookside"))
town = town_arrays(network)
world = empty_world(town, vehicles=8, pedestrians=6, seed=5)
populate(network, town, world, seed=5, vehicles=8, pedestrians=4, cyclists=0.2)
add_prop(network, town, world, PropKind.STREET_BARRIER, 0, 20.0)
for lane in (0, 5):
    walker = world.pedestrians[add_street_walker(network, town, world, lane, 30.0)]
    walker.state, walker.far = Walk.STRAYING, 10.2
world.vehicles[1].crashed = world.pedestrians[0].crashed = True  # who comes back elsewhere
step_alone(town, world, 300, 1 / 30)
assert world.vehicles.odometer.max() > 30.0
print(hashlib.sha256(world.tobytes()).hexdigest())
"""

TEN_SECONDS_OF_A_SESSION = """
import numpy as np
from dorothie_gym.ontology import PhysicalAction, PropKind, Sensor, WeatherParameter
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.world import World
site = network.town.sites[16]
session = World(
    network.town, WorldConfig(vehicles=4, pedestrians=3), seed=np.random.SeedSequence(7),
    departure=(site.lane, site.station), network=network,
)
session.weather.set_share(WeatherParameter.PRECIPITATION, 0.6)
session.weather.set_share(WeatherParameter.WIND_INTENSITY, 0.8)
session.weather.set(WeatherParameter.SUN_ALTITUDE_ANGLE, -30.0)
session.ego.lights = True
session.set_fault(Sensor.GPS, True)
session.actors.add_pedestrian(session.planner.lane, session.planner.station + 15.0)
session.actors.add_prop(PropKind.STREET_BARRIER, session.planner.lane, session.planner.station + 60.0)
found, events = hashlib.sha256(), []
for decision in range(20):
    if decision == 12:
        assert session.planner.command(PhysicalAction.U_TURN, 0, float(session.car.speed)) is None
    events += session.step(15)
    for seen in (session.frames, session.offsets, session.seen(), session.localizer.pose, session.localizer.covariance):
        found.update(seen.tobytes())
found.update(repr(events).encode() + session.actors.arrays.tobytes())
assert session.actors.arrays.vehicles.odometer[0] > 25.0 and len(events) > 0 and len(session.seen()) > 1
print(found.hexdigest())
"""


def crowd(name="brookside", seed=3):
    network = TownNetwork(find_town(name))
    town = town_arrays(network)
    world = empty_world(town, vehicles=20, pedestrians=10, seed=seed)
    populate(network, town, world, seed=seed, vehicles=20, pedestrians=10)
    return town, world


@pytest.mark.long
def test_ten_seconds_are_the_same_bytes_compiled_and_in_plain_python_in_another_process():
    compiled, plain = printed_compiled_and_plain(TEN_SECONDS + TEN_SECONDS_OF_A_SESSION)
    assert compiled.split() == plain.split()
    assert len(plain.split()) == 2


def test_one_long_call_equals_many_short_ones():
    town, world = crowd()
    other = world.copy()
    step_alone(town, world, 450, DT)
    for _ in range(30):
        step_alone(town, other, 15, DT)
    assert world.tobytes() == other.tobytes()


def test_worlds_are_independent():
    town, world = crowd(seed=1)
    alone = world.copy()
    _, other = crowd(seed=2)
    for _ in range(10):
        step_alone(town, other, 15, DT)
        step_alone(town, world, 15, DT)
    step_alone(town, alone, 150, DT)
    assert world.tobytes() == alone.tobytes() != other.tobytes()


@pytest.mark.parametrize("seed", [1, 2])
def test_a_seed_gives_the_same_world(seed):
    (town, world), (_, other) = crowd(seed=seed), crowd(seed=seed)
    step_alone(town, world, 30, DT)
    step_alone(town, other, 30, DT)
    assert world.tobytes() == other.tobytes()


def test_further_worlds_take_less_than_64_kib():
    network = TownNetwork(find_town("millbrook"))
    assert empty_world(town_arrays(network), vehicles=31, pedestrians=20).nbytes <= 64 * 1024


@pytest.mark.parametrize("name", ["brookside", "midtown", "millbrook", "northgate"])
def test_arrays_of_further_sessions_take_less_than_112_kib(name):
    network = TownNetwork(find_town(name))
    site, config = network.town.sites[0], WorldConfig(vehicles=30, pedestrians=20)
    session = World(
        network.town, config, seed=np.random.SeedSequence(1), departure=(site.lane, site.station), network=network
    )
    arrays = session.actors.arrays
    assert len(arrays.vehicles) == 31 and len(arrays.pedestrians) == 20 and len(arrays.sweeps) > 100
    assert arrays.nbytes <= 112 * 1024
