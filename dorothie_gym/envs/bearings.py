"""Where things are as the Co-Wizard has it: around the car where it believes itself to be, not where it is."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.world.car.path import Path
from dorothie_gym.world.town.model import Array
from dorothie_gym.world.world import World

SEARCH = 6.0
"""Places on the path are looked for this far around where they should be [m], and twice the error of the estimate."""


class Bearings:
    """Places told from the estimated pose.

    What the car sees is relative to the car, so on the map it is as far off as the car itself; what is on the map lies
    where the map says, and how far it is follows from the estimate.

    Attributes:
        pose: estimate (x, y, heading) [m, m, rad].
        progress: where on its planned path the car believes itself to be [m].
    """

    def __init__(self, world: World) -> None:
        car, planner = world.car, world.planner
        self.pose = world.localizer.pose
        self._true = (float(car.position[0]), float(car.position[1]))
        self._x, self._y = float(self.pose[0]), float(self.pose[1])
        turn = float(self.pose[2]) - float(car.heading)
        self._cos, self._sin = math.cos(turn), math.sin(turn)
        self._path: Path = planner.path
        error = math.hypot(self._x - self._true[0], self._y - self._true[1])
        self.progress, _ = self._path.project(self._x, self._y, planner.s, SEARCH + 2.0 * error)
        self._ahead = self.progress - planner.s

    def seen(self, x: float, y: float) -> tuple[float, float]:
        """Where on the map something seems to be that is seen at a true place [m]."""
        dx, dy = x - self._true[0], y - self._true[1]
        return self._x + dx * self._cos - dy * self._sin, self._y + dx * self._sin + dy * self._cos

    def way_left(self, distance: float) -> float:
        """How far something on the path seems to be [m] that is `distance` ahead of where the car is."""
        return max(distance - self._ahead, 0.0)

    def waypoints(self, count: int, spacing: float) -> Array:
        """Points of the planned path ahead of where the car believes itself to be (count, 2) [m]."""
        return np.array([self._point(self.progress + (k + 1) * spacing) for k in range(count)])

    def _point(self, s: float) -> tuple[float, float]:
        if s >= 0.0:
            return self._path.position_at(min(s, self._path.length))
        # before its start, which is where the car truly was when it was laid, the path goes on straight
        x, y = self._path.position_at(0.0)
        heading = self._path.heading_at(0.0)
        return x + s * math.cos(heading), y + s * math.sin(heading)
