"""Roads of a town for highway-env: `TownRoad`, and `CompiledRoad`, whose traffic is stepped by the compiled loops."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from highway_env.road.road import Road
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, RoadObject
from numpy.typing import NDArray

from dorothie_gym.maps.model import LEVEL_HEIGHT, Array
from dorothie_gym.sim.bodies import Bodies, TrafficVehicle
from dorothie_gym.sim.collisions import OrientedBox, boxes_touch
from dorothie_gym.sim.network.ahead import LaneChains, Neighbours, lane_zones, neighbours_on
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.record_views import BodyView
from dorothie_gym.sim.state.town_arrays import TownArrays, town_arrays
from dorothie_gym.sim.state.world_arrays import WorldArrays, empty_world
from dorothie_gym.sim.step import step_around
from dorothie_gym.sim.traffic.lane_index import rebuild
from dorothie_gym.sim.traffic.respawn import new_key, put_on_lane
from dorothie_gym.sim.traffic.vehicle_models import update_lane
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.sim.network.network import LaneIndex, Route, TownNetwork
    from dorothie_gym.sim.state.records import VehicleRecord


class TownRoad(CachedViews, Road):
    """A highway-env road on which heights count and neighbours are found across lane ends.

    Vehicles and objects are highway-env's. One may carry a `height` [m] of its own, else it has that of its lane.

    Attributes:
        time: simulated time [s], counted by `step`.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_chains", "_zones")

    def __init__(
        self,
        network: TownNetwork,
        vehicles: list[Vehicle] | None = None,
        road_objects: list[RoadObject] | None = None,
        np_random: np.random.Generator | None = None,
        record_history: bool = False,
        neighbour_vehicles_connected_lanes: bool = True,
    ) -> None:
        """Puts vehicles and objects on a network.

        Args:
            network: lanes of the town.
            vehicles: vehicles (`highway_env.vehicle.kinematics.Vehicle`).
            road_objects: objects (`highway_env.vehicle.objects.RoadObject`).
            np_random: randomness of the vehicles' behaviour; by default a generator seeded with 0.
            record_history: whether vehicles keep their last states for display.
            neighbour_vehicles_connected_lanes: part of highway-env's interface; connected lanes are always searched.
        """
        super().__init__(
            network=network,
            vehicles=vehicles,
            road_objects=road_objects,
            np_random=np_random if np_random is not None else np.random.default_rng(0),
            record_history=record_history,
            neighbour_vehicles_connected_lanes=neighbour_vehicles_connected_lanes,
        )
        self.time = 0.0

    @functools.cached_property
    def _chains(self) -> LaneChains:
        return LaneChains(self.network)

    @functools.cached_property
    def _zones(self) -> Array:
        return lane_zones(self.network.table)

    def height_of(self, thing: RoadObject) -> float:
        """Returns the height of a vehicle or object [m]: its own, else its lane's; NaN without a lane."""
        own = getattr(thing, "height", None)
        if own is not None:
            return float(own)
        if thing.lane is None:
            return math.nan
        return float(thing.lane.height_at(thing.lane.local_coordinates(thing.position)[0]))

    def at_one_level(self, one: RoadObject, other: RoadObject) -> bool:
        """Returns whether two bodies can meet: at most `LEVEL_HEIGHT` apart in height, if their heights are known."""
        low, high = self.network.height_range
        own_heights = getattr(one, "height", None) is not None or getattr(other, "height", None) is not None
        if high - low <= LEVEL_HEIGHT and not own_heights:
            return True
        return not abs(self.height_of(one) - self.height_of(other)) > LEVEL_HEIGHT

    def step(self, dt: float) -> None:
        """Moves all bodies by `dt` [s] and checks for collisions.

        Equals highway-env's step for bodies at one height; pairs that its own first check would dismiss are skipped.
        """
        self.time += dt
        for vehicle in self.vehicles:
            vehicle.step(dt)
        things = self.vehicles + self.objects
        for i, j in self._near_pairs(things, dt):
            if self.at_one_level(things[i], things[j]):
                things[i].handle_collisions(things[j], dt)

    def _near_pairs(self, things: Sequence[RoadObject], dt: float) -> list[tuple[int, int]]:
        """Pairs of a vehicle and a later element of `things` that may touch within `dt`, in highway-env's order."""
        count = len(self.vehicles)
        if not count:
            return []
        places = np.array([thing.position for thing in things])  # (n, 2)
        reach = np.array([0.5 * thing.diagonal + max(thing.speed, 0.0) * dt for thing in things]) + 1e-6  # (n,)
        gaps = np.linalg.norm(places[:count, None] - places[None, :], axis=-1)  # (count, n)
        # Negated, so that an undefined position is left to highway-env as before.
        near = np.triu(~(gaps > reach[:count, None] + reach[None, :]), k=1)
        return [(int(i), int(j)) for i, j in zip(*np.nonzero(near), strict=True)]

    def close_objects_to(
        self,
        vehicle: Vehicle,
        distance: float,
        count: int | None = None,
        see_behind: bool = True,
        sort: bool = True,
        vehicles_only: bool = False,
    ) -> list[RoadObject]:
        """Returns the objects close to a vehicle, as highway-env chooses them, with one call for all measurements.

        Args:
            vehicle: the observer.
            distance: largest distance [m].
            count: maximum number of results; all by default.
            see_behind: whether vehicles behind are seen; objects there never are.
            sort: whether they are sorted by their distance along the vehicle's lane.
            vehicles_only: whether objects are left out.
        """
        others = [other for other in self.vehicles if other is not vehicle]
        things = others if vehicles_only else others + self.objects
        if not things:
            return []
        places = np.array([thing.position for thing in things])  # (n, 2)
        start, _ = vehicle.lane.local_coordinates(vehicle.position)
        along = vehicle.lane.local_coordinates_many(places)[:, 0] - start  # (n,)
        seen = along > -2 * vehicle.LENGTH
        if see_behind:
            seen[: len(others)] = True
        chosen = np.flatnonzero(seen & (np.linalg.norm(places - vehicle.position, axis=1) < distance))
        if sort:
            chosen = chosen[np.argsort(np.abs(along[chosen]), kind="stable")]
        return [things[k] for k in chosen[: count or None].tolist()]

    def neighbour_vehicles(
        self, vehicle: Vehicle, lane_index: LaneIndex | None = None
    ) -> tuple[RoadObject | None, RoadObject | None]:
        """Returns the next bodies ahead of and behind a vehicle; see `neighbours`.

        Args:
            vehicle: vehicle whose neighbours are searched.
            lane_index: lane to look on, by default its own; on another lane, the closest place counts as its own.

        Returns:
            Vehicles or objects (not landmarks), or None.
        """
        (front, _), (rear, _) = self.neighbours(vehicle, lane_index)
        return front, rear

    def neighbours(
        self, vehicle: Vehicle, lane_index: LaneIndex | None = None
    ) -> tuple[tuple[RoadObject | None, float], tuple[RoadObject | None, float]]:
        """Returns the next objects ahead and behind of a vehicle, and their distances along the lanes [m] or inf.

        Looks on the whole lane as highway-env does, then up to `ahead.HORIZON` along the lanes ahead (those of the
        vehicle's route or target lane if there is one, else all) and along all lanes behind. Objects more than
        `LEVEL_HEIGHT` above or below the lane do not count.
        """
        none = (None, math.inf), (None, math.inf)
        index = lane_index or vehicle.lane_index
        if not index:
            return none
        others = [
            t
            for t in itertools.chain(self.vehicles, self.objects)
            if t is not vehicle and not _is_landmark(t.__class__)
        ]
        if not others:
            return none
        places = np.empty((len(others), 2))
        heights, rows = np.empty(len(others)), np.empty(len(others), dtype=np.int64)
        for k, other in enumerate(others):
            x, y = other.position
            height = getattr(other, "height", None)
            places[k, 0], places[k, 1] = x, y
            heights[k] = math.nan if height is None else height
            rows[k] = getattr(other.lane, "row", -1)
        chain = self._chains.around(index, self._route(vehicle, index))
        table = self.network.table
        found = Neighbours(
            *neighbours_on(
                table.points,
                table.offsets,
                table.ends,
                self._zones,
                *chain,
                np.asarray(vehicle.position, dtype=np.float64),
                places,
                heights,
                rows,
            )
        )
        front = others[found.front] if found.front >= 0 else None
        rear = others[found.rear] if found.rear >= 0 else None
        return (front, float(found.front_distance)), (rear, float(found.rear_distance))

    def _route(self, vehicle: Vehicle, index: LaneIndex) -> Route | None:
        """Returns the vehicle's route; without one, the lane it steers for if that follows the given lane."""
        route: Route | None = getattr(vehicle, "route", None)
        target = getattr(vehicle, "target_lane_index", None)
        if route or target is None or target == index:
            return route
        return [target] if target in self.network.successors(index) else None


