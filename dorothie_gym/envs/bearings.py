"""Where things are as the Co-Wizard has it: around the car where it believes itself to be, not where it is."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.envs.measuring import progress_on_path, write_waypoints
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
        x: of it, as a plain number [m]; `y` likewise.
        cosine: of the angle by which the estimated heading is off; `sine` likewise.
        progress: where on its planned path the car believes itself to be [m].
    """

    def __init__(self, world: World) -> None:
        car, planner = world.car, world.planner
        self.pose = world.localizer.pose
        self.x, self.y, heading = self.pose.tolist()
        true_x, true_y = car.position.tolist()
        turn = heading - float(car.heading)
        self.cosine, self.sine = math.cos(turn), math.sin(turn)
        self._path: Path = planner.path
        error = math.hypot(self.x - true_x, self.y - true_y)
        self.progress: float = progress_on_path(
            self._path.s, self._path.points, self.x, self.y, planner.s, SEARCH + 2.0 * error
        )
        self._ahead = self.progress - planner.s

    def way_left(self, distance: float) -> float:
        """How far something on the path seems to be [m] that is `distance` ahead of where the car is."""
        return max(distance - self._ahead, 0.0)

    def waypoints(self, count: int, spacing: float) -> Array:
        """Points of the planned path ahead of where the car believes itself to be (count, 2) [m]."""
        table = np.zeros((count, 2))
        self.write_waypoints(table, spacing)
        return table

    def write_waypoints(self, table: Array, spacing: float) -> None:
        """Writes `waypoints` into a table (count, 2)."""
        path = self._path
        # before its start, which is where the car truly was when it was laid, the path goes on straight
        write_waypoints(path.s, path.points, path.heading_at(0.0), self.progress, spacing, table)
