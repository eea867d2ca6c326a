"""Oriented boxes: whether two things touch."""

from __future__ import annotations

import math
from typing import Any, NamedTuple


class Box(NamedTuple):
    """Outline of a thing on the ground: its middle [m], heading [rad], length along it and width across it [m]."""

    x: float
    y: float
    heading: float
    length: float
    width: float

    @classmethod
    def of(cls, thing: Any) -> Box:
        """The outline of a highway-env object as it stands."""
        x, y = thing.position
        return cls(float(x), float(y), float(thing.heading), float(thing.LENGTH), float(thing.WIDTH))


def boxes_touch(one: Box, other: Box) -> bool:
    """Whether two boxes have a point in common, by the separating axis theorem (Gottschalk et al. 1996, in the plane).

    Boxes are convex: they are apart if and only if they are so along one of the four directions of their sides.
    """
    dx, dy = other.x - one.x, other.y - one.y
    turn = other.heading - one.heading
    parallel, square = abs(math.cos(turn)), abs(math.sin(turn))
    for box, foe in ((one, other), (other, one)):
        c, s = math.cos(box.heading), math.sin(box.heading)
        along, across = abs(dx * c + dy * s), abs(dy * c - dx * s)
        if along > (box.length + foe.length * parallel + foe.width * square) / 2:
            return False
        if across > (box.width + foe.length * square + foe.width * parallel) / 2:
            return False
    return True
