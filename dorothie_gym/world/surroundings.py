"""Who is around the vehicle that an agent drives when an episode begins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.kernel import Kind, Walk, WorldArrays, populate, town_arrays
from dorothie_gym.world.kernel.order import rebuild
from dorothie_gym.world.network.network import TownNetwork

CLEAR_OF_EGO = 25.0
"""At the start nobody is closer to the vehicle than this [m]."""

ROUNDS = 8
"""So many times others are brought to places in lieu of those who were too close."""

SEEDS = 2**31
"""Seeds of what is drawn in the arrays are less than this."""


def populate_around(
    network: TownNetwork, world: WorldArrays, rng: np.random.Generator, *, vehicles: int, pedestrians: int
) -> None:
    """Brings others to random places, as many as fit and none close to the first vehicle of a world.

    Args:
        network: of the town.
        world: arrays of the world; its first vehicle is there already.
        rng: of the places.
        vehicles: how many others.
        pedestrians: how many people on foot.
    """
    town = town_arrays(network)
    ego, bodies = world.vehicles[0], (world.vehicles[1:], world.pedestrians)
    for _ in range(ROUNDS):
        there = _counts(world)
        missing = np.array((vehicles + 1, pedestrians)) - there
        if not missing.any():
            break
        seed = int(rng.integers(SEEDS))
        populate(network, town, world, seed=seed, vehicles=int(missing[0]), pedestrians=int(missing[1]))
        if (_counts(world) == there).all():
            break  # the town is full
        for records, field, nobody in zip(bodies, ("kind", "state"), (Kind.EMPTY, Walk.EMPTY), strict=True):
            close = np.hypot(records.x - ego.x, records.y - ego.y) < CLEAR_OF_EGO
            records[field][close] = nobody
    rebuild(town, world)


def _counts(world: WorldArrays) -> NDArray[np.int64]:
    """How many vehicles and pedestrians there are (2,)."""
    return np.array(((world.vehicles.kind != Kind.EMPTY).sum(), (world.pedestrians.state != Walk.EMPTY).sum()))
