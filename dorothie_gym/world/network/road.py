"""The road of a town: what drives and stands on its network."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from highway_env.road.road import Road
from highway_env.vehicle.objects import Landmark

from dorothie_gym.world.network.ahead import LEVEL, LaneChains, Neighbours, lane_zones, neighbours_on
from dorothie_gym.world.network.network import LaneIndex, Route, TownNetwork
from dorothie_gym.world.town.model import Array


class TownRoad(Road):
    """A highway-env road on which heights count and neighbours are found across lane ends.

    Vehicles and objects are highway-env's. One may carry a `height` [m] of its own, else it has that of its lane.

    Attributes:
        time: simulated time [s], counted by `step`.
    """

    def __init__(
        self,
        network: TownNetwork,
        vehicles: list[Any] | None = None,
        road_objects: list[Any] | None = None,
        np_random: np.random.Generator | None = None,
        record_history: bool = False,
        neighbour_vehicles_connected_lanes: bool = True,
    ) -> None:
        """Put vehicles and objects on a network.

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

    def height_of(self, thing: Any) -> float:
        """Height of a vehicle or object [m]: its own `height` if it has one, else its lane's; NaN without a lane."""
        own = getattr(thing, "height", None)
        if own is not None:
            return float(own)
        if thing.lane is None:
            return math.nan
        return float(thing.lane.height_at(thing.lane.local_coordinates(thing.position)[0]))

    def at_one_level(self, one: Any, other: Any) -> bool:
        """Whether two things can meet: no more than `ahead.LEVEL` apart in height, as far as that is known."""
        low, high = self.network.height_range
        own_heights = getattr(one, "height", None) is not None or getattr(other, "height", None) is not None
        if high - low <= LEVEL and not own_heights:
            return True
        return not abs(self.height_of(one) - self.height_of(other)) > LEVEL

    def step(self, dt: float) -> None:
        """Move everything by `dt` [s] and check for collisions.

        Same as highway-env's for things at one height; pairs that its own first check would dismiss are not visited.
        """
        self.time += dt
        for vehicle in self.vehicles:
            vehicle.step(dt)
        things = self.vehicles + self.objects
        for i, j in self._near_pairs(things, dt):
            if self.at_one_level(things[i], things[j]):
                things[i].handle_collisions(things[j], dt)

    def _near_pairs(self, things: Sequence[Any], dt: float) -> list[tuple[int, int]]:
        """Pairs of a vehicle and what comes after it in `things` that may touch within `dt`, in highway-env's order."""
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
        vehicle: Any,
        distance: float,
        count: int | None = None,
        see_behind: bool = True,
        sort: bool = True,
        vehicles_only: bool = False,
    ) -> list[Any]:
        """Those close to a vehicle, as highway-env chooses them, with one call for all that has to be measured.

        Args:
            vehicle: who looks.
            distance: nobody farther away is told of [m].
            count: most that are told of; all by default.
            see_behind: whether vehicles behind are seen; objects there never are.
            sort: whether those come first who are near along the vehicle's lane, before and behind.
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

    def neighbour_vehicles(self, vehicle: Any, lane_index: LaneIndex | None = None) -> tuple[Any | None, Any | None]:
        """Next thing ahead and behind of a vehicle; see `neighbours`.

        Args:
            vehicle: whose neighbours.
            lane_index: lane to look on, by default its own; on another one its place is the closest on that lane.

        Returns:
            Vehicles or objects (not landmarks), or None.
        """
        (front, _), (rear, _) = self.neighbours(vehicle, lane_index)
        return front, rear

    def neighbours(
        self, vehicle: Any, lane_index: LaneIndex | None = None
    ) -> tuple[tuple[Any | None, float], tuple[Any | None, float]]:
        """Next thing ahead and behind of a vehicle with their distances along the lanes [m] (inf where nobody is).

        Looks on the whole lane as highway-env does, then up to `ahead.HORIZON` along the lanes ahead (those of the
        vehicle's route or target lane where these tell, else all) and along all lanes behind. What is more than
        `ahead.LEVEL` above or below the lane does not count.
        """
        nobody = (None, math.inf), (None, math.inf)
        index = lane_index or vehicle.lane_index
        if not index:
            return nobody
        others = [
            t
            for t in itertools.chain(self.vehicles, self.objects)
            if t is not vehicle and not _is_landmark(t.__class__)
        ]
        if not others:
            return nobody
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

    def _route(self, vehicle: Any, index: LaneIndex) -> Route | None:
        """The vehicle's route; without one, the lane it steers for if that follows the lane in question."""
        route: Route | None = getattr(vehicle, "route", None)
        target = getattr(vehicle, "target_lane_index", None)
        if route or target is None or target == index:
            return route
        return [target] if target in self.network.successors(index) else None


@functools.lru_cache(maxsize=64)
def _is_landmark(kind: type) -> bool:
    # asked for all pairs at every step: highway-env's classes are abstract base classes, whose checks are slow
    return issubclass(kind, Landmark)
