"""People on foot: they walk along a lane's edge and now and then cross, when nobody drives close by."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from highway_env.vehicle.objects import RoadObject

from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.town.model import LinkType, Town

WALKING_SPEED = 1.3
"""[m/s], the usual design value for pedestrians (MUTCD takes 1.1)."""

KERB = 1.6
"""Distance from the lane's edge at which they walk [m]."""

FROM_ENDS = 4.0
"""How far from the ends of a lane they turn back [m]."""

FROM_JUNCTION = 12.0
"""How far from the ends of a lane they cross, so that they do not walk into a junction [m]."""

WALK_STEP = 2.0
"""Step in which a walkway is looked for [m]."""

SHORTEST_WALK = 8.0
"""Shortest walkway [m]."""

CROSSING_RATE = 1 / 45
"""How often a pedestrian wants to cross [1/s]."""

PERSONAL_SPACE = 0.7
"""How close to a vehicle they step [m]."""

PATIENCE = 2.0
"""How long they stand before a vehicle, a prop or somebody else that does not move before they turn back [s]."""

ELBOW_ROOM = 0.3
"""How close to a prop or to somebody else they step [m]."""

SAFE_TIME = 5.0
"""Time gap to vehicles that they want before stepping out [s]."""

SAFE_DISTANCE = 14.0
"""And distance [m]."""


def walkway(network: TownNetwork, lane_id: int, station: float) -> tuple[float, float] | None:
    """The stretch beside a lane around a place on which one walks on no other lane [m], or None if there is none."""
    lane = network.town.lanes[lane_id]

    def is_free(at: float) -> bool:
        place = lane.position(at, lane.width_at(at) / 2 + KERB)
        closest = network.get_lane(network.get_closest_lane_index(place, height=lane.height_at(at)))
        along, lateral = closest.local_coordinates(place)
        return bool(abs(lateral) > closest.width_at(along) / 2 + KERB / 2)

    low, high = FROM_ENDS, lane.length - FROM_ENDS
    if not low <= station <= high or not is_free(station):
        return None
    first = last = station
    while first - WALK_STEP >= low and is_free(first - WALK_STEP):
        first -= WALK_STEP
    while last + WALK_STEP <= high and is_free(last + WALK_STEP):
        last += WALK_STEP
    return (first, last) if last - first >= SHORTEST_WALK else None


def rightmost(town: Town, lane_id: int) -> int:
    """The last of the lanes beside one another to the right: who walks beside it does not walk on another lane."""
    while (beside := town.neighbour(lane_id, LinkType.LANE_CHANGE_RIGHT)) is not None:
        lane_id = beside
    return lane_id


def leftmost(town: Town, lane_id: int) -> int:
    """The lane of the same direction that is farthest to the left."""
    while (beside := town.neighbour(lane_id, LinkType.LANE_CHANGE_LEFT)) is not None:
        lane_id = beside
    return lane_id


