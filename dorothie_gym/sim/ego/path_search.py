"""Searches along a path: the point at a distance, and the closest place to a position."""

from __future__ import annotations

import math

from dorothie_gym.sim.state.ego_records import CoursePointRecord
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import RecordArray

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
