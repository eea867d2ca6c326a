"""Everybody and everything on the road besides the car: traffic, pedestrians, props."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dorothie_gym.ontology import PropKind
from dorothie_gym.world.bodies import Pedestrian, Prop, TrafficVehicle
from dorothie_gym.world.kernel import (
    Kind,
    TownArrays,
    Walk,
    WorldArrays,
    add_pedestrian,
    add_prop,
    add_vehicle,
    remove_prop,
)
from dorothie_gym.world.kernel.world_arrays import SPEEDS
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.pedestrians import KERB
from dorothie_gym.world.places import free_places
from dorothie_gym.world.town.model import Array


class Actors:
    def __init__(self, road: TownRoad, town: TownArrays, arrays: WorldArrays, *, traffic_rng, walk_rng) -> None:
        self.arrays = arrays
        self._road, self._town_arrays, self._town = road, town, road.network.town
        self._traffic_rng, self._walk_rng = traffic_rng, walk_rng

    @property
    def vehicles(self):
        return [TrafficVehicle(self._road, self, int(i)) for i in np.flatnonzero(self.arrays.vehicles.kind) if i]

    @property
    def pedestrians(self):
        return [Pedestrian(self._road, self, int(i)) for i in np.flatnonzero(self.arrays.pedestrians.state)]

    @property
    def props(self):
        rows = np.flatnonzero(self.arrays.props.present)
        return [Prop(self._road, self, int(i)) for i in sorted(rows, key=lambda i: self.arrays.props.key[i])]

    def populate(self, *, vehicles: int, pedestrians: int) -> None:
        n = 0
        for lane, station in free_places(self._town, self._traffic_rng, 12 * vehicles):
            if n == vehicles:
                break
            n += self.add_vehicle(lane, station, distance=25.0)
        lengths = self._town_arrays.walks.length
        if pedestrians and lengths.sum() > 0.0:
            for walk in self._walk_rng.choice(len(lengths), size=pedestrians, p=lengths / lengths.sum()):
                add_pedestrian(self._town_arrays, self.arrays, int(walk), float(self._walk_rng.uniform(0, lengths[walk])), pace=1.3)

    def add_vehicle(self, lane: int, station: float, *, distance: float) -> bool:
        x, y = self._town.lanes[lane].position(station)
        v = self.arrays.vehicles
        there = v.kind != 0
        d = np.hypot(v.x - x, v.y - y)[there]
        if d[0] < distance or d.min() < 14.0 or there.all():
            return False
        add_vehicle(self._town_arrays, self.arrays, lane, station, desired=float(self._traffic_rng.uniform(*SPEEDS)))
        return True

    def add_prop(self, kind: PropKind, lane: int, station: float, *, key=None):
        row = add_prop(self._road.network, self._town_arrays, self.arrays, kind, lane, station)
        return Prop(self._road, self, row)

    def remove_prop(self, prop) -> None:
        remove_prop(self._town_arrays, self.arrays, prop.row)

    def kerb(self, lane, station):
        l = self._town.lanes[lane]
        return l.position(station, l.width_at(station) / 2 + KERB)

    def add_pedestrian(self, lane, station):
        return False
