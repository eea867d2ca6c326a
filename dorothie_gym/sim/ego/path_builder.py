"""The whole path of the ego: pieces along lanes, lane switches and U-turns, directions, speeds, places (compiled).

A path is laid twice: the first time its points are only counted, so that nothing changes if there is no room.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dorothie_gym.maps.model import HEADING, HEIGHT, STATION, Array, X, Y
from dorothie_gym.sim.ego.limits import LATERAL_ACCELERATION, PROFILE_BRAKING, U_TURN_SPEED
from dorothie_gym.sim.network.lane_lookup import closest_segment, stretch_near, wrap_radians
from dorothie_gym.sim.traffic.parameters import CAR_LENGTH
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray

if TYPE_CHECKING:
    from dorothie_gym.sim.state.records import CoursePointRecord
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import LaneRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays


# --- Along the centre line of a lane ----------------------------------------------------------------------------------
# Measurements along the centre line of a lane, with the results of `maps.model.Lane` to the last bit (compiled).


@inlined
def segment_at(points: Array, lane: LaneRecord, station: float) -> int:
    """Returns the row of the point of a lane at or before a station [m]."""
    low, high = int(lane.first), int(lane.last) + 1
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle, STATION] <= station:
            low = middle
        else:
            high = middle
    return low


@inlined
def interpolated(points: Array, lane: LaneRecord, segment: int, column: int, station: float) -> float:
    """Interpolates a column of a lane's points as `np.interp`; `segment` is the row at or before the station [m]."""
    start = points[segment, STATION]
    if segment == lane.last or station <= start:
        return float(points[segment, column])
    slope = (points[segment + 1, column] - points[segment, column]) / (points[segment + 1, STATION] - start)
    return float(slope * (station - start) + points[segment, column])


@compiled
def value_on(points: Array, lane: LaneRecord, column: int, station: float) -> float:
    """Interpolates a column of a lane's points as `np.interp`, as `Lane.heading_at` and its like."""
    return interpolated(points, lane, segment_at(points, lane, station), column, station)


@compiled
def position_on(points: Array, lane: LaneRecord, station: float) -> tuple[float, float]:
    """Returns a point of the centre line [m], straight beyond its ends, as `Lane.position`."""
    s = min(max(station, 0.0), points[lane.last, STATION])
    segment, over = segment_at(points, lane, s), station - s
    x, y = interpolated(points, lane, segment, X, s), interpolated(points, lane, segment, Y, s)
    if over == 0.0:
        return x, y
    heading = interpolated(points, lane, segment, HEADING, s)
    return x + over * pm.cos(heading), y + over * pm.sin(heading)


@compiled
def project_on(town: TownArrays, number: int, x: float, y: float) -> tuple[float, float]:
    """Returns station and lateral distance [m] of the closest point of a lane, as `Lane.project`."""
    points = town.points
    first, last = stretch_near(town, number, x, y)
    at, share, _ = closest_segment(points, first, last, x, y)
    dx, dy = points[at + 1, X] - points[at, X], points[at + 1, Y] - points[at, Y]
    aside_x, aside_y = x - (points[at, X] + share * dx), y - (points[at, Y] + share * dy)
    distance = float(pm.hypot(aside_x, aside_y))
    station = points[at, STATION] + share * (points[at + 1, STATION] - points[at, STATION])
    return station, distance if dx * aside_y - dy * aside_x >= 0.0 else -distance


# --- Search along a path ----------------------------------------------------------------------------------------------
# Searches along a path: the point at a distance, and the closest place to a position.

SEARCH = 6.0
"""Half width of the search for a place on the path [m], to which twice the error of the pose estimate is added."""


@compiled
def last_point_before(course: RecordArray[CoursePointRecord], count: int, at: float) -> int:
    """Returns the number of the point at or before a distance along a path of so many points."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if at < course[middle].s:
            high = middle
        else:
            low = middle + 1
    return max(low - 1, 0)


@inlined
def foot_on_segment(
    one: CoursePointRecord, other: CoursePointRecord, x: float, y: float, is_first: bool, is_last: bool
) -> float:
    """Returns where a segment of a path is closest to a position [m], from 0 to 1 between its points.

    Before the first and after the last point the path continues straight: there it is less than 0, or more than 1.
    """
    dx, dy = other.x - one.x, other.y - one.y
    t = ((x - one.x) * dx + (y - one.y) * dy) / (dx * dx + dy * dy)
    if (t < 0.0 and not is_first) or (t > 1.0 and not is_last):
        t = 0.0 if t < 0.0 else 1.0
    return t


@compiled
def progress_on_path(
    course: RecordArray[CoursePointRecord], count: int, x: float, y: float, near: float, window: float
) -> float:
    """Returns the distance along a path [m] of its point closest to a position, searched around a known distance.

    The path is extended straight before its first and after its last point.

    Args:
        course: points of the path.
        count: number of points.
        x: position [m].
        y: position [m].
        near: centre of the search along the path [m].
        window: half width of the search [m].
    """
    end = count - 1
    best, answer = math.inf, near
    first, last = last_point_before(course, count, near - window), last_point_before(course, count, near + window)
    for k in range(first, min(last + 1, end)):
        one, other = course[k], course[k + 1]
        t = foot_on_segment(one, other, x, y, k == 0, k == end - 1)
        ox, oy = x - one.x - t * (other.x - one.x), y - one.y - t * (other.y - one.y)
        distance = ox * ox + oy * oy
        if distance < best:
            best, answer = distance, one.s + t * (other.s - one.s)
    return answer


# --- Limits of a path -------------------------------------------------------------------------------------------------

PATH_SPACING = 1.0
"""Distance between points of a path [m]."""

SAME_PLACE = 1e-3
"""Largest distance of points that count as one point [m]."""

TURNING_RADIUS = 4.5
"""Radius of a U-turn [m]: a little over the 3.8 m of highway-env's bicycle at full lock (60 degrees, 5 m long)."""

