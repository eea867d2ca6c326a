"""Measurements along the planned path: waypoints, perceived bodies, and the next junction with a choice."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import allocating, compiled
from dorothie_gym.maps import Exit
from dorothie_gym.maps.model import Array
from dorothie_gym.sim.ego.path_search import SEARCH, point_before, progress_on_path
from dorothie_gym.sim.network.lane_lookup import wrap_radians
from dorothie_gym.sim.sensing.perception import see
from dorothie_gym.sim.state.records import CoursePointRecord, RecordArray
from dorothie_gym.sim.world import SensorArrays, World
from dorothie_gym.spaces import ExitColumn


@compiled
def write_lanes(
    course: RecordArray[CoursePointRecord], count: int, here: int, table: NDArray[np.int64]
) -> None:  # fmt: skip
    """Writes the lanes of a path from a point on, in order and without repetition, as 1 + lane number."""
    row, last = 0, -1
    for k in range(here, count):
        if row == len(table):
            return
        if course[k].lane != last:
            last = course[k].lane
            table[row] = last + 1
            row += 1


@compiled
def write_waypoints(
    course: RecordArray[CoursePointRecord], count: int, start: float, spacing: float, table: Array
) -> None:
    """Writes points of a path ahead of a place on it; before its start, the path is extended straight.

    Args:
        course: points of the path.
        count: number of points.
        start: distance along the path [m].
        spacing: distance between successive points, and from the start to the first [m].
        table: table that is written: positions (m, 2) [m].
    """
    end = count - 1
    for row in range(len(table)):
        at = start + (row + 1) * spacing
        if at < 0.0:
            table[row, 0] = course[0].x + at * math.cos(course[0].heading)
            table[row, 1] = course[0].y + at * math.sin(course[0].heading)
            continue
        at = min(at, course[end].s)
        k = min(point_before(course, count, at), end - 1)
        one, two = course[k], course[k + 1]
        t = min(max((at - one.s) / (two.s - one.s), 0.0), 1.0)
        table[row, 0] = one.x + t * (two.x - one.x)
        table[row, 1] = one.y + t * (two.y - one.y)


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
    """Writes the bodies that the ego perceives as rows of `ObjectColumn`.

    Args:
        senses: records of sensors and bodies (numba unpacks records in tuples faster).
        frame: present frame.
        x: true position of the ego [m].
        y: true position of the ego [m].
        heading: true heading of the ego [rad].
        believed_x: estimated position [m].
        believed_y: estimated position [m].
        cosine: cosine of the angle from the true to the estimated heading.
        sine: sine of that angle.
        objects: table that is written (m, 8): perceived bodies relative to the true pose.
        believed: table that is written (m, 8): perceived bodies relative to the estimated pose.
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


@compiled
def write_path(
    course: RecordArray[CoursePointRecord],
    count: int,
    near: float,
    spacing: float,
    x: float,
    y: float,
    window: float,
    waypoints: Array,
    path_lanes: NDArray[np.int64],
    believed_waypoints: Array,
) -> float:
    """Writes the observed part of a path, from the true and from the estimated position, in one call.

    Args:
        course: points of the path.
        count: number of points.
        near: true distance of the ego along the path [m].
        spacing: distance between waypoints [m].
        x: estimated position of the ego [m].
        y: estimated position of the ego [m].
        window: half width of the search for the estimated position around `near` [m].
        waypoints: `write_waypoints` from the true position.
        path_lanes: `write_lanes` from the true position.
        believed_waypoints: `write_waypoints` from the estimated position.

    Returns:
        Estimated distance of the ego along the path [m].
    """
    progress = progress_on_path(course, count, x, y, near, window)
    write_waypoints(course, count, near, spacing, waypoints)
    write_lanes(course, count, point_before(course, count, near), path_lanes)
    write_waypoints(course, count, progress, spacing, believed_waypoints)
    return progress


# --- measurements from the true and the estimated pose ----------------------------------------------------------------


