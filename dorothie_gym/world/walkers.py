"""People who walk along pavements, round corners and over crosswalks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from highway_env.vehicle.objects import RoadObject

from dorothie_gym.world.crosswalks import Crosswalks
from dorothie_gym.world.network.road import TownRoad
from dorothie_gym.world.pedestrians import would_touch
from dorothie_gym.world.town.footways import Footways, Way, WayKind
from dorothie_gym.world.town.model import Array

SPEEDS = (1.1, 1.6)
"""Slowest and fastest walker [m/s] (Knoblauch et al. 1996 measured 1.2 to 1.5 at crosswalks)."""

ASIDE = 0.45
"""How far to the right of the way's middle they keep [m]: those who come towards one pass by."""

FROM_EDGE = 0.4
"""But no closer to its edge than this [m]."""

AHEAD = 1.0
"""They walk towards a place on their way this far ahead [m]."""

AVOIDING = 1.6
"""Within this distance people step out of each other's way [m]."""

SPACE = 0.55
"""And never come closer than this [m]."""

GIVES_UP = 40.0
"""Who has not been able to cross for this long goes another way [s]."""

BLOCKED = 3.0
"""Who has not got on for this long turns round [s]."""

PLACE = 3.0
"""Who stays within this distance does not get on [m]."""

OVER = 0.1
"""Who is this close to the end of a crosswalk has left it [m]."""

STEPS = 0.2
"""Step of the place that they walk towards [m]."""


