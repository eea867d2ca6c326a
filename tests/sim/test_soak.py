"""A crowd for ten minutes: no body gets lost or stuck, and none collide."""

import numpy as np
import pytest

from dorothie_gym.maps import LightColour
from dorothie_gym.sim.batch.worlds import step_alone
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.population import add_street_walker, populate
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world
from tests.sim.crossings import lit
from tests.sim.network.towns import find_town
from tests.sim.state.states import DT

OFF = 2.5
"""Farther from the middle of the closest lane than this a vehicle has left the road [m]."""


def soak(name, *, minutes, seed, vehicles=60, pedestrians=40, strollers=20, everywhere_lights=False):
    network = TownNetwork(lit(find_town(name)) if everywhere_lights else find_town(name))
    town, lights = town_arrays(network), network.town.light
    world = empty_world(town, vehicles=vehicles, pedestrians=pedestrians + strollers, seed=seed)
    populate(network, town, world, seed=seed, vehicles=vehicles, pedestrians=pedestrians)
    for lane in np.flatnonzero(town.lanes.junction < 0).tolist():
        add_street_walker(network, town, world, lane, 0.4 * float(town.lanes[lane].length))
    there = world.vehicles.kind != Kind.EMPTY
    assert there.sum() > 0.7 * vehicles
    fleet, lengths, signalled = world.vehicles, town.lanes.length, town.lanes.programme >= 0
    before, runs, farthest = np.zeros(vehicles, dtype=bool), 0, 0.0
    for _ in range(round(minutes * 60 / DT)):
        step_alone(town, world, 1, DT)
        over = there & signalled[fleet.lane] & (fleet.own_station + 0.5 * fleet.length > lengths[fleet.lane])
        for i in np.flatnonzero(over & ~before & ~fleet.crashed):
            runs += lights(int(fleet.lane[i]), float(world.clock[0].time)) is LightColour.RED
        before = over
        farthest = max(farthest, float(np.abs(fleet.own_lateral[there]).max()))
    assert np.isfinite(fleet.x).all() and np.isfinite(fleet.speed).all()
    assert farthest < OFF
    assert fleet.odometer[there].min() >= 50.0
    walkers = world.pedestrians[world.pedestrians.state != Walk.EMPTY]
    assert len(walkers) == 0 or walkers.odometer.min() > 50.0
    assert runs == 0
    assert world.clock[0].towed <= 1 + world.clock[0].collisions * 2  # no gridlock, and few lose patience
    return int(world.clock[0].collisions), int(world.clock[0].run_over)


@pytest.mark.long
@pytest.mark.parametrize("name", ["brookside", "millbrook", "midtown", "northgate", "Town02.xodr"])
def test_no_body_gets_stuck_or_crashes_in_two_minutes(name):
    assert soak(name, minutes=2, seed=6, vehicles=40) == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["brookside", "Town02.xodr", "Town05.xodr"])
def test_lights_at_every_junction_make_no_gridlock_in_ten_minutes(name):
    collisions, run_over = soak(name, minutes=10, seed=6, vehicles=30, everywhere_lights=True)
    assert collisions <= 1 and run_over <= 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    "name", ["brookside", "millbrook", "midtown", "northgate", "Town01.xodr", "Town02.xodr", "Town05.xodr"]
)
def test_a_crowd_drives_for_ten_minutes(name, seed):
    collisions, run_over = soak(name, minutes=10, seed=seed)
    assert collisions <= 1 and run_over <= 1
