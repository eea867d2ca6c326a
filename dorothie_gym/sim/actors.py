"""Actors: traffic, pedestrians and props."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from dorothie_gym.sim.bodies import Bodies, Pedestrian, Prop, TrafficVehicle
from dorothie_gym.sim.population import (
    add_prop,
    add_street_walker,
    add_vehicle,
    move_prop,
    remove_prop,
)
from dorothie_gym.sim.state.codes import NOBODY, Kind, Walk
from dorothie_gym.sim.state.world_arrays import WorldArrays, grown
from dorothie_gym.sim.traffic.parameters import CYCLIST_SHARE, CYCLIST_SPEEDS, VEHICLE_SPEEDS
from dorothie_gym.sim.traffic.respawn import is_free
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.ontology.world_exceptions import PropKind
    from dorothie_gym.sim.road import TownRoad
    from dorothie_gym.sim.state.town_arrays import TownArrays

MORE = 8
"""Rows by which the arrays grow when all are taken."""


class Actors(CachedViews):
    """Traffic, pedestrians and props of a world.

    Attributes:
        arrays: state of all bodies, the ego the first vehicle; replaced by bigger arrays when more are added.
        town_arrays: arrays of the town.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_bodies", "_present_of", "_present")

    _present_of: WorldArrays | None = None

    def __init__(self, road: TownRoad, town: TownArrays, arrays: WorldArrays, rng: np.random.Generator) -> None:
        """Shows the actors of a world that has started.

        Args:
            road: road of the town.
            town: its arrays.
            arrays: arrays of the world.
            rng: source of kinds and speeds of new actors.
        """
        self.arrays = arrays
        self._road, self.town_arrays, self._town = road, town, road.network.town
        self._rng = rng

    @cached_property
    def _bodies(self) -> Bodies:
        return Bodies(self._road, self)

    @property
    def vehicles(self) -> list[TrafficVehicle]:
        """Traffic, including cyclists."""
        return self._bodies.vehicles()

    @property
    def pedestrians(self) -> list[Pedestrian]:
        """People on foot."""
        return self._bodies.pedestrians()

    @property
    def props(self) -> list[Prop]:
        """Props placed by the Ad-Wizard, in order of placement."""
        if not self.has_props:
            return []
        return sorted(self._bodies.props(), key=lambda prop: int(prop.key))

    @property
    def has_props(self) -> bool:
        """Whether there is any prop."""
        if self._present_of is not self.arrays:
            self._present_of, self._present = self.arrays, self.arrays.props["present"]
        return len(self._present) > 0 and bool(self._present.any())

    # --- Adding and removing ------------------------------------------------------------------------------------------

    def add_vehicle(self, lane: int, station: float, *, distance: float) -> bool:
        """Adds a vehicle or cyclist on a lane if there is room and the ego is farther than `distance` [m]."""
        town = self.town_arrays
        if not is_free(town, self.arrays, lane, float(station), int(NOBODY), float(distance)):
            return False
        cycles = bool(town.lanes[lane].outer < 0 and town.lanes[lane].cycling) and self._rng.random() < CYCLIST_SHARE
        kind, speeds = (Kind.CYCLIST, CYCLIST_SPEEDS) if cycles else (Kind.CAR, VEHICLE_SPEEDS)
        self._make_room(vehicles=1)
        add_vehicle(town, self.arrays, lane, station, kind=kind, desired=float(self._rng.uniform(*speeds)))
        return True

    def add_pedestrian(self, lane: int, station: float) -> bool:
        """Adds a pedestrian beside a lane, or at the kerb of those beside it, if the place is free.

        Such pedestrians stay at their street, and cross it anywhere.
        """
        self._make_room(pedestrians=1)
        found = add_street_walker(self._road.network, self.town_arrays, self.arrays, lane, station)
        return found is not None

    def add_prop(self, kind: PropKind, lane: int, station: float) -> Prop:
        """Adds a prop on a lane; the caller has checked that it may stand there.

        Args:
            kind: kind of the prop.
            lane: lane of the prop.
            station: distance along the lane [m].
        """
        self._make_room(props=1)
        row = add_prop(self._road.network, self.town_arrays, self.arrays, kind, lane, station)
        return self._bodies.prop(row)

    def move_prop(self, prop: Prop, lane: int, station: float) -> None:
        """Moves a prop to another place; it keeps its key."""
        move_prop(self._road.network, self.town_arrays, self.arrays, prop.row, lane, station)

    def remove_prop(self, prop: Prop) -> None:
        """Removes a prop."""
        remove_prop(self.town_arrays, self.arrays, prop.row)

    def _make_room(self, *, vehicles: int = 0, pedestrians: int = 0, props: int = 0) -> None:
        """Replaces the arrays by larger ones if they have no room for this many more actors."""
        state = self.arrays
        free = (
            int((state.vehicles["kind"] == Kind.EMPTY).sum()),
            int((state.pedestrians["state"] == Walk.EMPTY).sum()),
            int((~state.props["present"]).sum()),
        )
        missing = [max(n - there, 0) for n, there in zip((vehicles, pedestrians, props), free, strict=True)]
        if any(missing):
            more = [math.ceil(n / MORE) * MORE for n in missing]
            self.arrays = grown(
                self.town_arrays,
                state,
                vehicles=len(state.vehicles) + more[0],
                pedestrians=len(state.pedestrians) + more[1],
                props=len(state.props) + more[2],
            )