@functools.lru_cache(maxsize=64)
def _is_landmark(kind: type) -> bool:
    # called for all pairs at every step: highway-env's classes are abstract base classes, whose checks are slow
    return issubclass(kind, Landmark)


# --- Road with compiled traffic ---------------------------------------------------------------------------------------


class CompiledRoad(TownRoad):
    """A road on which highway-env's own vehicles drive among those of the arrays.

    `vehicles` and `objects` are plain lists, as everywhere in highway-env. A view that is removed from them leaves the
    arrays; a vehicle of highway-env that is added to them, a guest, is seen by all others, which yield to it and
    collide with it. Guests decide and move as their class does; all others do so in one call a substep. Objects of
    highway-env's own matter to guests alone. A guest with a `height` [m] starts on a lane at that height.

    Attributes:
        arrays: state of all bodies; replaced by bigger ones where guests find no room.
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
        self._guests: list[Vehicle] = []
        self._rows: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._poses: Array = np.zeros((0, 4))
        self._things: list[RoadObject] = []
        self._listed: tuple[list[Vehicle], list[RoadObject]] = [], []
        self.show()

    @property
    def town_arrays(self) -> TownArrays:
        """The arrays of the town."""
        return town_arrays(self.network)

    def show(self) -> None:
        """Lists all bodies of the arrays, guests first; must be called after bodies were added to the arrays."""
        self._note_changes()
        self.vehicles[:] = [*self._guests, *self._bodies.vehicles()]
        self.objects[:] = [*self._things, *self._bodies.pedestrians(), *self._bodies.props()]
        self._listed = list(self.vehicles), list(self.objects)
        rebuild(self.town_arrays, self.arrays)

    def act(self) -> None:
        """Decides for the guests; all others decide in `step`, on the same state."""
        self._note_changes()
        for guest in self._guests:
            guest.act()

    def step(self, dt: float) -> None:
        """Moves all bodies by `dt` [s] and checks for collisions; see `sim.step.step_around`."""
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

    def _level(self, guest: Vehicle, record: VehicleRecord) -> None:
        """Sets a guest's closest lane of its height; highway-env would take one of a bridge below or above it."""
        guest.height = float(record.height)
        guest.lane_index = self.network.index_of(record.lane)
        guest.lane = self.network.get_lane(guest.lane_index)

    def _mark_props(self, guest: Vehicle) -> None:
        """Marks the props that a guest has run into, as highway-env does; the kernel keeps no such mark."""
        outline = OrientedBox.of(guest)
        for prop in self._bodies.props():
            prop.crashed = prop.crashed or boxes_touch(outline, OrientedBox.of(prop))

    def _note_changes(self) -> None:
        """Follows changes of the lists of vehicles and objects."""
        if self._listed == (self.vehicles, self.objects):
            return
        self._listed = list(self.vehicles), list(self.objects)
        guests = [vehicle for vehicle in self.vehicles if not isinstance(vehicle, BodyView)]
        self._things = [thing for thing in self.objects if not isinstance(thing, BodyView)]
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
        """Frees the rows of bodies that left the lists; `guests` are rows of guests that stay."""
        shown = {(view.RECORDS, view.row) for view in [*self.vehicles, *self.objects] if isinstance(view, BodyView)}
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

    def _seat(self, guest: Vehicle) -> int:
        """Gives a guest a row, and returns its number; the first guest of a world has the key 0."""
        town = self.town_arrays
        empty = np.flatnonzero(self.arrays.vehicles["kind"] == Kind.EMPTY)
        if not len(empty):
            empty = np.array([len(self.arrays.vehicles)])
            self.arrays = enlarged(town, self.arrays, 2 * len(self.arrays.vehicles) + 1)
        row = int(empty[0])
        record = self.arrays.vehicles[row]
        record.kind, record.key = Kind.EGO, new_key(self.arrays) if row else 0
        record.length, record.width, record.desired, record.to_right = guest.LENGTH, guest.WIDTH, guest.speed, 0.0
        record.radius = 0.5 * pm.hypot(guest.LENGTH, guest.WIDTH)
        height = getattr(guest, "height", None)
        lane = self.network.get_lane(self.network.get_closest_lane_index(guest.position, guest.heading, height=height))
        put_on_lane(town, record, lane.town_lane.id, lane.local_coordinates(guest.position)[0])
        (record.x, record.y), record.heading, record.speed = guest.position, guest.heading, guest.speed
        record.cos, record.sin, record.crashed = pm.cos(guest.heading), pm.sin(guest.heading), guest.crashed
        update_lane(town, record)
        return row


def enlarged(town: TownArrays, arrays: WorldArrays, vehicles: int) -> WorldArrays:
    """Returns the same world with room for more vehicles.

    Args:
        town: arrays of the town.
        arrays: arrays of the world; they stay as they are.
        vehicles: number of rows.
    """
    bigger = empty_world(
        town,
        vehicles=vehicles,
        pedestrians=len(arrays.pedestrians),
        props=len(arrays.props),
        seed=int(arrays.clock[0].random),
    )
    for name in ("vehicles", "pedestrians", "props", "lamps", "busy", "clock"):
        old = getattr(arrays, name)
        getattr(bigger, name)[: len(old)] = old
    rebuild(town, bigger)
    return bigger
