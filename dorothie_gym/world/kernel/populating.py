"""Traffic and people for an empty town."""

from __future__ import annotations

import numpy as np

from dorothie_gym.world.kernel.editing import add_pedestrian, add_vehicle
from dorothie_gym.world.kernel.footways import place_beside
from dorothie_gym.world.kernel.parameters import (
    CLEAR_OF_CAR,
    CLEAR_OF_WALKER,
    CYCLIST_SHARE,
    CYCLIST_SPEEDS,
)
from dorothie_gym.world.kernel.records import NOBODY, PEDESTRIAN, Footway, Kind, Walk
from dorothie_gym.world.kernel.towing import is_clear_of_people, is_free
from dorothie_gym.world.kernel.town_arrays import TownArrays
from dorothie_gym.world.kernel.world_arrays import WorldArrays
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.places import free_places

SPEEDS = 6.5, 10.0
"""Range of the speeds that drivers like [m/s]."""

PACES = 1.1, 1.6
"""Range of the speeds that pedestrians like [m/s] (Knoblauch et al. 1996 measured 1.2 to 1.5 at crosswalks)."""

TRIES = 40
"""Places that are drawn for each vehicle and each pedestrian."""


def populate(
    network: TownNetwork, town: TownArrays, world: WorldArrays, *, seed: int, vehicles: int, pedestrians: int,
    cyclists: float = CYCLIST_SHARE,
) -> None:  # fmt: skip
    """Brings traffic and pedestrians to random places, as many as fit; none of them close to the car.

    Args:
        network: of the town.
        town: its arrays.
        world: arrays of the world; a car, if there is one, is the first of its vehicles.
        seed: of the places and of what everybody likes.
        vehicles: how many, cyclists included.
        pedestrians: how many; on pavements, or in a town without them beside the streets.
        cyclists: share of the vehicles; they ride to the right on slow roads.
    """
    rng = np.random.default_rng(seed)
    _add_traffic(network, town, world, rng, vehicles, cyclists)
    _add_people(town, world, rng, pedestrians)


def _add_traffic(
    network: TownNetwork, town: TownArrays, world: WorldArrays, rng: np.random.Generator, vehicles: int, cyclists: float
) -> None:
    room = min(vehicles, int((world.vehicles.kind == Kind.EMPTY).sum()))
    rideable = town.lanes.cycling & (town.lanes.right < 0) & (town.lanes.junction < 0)
    kinds = np.where(rng.random(room) < cyclists * rideable.any(), Kind.CYCLIST, Kind.CAR)
    count = 0
    for lane, station in free_places(network.town, rng, TRIES * vehicles):
        if count == room:
            return
        kind = Kind(kinds[count])
        if kind is Kind.CYCLIST and not rideable[lane]:
            continue
        if is_free(town, world, lane, station, int(NOBODY), CLEAR_OF_CAR):
            speeds = CYCLIST_SPEEDS if kind is Kind.CYCLIST else SPEEDS
            add_vehicle(town, world, lane, station, kind=kind, desired=float(rng.uniform(*speeds)))
            count += 1


def _add_people(town: TownArrays, world: WorldArrays, rng: np.random.Generator, pedestrians: int) -> None:
    lengths = np.where(town.walks.kind == Footway.PAVEMENT, town.walks.length, 0.0)
    if not lengths.any():
        lengths = np.where(town.walks.kind == Footway.STREET, town.walks.length, 0.0)
    room = min(pedestrians, int((world.pedestrians.state == Walk.EMPTY).sum()))
    if room == 0 or not lengths.any():
        return
    count = 0
    place = np.zeros(1, dtype=PEDESTRIAN).view(np.recarray)[0]
    place.direction = 1.0
    for walk in rng.choice(len(lengths), size=TRIES * room, p=lengths / lengths.sum()):
        if count == room:
            return
        place.walk, place.station = walk, rng.uniform(0.0, lengths[walk])
        x, y, _, _ = place_beside(town, place, float(place.station), 0.0)
        if is_clear_of_people(world, x, y, int(NOBODY), CLEAR_OF_WALKER):
            add_pedestrian(town, world, int(walk), float(place.station), pace=float(rng.uniform(*PACES)))
            count += 1
