"""Cars on their own, and worlds without others, to test driving with."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import PropKind
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig
from dorothie_gym.sim.ego.ego_controller import Car, LocalPlanner
from dorothie_gym.sim.network.network import TownNetwork, network_of
from dorothie_gym.sim.traffic_rules import WorldEvent
from dorothie_gym.sim.world import World

MAPS = Path(__file__).resolve().parents[2] / "../shared/maps"
ALONE = WorldConfig(vehicles=0, pedestrians=0)


@lru_cache(maxsize=4)
def network(name: str) -> TownNetwork:
    """A town by its name, or by that of a map that is there on some machines only."""
    if not name.startswith("Town"):
        return TownNetwork(load_town(name))
    file = MAPS / f"{name}.xodr"
    if not file.exists():
        pytest.skip(f"the map {name}.xodr is not on this machine")
    return TownNetwork(load_town(file))


class Trip(NamedTuple):
    """A drive: how far the car came off its path at most [m], and whether it came to where it was to come."""

    world: World
    worst: float
    arrived: bool

    @property
    def planner(self) -> LocalPlanner:
        return self.world.planner

    @property
    def car(self) -> Car:
        return self.world.car


@lru_cache(maxsize=4)
def without_signs(town: TownNetwork) -> TownNetwork:
    """The same lanes without lights and signs."""
    bare = copy(town.town)
    bare.signals = bare.programmes = ()
    return TownNetwork(bare)


def on_lane(town: TownNetwork, lane: int, station: float) -> World:
    """A car alone on a lane of a town where no light and no sign stops it."""
    roads = without_signs(town)
    return World(roads.town, ALONE, seed=np.random.SeedSequence(1), departure=(lane, station), network=roads)


def planner_on(town: Town, lane: int, station: float) -> LocalPlanner:
    """The planner of a car that stands on a lane of a town."""
    return on_lane(network_of(town), lane, station).planner


def drive(world: World, until: Callable[[], bool], seconds: float = 60.0) -> Trip:
    """Drives until something holds, looked at every frame."""
    worst = 0.0
    for _ in range(round(seconds * FRAME_RATE)):
        world.step(1)
        worst = max(worst, abs(world.planner.offset))
        if until():
            return Trip(world, worst, True)
    return Trip(world, worst, False)


def off_centre(town: Town, lane: int, car: Car) -> float:
    """Distance of a car from the centre line of a lane [m]."""
    return abs(town.lanes[lane].project(np.asarray(car.position))[1])


def world_at(name: str, lane: int, station: float, config: WorldConfig = ALONE, seed: int = 1) -> World:
    roads = network(name)
    return World(roads.town, config, seed=np.random.SeedSequence(seed), departure=(lane, station), network=roads)


def run(world: World, seconds: float, until: Callable[[], bool] = lambda: False) -> list[WorldEvent]:
    """Lets a world run by decisions of half a second; returns its events."""
    events: list[WorldEvent] = []
    for _ in range(round(2 * seconds)):
        events += world.step(15)
        if until():
            break
    return events


def long_lane(town: Town, least: float = 110.0) -> int:
    """A lane of some length outside junctions."""
    return next(lane.id for lane in town.lanes if not lane.in_junction and lane.length > least)


PROPS = tuple(PropKind)