END_GAP = 0.8
"""Room between the nose of a waiting ego and the end of its lane [m]."""

SEARCH_RANGE = 6.0
"""Range around the last position in which the ego is searched [m]."""

# --- Points -----------------------------------------------------------------------------------------------------------


@inlined
def count_points(world: WorldArrays, points: int, write: bool) -> bool:
    """Counts the points of a piece, or returns True if they must be written."""
    if not write:
        world.plan[0].needed += points
    return write


@compiled
def append(world: WorldArrays, x: float, y: float, station: float, limit: float, lane: int, manoeuvre: bool) -> None:
    """Appends a point to the path unless it is in the same place as the one before."""
    plan = world.plan[0]
    s = 0.0
    if plan.points > 0:
        if pm.hypot(x - plan.last_x, y - plan.last_y) <= SAME_PLACE:
            plan.last_x, plan.last_y = x, y
            return
        last = world.course[plan.points - 1]
        s = last.s + pm.hypot(x - last.x, y - last.y)
    else:
        plan.limit = limit
    plan.last_x, plan.last_y = x, y
    point = world.course[plan.points]
    point.s, point.x, point.y, point.station = s, x, y, station
    point.speed, point.lane, point.manoeuvre = limit, lane, manoeuvre
    plan.points += 1


# --- Pieces -----------------------------------------------------------------------------------------------------------


@compiled
def follow(town: TownArrays, world: WorldArrays, number: int, start: float, end: float, write: bool) -> None:
    """Lays the stretch along the centre line of a lane between two stations [m]."""
    points, lane = town.points, town.lanes[number]
    count = max(2, math.ceil((end - start) / PATH_SPACING) + 1)
    if not count_points(world, count, write):
        return
    step, segment = (end - start) / (count - 1), segment_at(points, lane, start)
    for k in range(count):
        station = k * step + start if k < count - 1 else end
        while segment < lane.last and points[segment + 1, STATION] <= station:
            segment += 1
        append(
            world,
            interpolated(points, lane, segment, X, station),
            interpolated(points, lane, segment, Y, station),
            station,
            lane.limit,
            number,
            False,
        )


@compiled
def switch(
    town: TownArrays, world: WorldArrays, number: int, beside: int, start: float, distance: float, write: bool
) -> float:
    """Lays the stretch from one lane to the one beside it.

    The lateral shift follows 10 t^3 - 15 t^4 + 6 t^5, which has no jump in curvature at either end.

    Args:
        town: arrays of the town.
        world: arrays of the world.
        number: lane of the ego.
        beside: lane beside it, in the same direction.
        start: distance along the first lane at which it begins [m].
        distance: length of the switch along that lane [m].
        write: whether the points are written or only counted.

    Returns:
        Distance along the other lane at which it ends [m].
    """
    points, source, target = town.points, town.lanes[number], town.lanes[beside]
    count = max(3, math.ceil(distance / PATH_SPACING) + 1)
    x, y = position_on(points, source, start)
    begin, _ = project_on(town, beside, x, y)
    x, y = position_on(points, source, start + distance)
    end, _ = project_on(town, beside, x, y)
    if count_points(world, count, write):
        limit = min(source.limit, target.limit)
        for k in range(count):
            t = k * (1.0 / (count - 1)) if k < count - 1 else 1.0
            weight = t * t * t * (10.0 - 15.0 * t + 6.0 * (t * t))
            here, there = start + t * distance, begin + t * (end - begin)
            one, other = segment_at(points, source, here), segment_at(points, target, there)
            append(
                world,
                (1.0 - weight) * interpolated(points, source, one, X, here)
                + weight * interpolated(points, target, other, X, there),
                (1.0 - weight) * interpolated(points, source, one, Y, here)
                + weight * interpolated(points, target, other, Y, there),
                there,
                limit,
                beside,
                True,
            )
    return begin + 1.0 * (end - begin)


