"""Where things are as the Co-Wizard has it: around the car where it believes itself to be, not where it is."""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from dorothie_gym.envs.measuring import write_objects, write_path
from dorothie_gym.world.town.model import Array
from dorothie_gym.world.world import World

SEARCH = 6.0
"""Places on the path are looked for this far around where they should be [m], and twice the error of the estimate."""


class Bearings:
    """Places told from the true and from the estimated pose.

    What the car sees is relative to the car, so on the map it is as far off as the car itself; what is on the map lies
    where the map says, and how far it is follows from the estimate.

    Attributes:
        pose: estimate (x, y, heading) [m, m, rad].
        progress: where on its planned path the car believes itself to be [m]; where it is until `write_path`.
    """

    def __init__(self, world: World) -> None:
        car, planner = world.car, world.planner
        self._world = world
        self.pose = world.localizer.pose
        self._x, self._y, self._heading = self.pose.tolist()
        self._true_x, self._true_y = car.position.tolist()
        self._true_heading = float(car.heading)
        self._path, self._near = planner.path, planner.s
        self.progress = self._near

    def write_path(
        self, spacing: float, waypoints: Array, path_lanes: NDArray[Any], believed_waypoints: Array
    ) -> None:  # fmt: skip
        """Writes what is shown of the planned path.

        Args:
            spacing: of the waypoints along the path [m].
            waypoints: points ahead of where the car is (n, 2) [m].
            path_lanes: lanes from there on (n,), as one more than their numbers.
            believed_waypoints: points ahead of where it believes itself to be (n, 2) [m]. Before its start, which is
                where the car truly was when it was laid, the path goes on straight.
        """
        path = self._path
        error = math.hypot(self._x - self._true_x, self._y - self._true_y)
        self.progress = write_path(
            path.s, path.points, path.lanes, path.heading, self._near, spacing,
            self._x, self._y, SEARCH + 2.0 * error, waypoints, path_lanes, believed_waypoints,
        )  # fmt: skip

    def write_objects(self, objects: Array, believed: Array) -> None:
        """Writes bodies that the car perceives where they are into one table, where they are believed into another.

        Distance and bearing in both are those from the car.
        """
        turn = self._heading - self._true_heading
        write_objects(
            self._world.senses, self._world.frame, self._true_x, self._true_y, self._true_heading,
            self._x, self._y, math.cos(turn), math.sin(turn), objects, believed,
        )  # fmt: skip

    def way_left(self, distance: float) -> float:
        """How far something on the path seems to be [m] that is `distance` ahead of where the car is."""
        return max(distance - (self.progress - self._near), 0.0)
