"""The road of a town whose traffic is stepped by the kernel, as highway-env uses a road."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.world.bodies import Bodies, TrafficVehicle
from dorothie_gym.world.boxes import Box, boxes_touch
from dorothie_gym.world.kernel import Kind, TownArrays, Walk, WorldArrays, empty_world, town_arrays
from dorothie_gym.world.kernel.order import rebuild
from dorothie_gym.world.kernel.stepping import find, step_around
from dorothie_gym.world.kernel.towing import new_key, put_on_lane
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.rows import Row
from dorothie_gym.world.town.model import Array


class CompiledRoad(TownRoad):
    """A road on which highway-env's own vehicles drive among those of the kernel's arrays.

    `vehicles` and `objects` are plain lists, as everywhere in highway-env, and they say who is there: a view that is
    taken out of them leaves the arrays, and a vehicle of highway-env's that is put into them, a guest, is seen, yielded
    to and struck by everybody. Guests decide and move as their class does; all others do so in one call a substep.
    Objects of highway-env's own are heeded by guests alone. A guest with a `height` [m] begins on a lane of it.

    Attributes:
        arrays: state of everybody; replaced by bigger ones where guests find no room.
    """

    def __init__(
        self,
        network: TownNetwork,
        arrays: WorldArrays,
        *,
        np_random: np.random.Generator | None = None,
        record_history: bool = False,
    ) -> None:
        """Shows a world on the roads of its town.

        Args:
            network: lanes of the town.
            arrays: state of a world in it.
            np_random: randomness of the guests' behaviour; by default a generator seeded with 0.
            record_history: whether vehicles keep their last states for display.
        """
        super().__init__(network=network, np_random=np_random, record_history=record_history)
        self.arrays = arrays
        self._bodies = Bodies(self, self)
        self._guests: list[Any] = []
        self._rows: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._poses: Array = np.zeros((0, 4))
        self._things: list[Any] = []
        self._listed: tuple[list[Any], list[Any]] = [], []
        self.show()

    def __deepcopy__(self, memo: dict[int, Any]) -> CompiledRoad:
        twin = self.__class__.__new__(self.__class__)
        memo[id(self)] = twin
        for name, value in self.__dict__.items():
            setattr(twin, name, value.copy() if name == "arrays" else copy.deepcopy(value, memo))
        return twin

    @property
    def town_arrays(self) -> TownArrays:
        """The arrays of the town."""
        return town_arrays(self.network)

    def show(self) -> None:
        """Lists everybody who is in the arrays, guests first; to be called after somebody was added to these."""
        self._note_changes()
        self.vehicles[:] = [*self._guests, *self._bodies.vehicles()]
        self.objects[:] = [*self._things, *self._bodies.pedestrians(), *self._bodies.props()]
        self._listed = list(self.vehicles), list(self.objects)
        rebuild(self.town_arrays, self.arrays)

    def act(self) -> None:
        """Lets the guests decide; everybody else does so in `step`, on the same state."""
        self._note_changes()
        for guest in self._guests:
            guest.act()

    def step(self, dt: float) -> None:
        """Moves everybody by `dt` [s] and checks for collisions; see `kernel.stepping.step_around`."""
        self._note_changes()
        self.time += dt
        crashed = np.asarray(self.arrays.vehicles)["crashed"]
        for k, guest in enumerate(self._guests):
            guest.step(dt)
            self._poses[k, :2] = guest.position
            self._poses[k, 2], self._poses[k, 3] = guest.heading, guest.speed
            crashed[self._rows[k]] = guest.crashed
        step_around(self.town_arrays, self.arrays, dt, self._rows, self._poses)
        for row, guest in zip(self._rows.tolist(), self._guests, strict=True):
            if not self.town_arrays.flat:
                self._level(guest, self.arrays.vehicles[row])
            if crashed[row] and not guest.crashed:
                guest.crashed = True
                self._mark_props(guest)
            for thing in self._things:
                if self.at_one_level(guest, thing):
                    guest.handle_collisions(thing, dt)
        if self.record_history:
            for view in self.vehicles:
                if isinstance(view, TrafficVehicle):
                    view.remember()

    def _level(self, guest: Any, record: Any) -> None:
        """Tells a guest the closest lane of its height; highway-env would take one of a bridge below or above it."""
        guest.height = float(record.height)
        guest.lane_index = self.network.index_of(record.lane)
        guest.lane = self.network.get_lane(guest.lane_index)

    def _mark_props(self, guest: Any) -> None:
        """Marks the props that a guest has run into, as highway-env does; the kernel keeps no such mark."""
        outline = Box.of(guest)
        for prop in self._bodies.props():
            prop.crashed = prop.crashed or boxes_touch(outline, Box.of(prop))

    def _note_changes(self) -> None:
        """Heeds that somebody was put into the lists, or taken out of them."""
        if self._listed == (self.vehicles, self.objects):
            return
        self._listed = list(self.vehicles), list(self.objects)
        guests = [vehicle for vehicle in self.vehicles if not isinstance(vehicle, Row)]
        self._things = [thing for thing in self.objects if not isinstance(thing, Row)]
        before = dict(zip(map(id, self._guests), self._rows.tolist(), strict=True))
        rows = [before.get(id(guest)) for guest in guests]
        self._send_away({row for row in rows if row is not None})
        self._guests = guests
        self._rows = np.array(
            [self._seat(guest) if row is None else row for guest, row in zip(guests, rows, strict=True)], dtype=np.int64
        )
        self._poses = np.zeros((len(guests), 4))
        rebuild(self.town_arrays, self.arrays)

    def _send_away(self, guests: set[int]) -> None:
        """Empties the rows of those who are not in the lists any more; `guests` are rows of guests who stay."""
        shown = {(view.RECORDS, view.row) for view in [*self.vehicles, *self.objects] if isinstance(view, Row)}
        arrays = self.arrays
        for row in range(len(arrays.vehicles)):
            if ("vehicles", row) not in shown and row not in guests:
                arrays.vehicles[row].kind = Kind.EMPTY
        for row in range(len(arrays.pedestrians)):
            if ("pedestrians", row) not in shown:
                arrays.pedestrians[row].state = Walk.EMPTY
        for row in range(len(arrays.props)):
            if ("props", row) not in shown:
                arrays.props[row].present = False

    def _seat(self, guest: Any) -> int:
        """Gives a guest a row, and returns its number; the first guest of a world has the key 0."""
        town = self.town_arrays
        empty = np.flatnonzero(self.arrays.vehicles.kind == Kind.EMPTY)
        if not len(empty):
            empty = np.array([len(self.arrays.vehicles)])
            self.arrays = enlarged(town, self.arrays, 2 * len(self.arrays.vehicles) + 1)
        row = int(empty[0])
        record = self.arrays.vehicles[row]
        record.kind, record.key = Kind.EGO, new_key(self.arrays) if row else 0
        record.length, record.width, record.desired, record.to_right = guest.LENGTH, guest.WIDTH, guest.speed, 0.0
        record.radius = 0.5 * math.hypot(guest.LENGTH, guest.WIDTH)
        height = getattr(guest, "height", None)
        lane = self.network.get_lane(self.network.get_closest_lane_index(guest.position, guest.heading, height=height))
        put_on_lane(town, record, lane.town_lane.id, lane.local_coordinates(guest.position)[0])
        (record.x, record.y), record.heading, record.speed = guest.position, guest.heading, guest.speed
        record.cos, record.sin, record.crashed = math.cos(guest.heading), math.sin(guest.heading), guest.crashed
        find(town, record)
        return row


def enlarged(town: TownArrays, arrays: WorldArrays, vehicles: int) -> WorldArrays:
    """The same world with room for more vehicles.

    Args:
        town: arrays of the town.
        arrays: of the world; they stay as they are.
        vehicles: how many there will be room for.
    """
    bigger = empty_world(
        town, vehicles=vehicles, pedestrians=len(arrays.pedestrians), props=len(arrays.props),
        seed=int(arrays.clock[0].random),
    )  # fmt: skip
    for name in ("vehicles", "pedestrians", "props", "lamps", "busy", "clock"):
        old = getattr(arrays, name)
        getattr(bigger, name)[: len(old)] = old
    rebuild(town, bigger)
    return bigger