@compiled
def u_turn(town: TownArrays, world: WorldArrays, number: int, oncoming: int, start: float, write: bool) -> None:
    """Lays the stretch from a lane to the oncoming one across the middle of the road.

    Where the lanes are closer than two radii the ego first swings out: arcs to the kerb, away from it by more than a
    half circle, to the kerb again, whose lateral shifts add up to the distance d of the lanes:
    cos(swing) = (d + 2 r) / (4 r).

    Args:
        town: arrays of the town.
        world: arrays of the world.
        number: lane of the ego.
        oncoming: the other lane.
        start: distance along the first lane at which it begins [m].
        write: whether the points are written or only counted.
    """
    points, source, target = town.points, town.lanes[number], town.lanes[oncoming]
    x, y = position_on(points, source, start)
    station, lateral = project_on(town, oncoming, x, y)
    course, limit = value_on(points, source, HEADING, start), min(source.limit, target.limit)
    gap, radius = abs(lateral), TURNING_RADIUS
    swings = gap < 2.0 * radius
    swing = pm.acos((gap + 2.0 * radius) / (4.0 * radius)) if swings else 0.0
    if count_points(world, 1, write):
        append(world, x, y, station, limit, oncoming, True)
    for k in range(3 if swings else 2):
        if swings:
            outward, angle = k != 1, math.pi + 2.0 * swing if k == 1 else swing
        else:
            outward, angle = False, math.pi / 2.0
            if k == 1 and gap - 2.0 * radius > 0.0:
                x, y = x + (gap - 2.0 * radius) * pm.cos(course), y + (gap - 2.0 * radius) * pm.sin(course)
                if count_points(world, 1, write):
                    append(world, x, y, station, limit, oncoming, True)
        steps = max(2, math.ceil(radius * angle / (PATH_SPACING / 2.0)))
        turn = town.sign * (angle / steps if outward else -(angle / steps))  # headings are clockwise
        chord = 2.0 * radius * pm.sin(abs(turn) / 2.0)
        if count_points(world, steps, write):
            for _ in range(steps):
                x, y = x + chord * pm.cos(course + turn / 2.0), y + chord * pm.sin(course + turn / 2.0)
                course += turn
                append(world, x, y, station, limit, oncoming, True)


@compiled
def keep(town: TownArrays, world: WorldArrays, first: int, end: int, write: bool) -> None:
    """Lays the points from `first` to before `end` of the current path, which is being replaced."""
    if not count_points(world, end - first, write):
        return
    course, lane, limit = world.course, world.plan[0].lane, _limit_in_manoeuvre(town, world, first)
    for k in range(first, end):  # the points move to the front
        point = course[k]
        append(world, point.x, point.y, point.station, limit, lane, True)


@compiled
def _limit_in_manoeuvre(town: TownArrays, world: WorldArrays, number: int) -> float:
    """Returns the speed limit at a point of a lane switch or U-turn [m/s]: the lower one of its two lanes."""
    course, lane, k = world.course, world.course[number].lane, number
    while k >= 0 and course[k].manoeuvre and course[k].lane == lane:
        k -= 1
    if k < 0:  # the path begins in it
        return float(world.plan[0].limit)
    return min(town.lanes[course[k].lane].limit, town.lanes[lane].limit)


@compiled
def height_at_point(town: TownArrays, world: WorldArrays, number: int) -> float:
    """Returns the height of a point of the whole path [m]."""
    point = world.course[number]
    return value_on(town.points, town.lanes[point.lane], HEIGHT, point.station)


# --- Directions and speeds --------------------------------------------------------------------------------------------


@compiled
def finish(world: WorldArrays) -> None:
    """Completes a new path: directions, length, allowed speeds, version."""
    plan = world.plan[0]
    plan.length = world.course[plan.points - 1].s
    find_headings(world.course, plan.points)
    find_speeds(world.course, plan.points, find_end(world))
    plan.version += 1


@compiled
def find_end(world: WorldArrays) -> float:
    """Returns the place of a stop at the end of the path [m]; infinite where the path continues."""
    plan = world.plan[0]
    return plan.length - CAR_LENGTH / 2.0 - END_GAP if plan.open_end else math.inf