class EgoMeasurements:
    """Measurements from the true and the estimated pose of the ego at one decision.

    Perceived bodies are measured relative to the ego, so their believed positions have the error of the pose estimate.
    Places on the map are exact, and distances to them have the error of the estimate.

    Attributes:
        pose: estimated pose (x, y, heading) [m, m, rad].
        true_pose: true pose (x, y, heading) [m, m, rad].
        progress: estimated distance along the planned path [m]; the true distance before `write_path`.
    """

    def __init__(self, world: World) -> None:
        car, planner = world.car, world.planner
        self._world = world
        self.pose = world.localizer.pose
        self._x, self._y, self._heading = self.pose.tolist()
        x, y = car.position.tolist()
        self.true_pose = x, y, car.heading
        self._course, self._points = world.actors.arrays.course, int(planner.plan["points"])
        self._near = planner.s
        self.progress = self._near

    def write_path(
        self, spacing: float, waypoints: Array, path_lanes: NDArray[np.int64], believed_waypoints: Array
    ) -> None:  # fmt: skip
        """Writes the observed part of the planned path.

        Args:
            spacing: distance between waypoints along the path [m].
            waypoints: points ahead of the true position (n, 2) [m].
            path_lanes: lanes from the true position on (n,), as 1 + lane number.
            believed_waypoints: points ahead of the estimated position (n, 2) [m]. The path is extended straight before
                its start.
        """
        error = math.hypot(self._x - self.true_pose[0], self._y - self.true_pose[1])
        self.progress = write_path(
            self._course, self._points, self._near, spacing, self._x, self._y, SEARCH + 2.0 * error,
            waypoints, path_lanes, believed_waypoints,
        )  # fmt: skip

    def write_objects(self, objects: Array, believed: Array) -> None:
        """Writes the perceived bodies into two tables, at their true and at their believed positions.

        Distance and bearing in both tables are relative to the ego.
        """
        turn = self._heading - self.true_pose[2]
        write_objects(
            self._world.senses, self._world.frame, *self.true_pose,
            self._x, self._y, math.cos(turn), math.sin(turn), objects, believed,
        )  # fmt: skip

    def distance_left(self, distance: float) -> float:
        """Returns the estimated distance of a place on the path that is `distance` ahead of the true position [m]."""
        return max(distance - (self.progress - self._near), 0.0)


# --- next junction with a choice of exits -----------------------------------------------------------------------------


class TurnOptions(NamedTuple):
    """Exits at a junction.

    Attributes:
        exits: exits from right to left.
        rows: the exits as rows of `ExitColumn` (n, 6); the column of the distance is not filled in.
        distance: distance to the junction along the path [m].
        lane: lane that ends at the junction; -1 if there is none.
    """

    exits: tuple[Exit, ...]
    rows: Array
    distance: float
    lane: int


NO_TURN_OPTIONS = TurnOptions((), np.zeros((0, len(ExitColumn))), 0.0, -1)


class UpcomingJunction:
    """Exits at the next junction with a choice, which `LocalPlanner.choice` finds."""

    def __init__(self, world: World) -> None:
        town = self._town = world.town
        self._planner = world.planner
        self._numbers = {junction.id: k for k, junction in enumerate(town.junctions)}
        self._rows: dict[int, Array] = {}

    def options(self) -> TurnOptions:
        """Returns the exits at the next junction with a choice, or `NO_TURN_OPTIONS`."""
        lane, distance = self._planner.choice
        if lane < 0:
            return NO_TURN_OPTIONS
        return TurnOptions(self._town.exits(lane), self._rows_of(lane), distance, lane)

    def _rows_of(self, lane: int) -> Array:
        rows = self._rows.get(lane)
        if rows is None:
            rows = self._rows[lane] = np.array([self._row(way) for way in self._town.exits(lane)])
        return rows

    def _row(self, way: Exit) -> tuple[float, ...]:
        street = self._town.lanes[way.lane].street
        return 1.0, way.angle, 0.0, way.lane, street, self._numbers.get(way.junction_id, -1)
