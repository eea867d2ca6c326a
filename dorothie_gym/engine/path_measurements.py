"""Compiled: where things are along the planned path and around the car.

A path is given by the distances along it `s` (n,) and the positions `points` (n, 2) of its points [m]; the results are
those of `dorothie_gym.sim.ego.path.Path`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import allocating
from dorothie_gym.maps.model import Array
from dorothie_gym.sim.network.lane_lookup import wrap_radians
from dorothie_gym.sim.sensing.seeing import see
from dorothie_gym.sim.world import SensorArrays, World


@allocating
def _index_at(s: Array, at: float) -> int:
    """Number of the point at or before a distance along the path."""
    low, high = 0, len(s)
    while low < high:
        middle = (low + high) // 2
        if at < s[middle]:
            high = middle
        else:
            low = middle + 1
    return max(low - 1, 0)


@allocating
def next_choice(lanes: NDArray[np.int64], here: int, chooses: NDArray[np.bool_]) -> int:
    """Number of the last point of a path that is on the next lane with a choice at its end; -1 if there is none.

    Args:
        lanes: of the points of the path (n,).
        here: point of the path to begin with.
        chooses: of each lane of the town.
    """
    for k in range(here, len(lanes)):
        if chooses[lanes[k]]:
            for last in range(len(lanes) - 1, k, -1):  # the lane may come again, round a block
                if lanes[last] == lanes[k]:
                    return last
            return k
    return -1


@allocating
def write_lanes(lanes: NDArray[np.int64], here: int, table: NDArray[np.int64]) -> None:
    """Writes the lanes of a path from a point of it on, each once, in order, as one more than their numbers."""
    row, last = 0, -1
    for k in range(here, len(lanes)):
        if row == len(table):
            return
        if lanes[k] != last:
            last = lanes[k]
            table[row] = last + 1
            row += 1


@allocating
def progress_on_path(s: Array, points: Array, x: float, y: float, near: float, window: float) -> float:
    """Distance along a path [m] of its closest place to a position, looked for around a known place.

    Before its first and after its last point the path goes on straight.

    Args:
        s: see above.
        points: see above.
        x: position [m].
        y: position [m].
        near: distance along the path close to the answer [m].
        window: how far from `near` to look [m].
    """
    end = len(s) - 1
    best, answer = math.inf, near
    for k in range(_index_at(s, near - window), min(_index_at(s, near + window) + 1, end)):
        ax, ay = points[k, 0], points[k, 1]
        dx, dy = points[k + 1, 0] - ax, points[k + 1, 1] - ay
        t = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
        if (t < 0.0 and k > 0) or (t > 1.0 and k < end - 1):
            t = 0.0 if t < 0.0 else 1.0
        ox, oy = x - ax - t * dx, y - ay - t * dy
        distance = ox * ox + oy * oy
        if distance < best:
            best, answer = distance, s[k] + t * (s[k + 1] - s[k])
    return answer


@allocating
def write_waypoints(s: Array, points: Array, heading: float, start: float, spacing: float, table: Array) -> None:
    """Writes points of a path ahead of a place on it.

    Args:
        s: see above.
        points: see above.
        heading: of the path at its start, before which it goes on straight [rad].
        start: distance along the path [m].
        spacing: from one to the next, and from the start to the first [m].
        table: what is written: positions (m, 2) [m].
    """
    end = len(s) - 1
    for row in range(len(table)):
        at = start + (row + 1) * spacing
        if at < 0.0:
            table[row, 0] = points[0, 0] + at * math.cos(heading)
            table[row, 1] = points[0, 1] + at * math.sin(heading)
            continue
        at = min(at, s[end])
        k = min(_index_at(s, at), end - 1)
        t = min(max((at - s[k]) / (s[k + 1] - s[k]), 0.0), 1.0)
        table[row, 0] = points[k, 0] + t * (points[k + 1, 0] - points[k, 0])
        table[row, 1] = points[k, 1] + t * (points[k + 1, 1] - points[k, 1])


@allocating
def write_objects(
    senses: SensorArrays,
    frame: int,
    x: float,
    y: float,
    heading: float,
    believed_x: float,
    believed_y: float,
    cosine: float,
    sine: float,
    objects: Array,
    believed: Array,
) -> None:
    """Looks at all bodies from the car, and writes those that are perceived as rows of `ObjectColumn`.

    Args:
        senses: what the car sees with, and what there is to be seen (numba takes records in tuples more quickly).
        frame: present frame.
        x: where the car is [m].
        y: where the car is [m].
        heading: of the car [rad].
        believed_x: where it believes itself to be [m].
        believed_y: where it believes itself to be [m].
        cosine: of the angle from its heading to the one it believes to have.
        sine: of the same.
        objects: what is written (m, 8): bodies where they seem to be from the true pose,
        believed: and where they seem to be from the believed one.
    """
    car = senses.vehicles[0]
    count = see(
        senses.vehicles, senses.pedestrians, senses.props, senses.seen, senses.eye[0], car.x, car.y, frame, 0
    )  # fmt: skip
    for row in range(min(count, len(objects))):
        body = senses.seen[row]
        dx, dy = body.x - x, body.y - y
        distance, bearing = math.sqrt(dx * dx + dy * dy), wrap_radians(math.atan2(dy, dx) - heading)
        for table in (objects, believed):
            table[row, 0], table[row, 3], table[row, 4] = body.kind, distance, bearing
            table[row, 5], table[row, 6], table[row, 7] = body.length, body.width, body.speed
        objects[row, 1], objects[row, 2] = body.x, body.y
        believed[row, 1] = believed_x + dx * cosine - dy * sine
        believed[row, 2] = believed_y + dx * sine + dy * cosine


@allocating
def write_path(
    s: Array,
    points: Array,
    lanes: NDArray[np.int64],
    heading: float,
    near: float,
    spacing: float,
    x: float,
    y: float,
    window: float,
    waypoints: Array,
    path_lanes: NDArray[np.int64],
    believed_waypoints: Array,
) -> float:
    """Writes what is shown of a path, as it is and as it seems from a believed position, in one call.

    Args:
        s: see above.
        points: see above.
        lanes: of the points (n,).
        heading: of the path at its start [rad].
        near: where on the path the car is [m].
        spacing: of the waypoints [m].
        x: where the car believes itself to be [m].
        y: where the car believes itself to be [m].
        window: how far from `near` that may be [m].
        waypoints: `write_waypoints` from where the car is.
        path_lanes: `write_lanes` from where the car is.
        believed_waypoints: `write_waypoints` from where it believes itself to be.

    Returns:
        Where on the path the car believes itself to be [m].
    """
    progress = progress_on_path(s, points, x, y, near, window)
    write_waypoints(s, points, heading, near, spacing, waypoints)
    write_lanes(lanes, _index_at(s, near), path_lanes)
    write_waypoints(s, points, heading, progress, spacing, believed_waypoints)
    return progress


# --- Where things are as the Co-Wizard has it: around the car where it believes itself to be, not where i ------------

SEARCH = 6.0
"""Places on the path are looked for this far around where they should be [m], and twice the error of the estimate."""


class EgoMeasurements:
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

    def distance_left(self, distance: float) -> float:
        """How far something on the path seems to be [m] that is `distance` ahead of where the car is."""
        return max(distance - (self.progress - self._near), 0.0)