class Pedestrian(RoadObject):
    """A pedestrian beside (or crossing) a lane.

    Attributes:
        key: tells it apart from other bodies.
        height: of the road beside it [m].
    """

    LENGTH, WIDTH = 0.5, 0.5

    def __init__(
        self, road: TownRoad, lane_id: int, station: float, *,
        stretch: tuple[float, float], key: int, rng: np.random.Generator,
    ) -> None:  # fmt: skip
        """Puts a pedestrian beside a lane.

        Args:
            road: of the town.
            lane_id: the lane, the rightmost one.
            station: distance along it [m].
            stretch: between which stations it walks [m].
            key: of its own.
            rng: of its decisions.
        """
        self._stretch = stretch
        self._lane = road.network.town.lanes[lane_id]
        self._rng = rng
        self.key = key
        self._station = station
        self._home = self._lane.width_at(station) / 2 + KERB
        self._lateral = self._home
        self._target = self._home
        self._far = self._home
        self._waited = 0.0
        self._direction = 1.0 if rng.random() < 0.5 else -1.0
        self.height = self._lane.height_at(station)
        self.lane_id = lane_id
        super().__init__(road, self._lane.position(station, self._lateral), self._heading(), WALKING_SPEED)
        self._place()

    def walk(self, dt: float, across: Callable[[Pedestrian], float]) -> None:
        """Moves on by `dt` [s]; `across` tells the way to the far side [m] where the pedestrian wants to cross."""
        if self.crashed:
            self.speed = 0.0
            return
        crossing = abs(self._target - self._lateral) > 0.05
        if self._is_stopped(dt):
            self.speed = 0.0
            self._waited += dt
            if self._waited > PATIENCE:
                self._turn_back(crossing)
            return
        self._waited = 0.0
        if crossing:
            step = math.copysign(
                min(WALKING_SPEED * dt, abs(self._target - self._lateral)), self._target - self._lateral
            )
            self._lateral += step
        else:
            self._station += self._direction * WALKING_SPEED * dt
            if not self._stretch[0] < self._station < self._stretch[1]:
                self._direction = 1.0 if self._station <= self._stretch[0] else -1.0
            midway = FROM_JUNCTION < self._station < self._lane.length - FROM_JUNCTION
            if self._rng.random() < CROSSING_RATE * dt and midway and self._is_clear():
                near = abs(self._lateral - self._home) < 0.1
                self._far = self._home - across(self) if near else self._lateral
                self._target = self._far if near else self._home
        self._place()

    def _is_stopped(self, dt: float) -> bool:
        """Whether the next step leads closer to something that is close."""
        step = WALKING_SPEED * max(dt, 0.2)
        now = (float(self.position[0]), float(self.position[1]))
        return would_touch(self, now, (now[0] + step * math.cos(self.heading), now[1] + step * math.sin(self.heading)))

    def _turn_back(self, crossing: bool) -> None:
        self._waited = 0.0
        if crossing:
            self._target = self._home if self._target != self._home else self._far
        else:
            self._direction = -self._direction
        self.heading = self._heading()

    def _is_clear(self) -> bool:
        for vehicle in self.road.vehicles:
            distance = math.hypot(*(vehicle.position - self.position))
            if distance < SAFE_DISTANCE + SAFE_TIME * max(vehicle.speed, 0.0):
                return False
        return True

    def _heading(self) -> float:
        along: float = self._lane.heading_at(self._station)
        if abs(self._target - self._lateral) > 0.05:
            return along + math.copysign(math.pi / 2, self._target - self._lateral)
        return along if self._direction > 0 else along + math.pi

    def _place(self) -> None:
        self.position = self._lane.position(self._station, self._lateral)
        self.heading = self._heading()
        self.speed = WALKING_SPEED
        self.height = self._lane.height_at(self._station)


def would_touch(walker: Any, now: tuple[float, float], then: tuple[float, float]) -> bool:
    """Whether a step leads closer to a vehicle that is close, a prop or somebody: nobody walks into their sides.

    Who is close already may step away.

    Args:
        walker: who walks; it stands on a road.
        now: where it is [m].
        then: where it would be [m].
    """
    road = walker.road
    for things, space in ((road.vehicles, PERSONAL_SPACE), (road.objects, ELBOW_ROOM)):
        for thing in things:
            if thing is walker or abs(now[0] - thing.position[0]) > 6.0 or abs(now[1] - thing.position[1]) > 6.0:
                continue
            room = _room_beside(thing, *then)
            if room < space and room < _room_beside(thing, *now):
                return True
    return False


def _room_beside(vehicle: Any, x: float, y: float) -> float:
    """How far outside of a thing's outline a place is, along its length or its width [m]; negative inside."""
    dx, dy = x - vehicle.position[0], y - vehicle.position[1]
    c, s = math.cos(vehicle.heading), math.sin(vehicle.heading)
    return float(max(abs(dx * c + dy * s) - vehicle.LENGTH / 2, abs(dy * c - dx * s) - vehicle.WIDTH / 2))
