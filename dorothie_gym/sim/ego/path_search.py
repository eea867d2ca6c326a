"""Searches along a path: the point at a distance, and the closest place to a position."""

from __future__ import annotations

import math

from dorothie_gym.compilation import compiled
from dorothie_gym.maps.model import Array

SEARCH = 6.0
"""Half width of the search for a place on the path [m], to which twice the error of the pose estimate is added."""


@compiled
def index_at(s: Array, at: float) -> int:
    """Returns the index of the point at or before a distance along the path."""
    low, high = 0, len(s)
    while low < high:
        middle = (low + high) // 2
        if at < s[middle]:
            high = middle
        else:
            low = middle + 1
    return max(low - 1, 0)


@compiled
def progress_on_path(s: Array, points: Array, x: float, y: float, near: float, window: float) -> float:
    """Returns the distance along a path [m] of its point closest to a position, searched around a known distance.

    The path is extended straight before its first and after its last point.

    Args:
        s: see above.
        points: see above.
        x: position [m].
        y: position [m].
        near: centre of the search along the path [m].
        window: half width of the search [m].
    """
    end = len(s) - 1
    best, answer = math.inf, near
    for k in range(index_at(s, near - window), min(index_at(s, near + window) + 1, end)):
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
