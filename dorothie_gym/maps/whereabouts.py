"""Whereabouts of places beside the road: their side of the street, corners, and lights and signs nearby."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.maps.model import NO_STREET, SignalKind
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

CORNER_DISTANCE = 60.0
"""Distance to the centre of a junction within which a place is near the corner [m]: half a block of the towns."""

SIGNAL_DISTANCE = 30.0
"""Distance within which a place is beside a traffic light or sign [m]."""


def is_on_right(town: Town, lane: int, x: float, y: float) -> bool:
    """Returns whether a point [m] lies to the right of a lane, in driving direction."""
    return town.lanes[lane].project(np.array((x, y)))[1] >= 0.0


def corner_of(town: Town, street: int, x: float, y: float, within: float = CORNER_DISTANCE) -> int | None:
    """Returns the street that crosses a street at the junction nearest to a point; None if no junction is near.

    Args:
        town: the map.
        street: index of the street on which the point lies.
        x: position [m].
        y: position [m].
        within: largest distance to the centre of the junction [m].
    """
    near = [
        (pm.hypot(corner.x - x, corner.y - y), corner.streets - {street})
        for corner in _corners(town)
        if street in corner.streets
    ]
    crossed = [(distance, min(others)) for distance, others in near if len(others) == 1 and distance <= within]
    return min(crossed)[1] if crossed else None


def is_near_corner(town: Town, street: int, cross: int, x: float, y: float, within: float) -> bool:
    """Returns whether two streets meet within a distance of a point [m]."""
    return any(
        {street, cross} <= corner.streets and pm.hypot(corner.x - x, corner.y - y) <= within
        for corner in _corners(town)
    )


def signals_near(town: Town, x: float, y: float, within: float = SIGNAL_DISTANCE) -> frozenset[SignalKind]:
    """Returns the kinds of the lights and signs within a distance of a point [m]."""
    return frozenset(
        signal.kind for signal in town.signals if pm.hypot(signal.position[0] - x, signal.position[1] - y) <= within
    )


class _Corner(NamedTuple):
    """Centre of a junction [m], and the named streets that meet there."""

    x: float
    y: float
    streets: frozenset[int]


@lru_cache(maxsize=16)
def _corners(town: Town) -> tuple[_Corner, ...]:
    streets: dict[int, set[int]] = {junction.id: set() for junction in town.junctions}
    for lane in town.lanes:
        for way in town.exits(lane.id):
            if way.junction_id in streets:
                streets[way.junction_id] |= {lane.street, town.lanes[way.lane].street}
    return tuple(
        _Corner(*junction.position, frozenset(streets[junction.id] - {NO_STREET})) for junction in town.junctions
    )