class Walker(RoadObject):
    """Somebody who walks through the town and chooses the way at corners by chance.

    Attributes:
        key: tells it apart from other bodies.
        height: of the ground [m].
        crosswalk: id of the crosswalk that it is on, or -1.
        across: how far along that it is [m].
        onward: 1 or -1, the direction in which it walks along that.
        staying: for how long it has not got on [s].
    """

    LENGTH, WIDTH = 0.5, 0.5
    position: Array

    def __init__(
        self, road: TownRoad, ways: Footways, crosswalks: Crosswalks, way: int, station: float, *,
        key: int, rng: np.random.Generator,
    ) -> None:  # fmt: skip
        """Puts a walker on a way, at a distance along it [m]."""
        self._ways, self._crosswalks, self._rng = ways, crosswalks, rng
        self.key = key
        self._direction = 1 if rng.random() < 0.5 else -1
        self._speed = float(rng.uniform(*SPEEDS))
        self._set_way(way, station)
        self._next = self._choose()
        self._waited = self._stuck = 0.0
        self.crosswalk, self.across, self.onward = -1, 0.0, 1
        self._crossing: Way | None = None
        x, y, self.height = self._target()
        super().__init__(road, np.array([x, y]), self._heading(), self._speed)
        self._left = (x, y)
        self.staying = 0.0

    def walk(self, dt: float) -> None:
        """Walks on for `dt` [s], or waits for a gap at the kerb."""
        self.staying += dt
        if math.hypot(self.position[0] - self._left[0], self.position[1] - self._left[1]) > PLACE:
            self._left, self.staying = (float(self.position[0]), float(self.position[1])), 0.0
        if self.crashed or self._waits(dt):
            self.speed = 0.0
            return
        x, y, height = self._aim()
        dx, dy = x - self.position[0], y - self.position[1]
        distance = math.hypot(dx, dy)
        wanted = math.atan2(dy, dx)
        heading = self._evade(wanted)
        step = min(self._speed * dt, distance)
        now = (float(self.position[0]), float(self.position[1]))
        then = (now[0] + step * math.cos(heading), now[1] + step * math.sin(heading))
        reach = (now[0] + self._speed * 0.2 * math.cos(heading), now[1] + self._speed * 0.2 * math.sin(heading))
        if would_touch(self, now, reach) or self._bumps(now, then):
            self.speed = 0.0
            self._stuck += dt
            if self._stuck > BLOCKED:
                self._turn_back()
            return
        self._stuck = 0.0
        self.position = np.array(then)
        self.heading, self.speed, self.height = heading, self._speed, height
        if self._crossing is not None:
            self._cross(self._crossing)

    # --- the way ----------------------------------------------------------------------------------------------------

    def _set_way(self, way: int, station: float) -> None:
        self._way_number = way
        self._way: Way = self._ways.ways[way]
        self._station = station

    def _heading(self) -> float:
        return self._way.heading(self._station) + (0.0 if self._direction > 0 else math.pi)

    def _target(self) -> tuple[float, float, float]:
        x, y, z = self._way.place(self._station)
        aside, heading = min(ASIDE, max(self._way.width / 2 - FROM_EDGE, 0.0)), self._heading()
        return x - aside * math.sin(heading), y + aside * math.cos(heading), z

    def _aim(self) -> tuple[float, float, float]:
        """The place to walk towards; it moves on along the way, and to the next way at its end."""
        while True:
            x, y, z = self._target()
            if math.hypot(x - self.position[0], y - self.position[1]) >= AHEAD:
                return x, y, z
            if self._at_end() and not self._enter_next():
                return x, y, z
            self._station = min(max(self._station + STEPS * self._direction, 0.0), self._way.length)

    def _at_end(self) -> bool:
        return self._station >= self._way.length if self._direction > 0 else self._station <= 0.0

    def _node(self) -> int:
        return self._way.ends[1 if self._direction > 0 else 0]

    def _choose(self) -> int:
        """One of the ways on at the end of the present one, by chance; the same back where there is no other."""
        ways = [w for w in self._ways.at[self._node()] if w != self._way_number]
        return ways[int(self._rng.integers(len(ways)))] if ways else self._way_number

    def _enter_next(self) -> bool:
        """Goes over to the next way; onto a crosswalk only once it is free."""
        node, way = self._node(), self._ways.ways[self._next]
        if way.kind is WayKind.CROSSWALK and self._next != self._way_number and not self._may_step(way):
            return False
        if self._next == self._way_number:
            self._direction = -self._direction
        else:
            self._direction = 1 if way.ends[0] == node else -1
            self._set_way(self._next, 0.0 if self._direction > 0 else way.length)
        self._waited = 0.0
        if way.kind is WayKind.CROSSWALK:
            self._crossing, self.crosswalk = way, way.crosswalk
            self._cross(way)
        self._next = self._choose()
        return True

    def _cross(self, way: Way) -> None:
        """Takes note of how far along a crosswalk the walker itself is, not the place that it walks towards."""
        (x0, y0, _), (x1, y1, _) = way.place(0.0), way.place(way.length)
        along = (self.position[0] - x0) * (x1 - x0) + (self.position[1] - y0) * (y1 - y0)
        self.across = float(along / way.length)
        if self._way is way:
            self.onward = self._direction
        elif (self.across if self.onward < 0 else way.length - self.across) < OVER:
            self._crossing, self.crosswalk = None, -1

    def _may_step(self, way: Way) -> bool:
        seconds = (way.length + AHEAD) / self._speed
        return self._crosswalks.may_step(way.crosswalk, self.road.vehicles, self.road.time, seconds, self.height)

    def _waits(self, dt: float) -> bool:
        """Whether the walker stands at a crosswalk."""
        if not self._at_end() or self._ways.ways[self._next].kind is not WayKind.CROSSWALK:
            return False
        x, y, _ = self._target()
        if math.hypot(x - self.position[0], y - self.position[1]) > AHEAD or self._next == self._way_number:
            return False
        if self._enter_next():
            return False
        self._waited += dt
        if self._waited > GIVES_UP:
            self._turn_back()
        return True

    def _turn_back(self) -> None:
        self._waited = self._stuck = 0.0
        self._direction = -self._direction
        self._next = self._choose()

    # --- others -----------------------------------------------------------------------------------------------------

    def _evade(self, wanted: float) -> float:
        """Direction that leads past those who are in the way: away from them, and rather to the right [rad]."""
        c, s = math.cos(wanted), math.sin(wanted)
        x, y = c, s
        for other in self._others():
            dx, dy = other.position[0] - self.position[0], other.position[1] - self.position[1]
            gap = math.hypot(dx, dy) - max(other.LENGTH, other.WIDTH) / 2 + self.WIDTH / 2
            if gap > AVOIDING or dx * c + dy * s < 0.0:
                continue
            right = dy * c - dx * s  # how far to the right of the way it is
            side = -1.0 if right > 0.05 else 1.0
            push = (AVOIDING - gap) / AVOIDING
            x, y = x - side * push * s, y + side * push * c
        return math.atan2(y, x)

    def _bumps(self, now: tuple[float, float], then: tuple[float, float]) -> bool:
        """Whether a step leads closer to somebody who is too close."""
        for other in self._others():
            x, y = other.position
            room = math.hypot(x - then[0], y - then[1]) - (max(other.LENGTH, other.WIDTH) - self.WIDTH) / 2
            if room < SPACE and math.hypot(x - then[0], y - then[1]) < math.hypot(x - now[0], y - now[1]):
                return True
        return False

    def _others(self) -> Iterable[Any]:
        x, y = self.position
        for other in self.road.objects:
            if other is not self and abs(other.position[0] - x) < 4.0 and abs(other.position[1] - y) < 4.0:
                yield other
