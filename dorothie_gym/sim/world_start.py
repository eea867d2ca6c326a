"""Start of a world in its arrays: the ego on its first path, traffic, pedestrians, and the localizer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.sim.config import FRAME_RATE, AutomaticBraking, WorldConfig
from dorothie_gym.sim.ego.ego_controller import request_path
from dorothie_gym.sim.ego.limits import cruise_by_limit
from dorothie_gym.sim.ego.manoeuvres import BEGIN
from dorothie_gym.sim.population import add_car, populate
from dorothie_gym.sim.sensing.localizer import switch_on
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.state.world_arrays import empty_world, sow
from dorothie_gym.support.compilation.records import plain

if TYPE_CHECKING:
    from dorothie_gym.sim.network.network import TownNetwork
    from dorothie_gym.sim.state.record_views import ArrayHolder

POPULATION_SEEDS = 1 << 62
"""Upper bound of the seeds of populations."""


class WorldSeeds(NamedTuple):
    """Seeds of the random numbers of a world: of its bodies, their places, localizer, perception and wind."""

    bodies: np.random.SeedSequence
    crowd: np.random.SeedSequence
    localizer: np.random.SeedSequence
    perception: np.random.SeedSequence
    wind: np.random.SeedSequence

    def places(self) -> tuple[np.random.Generator, int]:
        """Returns the generator of the places of actors, and the first of its numbers: the population's seed."""
        generator = np.random.default_rng(self.crowd)
        return generator, int(generator.integers(POPULATION_SEEDS))


def lane_km(network: TownNetwork) -> float:
    """Returns the length of the lanes of a town outside junctions [km]."""
    return sum(lane.length for lane in network.town.lanes if not lane.in_junction) / 1000.0


class OwnArrays:
    """Holder of the arrays of a world that starts.

    Attributes:
        arrays: the arrays, replaced where the first path needs more room.
    """

    def __init__(self, network: TownNetwork, config: WorldConfig) -> None:
        """Makes the arrays of an empty world."""
        vehicles, pedestrians = config.crowd(lane_km(network))
        self.arrays = empty_world(
            town_arrays(network), vehicles=1 + vehicles, pedestrians=pedestrians, props=0, driven=True
        )


def start_world(
    network: TownNetwork, holder: ArrayHolder, config: WorldConfig, seeds: WorldSeeds, departure: tuple[int, float]
) -> None:
    """Starts an empty world.

    Args:
        network: network of the town.
        holder: owner of the arrays of the world, with room for its bodies.
        config: settings.
        seeds: seeds of its random numbers.
        departure: lane and distance along it [m] of the ego.
    """
    town, (lane, station) = town_arrays(network), departure
    sow(holder.arrays, seeds.bodies)
    add_car(town, holder.arrays, lane, station)
    car = plain(holder.arrays.car)
    car["collision_stop"] = round(config.collisions_stop * FRAME_RATE)
    car["attentive"] = config.braking is AutomaticBraking.PERCEIVED
    car["attention"] = round(config.braking_delay * FRAME_RATE)
    request_path(town, holder, BEGIN, lane=lane, station=station)
    plan = plain(holder.arrays.plan)
    follows = network.town.cruise is None and config.cruise_speed == WorldConfig.cruise_speed
    plan["cruise"] = cruise_by_limit(network.town.lanes[lane].speed_limit) if follows else config.cruise_speed
    plan["follows"] = follows
    vehicles, pedestrians = config.crowd(lane_km(network))
    populate(network, town, holder.arrays, seed=seeds.places()[1], vehicles=vehicles, pedestrians=pedestrians)
    switch_on(holder.arrays, np.random.default_rng(seeds.localizer))