@compiled
def find_headings(course: RecordArray[CoursePointRecord], count: int) -> None:
    """Computes the direction of a path at each of its points, unwrapped [rad].

    The directions of the segments are those at their centres, between which they are interpolated; both ends
    extrapolate the curvature.

    Args:
        course: points, read and written.
        count: number of points, at least 2.
    """
    last = count - 1
    wrapped = unwrapped = pm.atan2(course[1].y - course[0].y, course[1].x - course[0].x)
    middle, turns = (course[0].s + course[1].s) / 2.0, 0.0
    course[0].heading = course[1].heading = unwrapped
    for k in range(1, last):
        before, unwrapped_before, middle_before = wrapped, unwrapped, middle
        point, after = course[k], course[k + 1]
        wrapped = pm.atan2(after.y - point.y, after.x - point.x)
        turn = wrapped - before
        if abs(turn) > math.pi:
            turns += wrap_radians(turn) - turn
        unwrapped, middle = wrapped + turns, (point.s + after.s) / 2.0
        bend = (unwrapped - unwrapped_before) / (middle - middle_before)
        point.heading = bend * (point.s - middle_before) + unwrapped_before
        if k == 1:
            bent = (unwrapped - unwrapped_before) * middle_before / (middle - middle_before)
            course[0].heading = unwrapped_before - bent
        after.heading = unwrapped + bend * (after.s - middle)


@compiled
def curvature(course: RecordArray[CoursePointRecord], count: int, k: int) -> float:
    """Returns the curvature of a path at a point, positive to the right [1/m], as `np.gradient` of the directions."""
    if k == 0 or k == count - 1:
        one, other = course[max(k - 1, 0)], course[max(k, 1)]
        return (other.heading - one.heading) / (other.s - one.s)
    one, here, other = course[k - 1], course[k], course[k + 1]
    before, after = here.s - one.s, other.s - here.s
    a, c = -after / (before * (before + after)), before / (after * (before + after))
    b = (after - before) / (before * after)
    return a * one.heading + b * here.heading + c * other.heading


@compiled
def find_speeds(course: RecordArray[CoursePointRecord], count: int, stop_at: float) -> None:
    """Computes the speed that curves, limits and the end of a path allow at each of its points [m/s].

    Args:
        course: points, read and written; their speeds are limits before.
        count: number of points, at least 2.
        stop_at: distance along the path at which the ego has to stop [m], or infinite.
    """
    third = 1.0 / 3.0
    here = abs(curvature(course, count, 0))
    before = here
    for k in range(count):
        after = abs(curvature(course, count, min(k + 1, count - 1)))
        bend = before * third + here * third + after * third
        before, here = here, after
        point = course[k]
        squared = min(point.speed * point.speed, LATERAL_ACCELERATION / max(bend, 1e-4))
        if point.manoeuvre and bend > 0.1:
            squared = min(squared, U_TURN_SPEED * U_TURN_SPEED)
        point.speed = 0.0 if point.s >= stop_at else squared
    # v^2 may grow by 2 a ds towards the past: a running minimum from the end
    least = math.inf
    for k in range(count - 1, -1, -1):
        point = course[k]
        slope = 2.0 * PROFILE_BRAKING * point.s
        least = min(least, point.speed + slope)
        point.speed = math.sqrt(max(least - slope, 0.0))


# --- Places -----------------------------------------------------------------------------------------------------------


@compiled
def point_before(world: WorldArrays, s: float) -> int:
    """Returns the number of the point of the whole path at or before a distance along it [m]."""
    course, low, high = world.course, 0, int(world.plan[0].points)
    while high - low > 1:
        middle = (low + high) // 2
        if course[middle].s <= s:
            low = middle
        else:
            high = middle
    return low


@compiled
def place_of_ego(world: WorldArrays) -> tuple[float, float]:
    """Returns the position that follows from the ego's place on its path [m]."""
    car, course = world.car[0], world.course
    k = min(point_before(world, car.s), int(world.plan[0].points) - 2)
    one, other = course[k], course[k + 1]
    t = min(max((car.s - one.s) / (other.s - one.s), 0.0), 1.0)
    x, y = one.x + t * (other.x - one.x), one.y + t * (other.y - one.y)
    heading = one.heading + t * (other.heading - one.heading)
    return x - car.offset * pm.sin(heading), y + car.offset * pm.cos(heading)


@compiled
def enter(world: WorldArrays, x: float, y: float) -> None:
    """Finds the ego's place at the start of a new path from its position [m]."""
    car, course, last = world.car[0], world.course, int(world.plan[0].points) - 1
    best, s, offset = math.inf, 0.0, 0.0
    for k in range(min(point_before(world, SEARCH_RANGE) + 1, last)):
        one, other = course[k], course[k + 1]
        dx, dy = other.x - one.x, other.y - one.y
        t = foot_on_segment(one, other, x, y, k == 0, k == last - 1)
        ox, oy = x - one.x - t * dx, y - one.y - t * dy
        gap = ox * ox + oy * oy
        if gap < best:
            best, s = gap, one.s + t * (other.s - one.s)
            offset = (1.0 if dx * oy - dy * ox >= 0.0 else -1.0) * math.sqrt(gap)
    car.s, car.offset = s, offset
