"""Room before props: whether a manoeuvre would lead the car so close to one that it cannot get away again."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from dorothie_gym.world.car.hazards import HEIGHT_MARGIN
from dorothie_gym.world.car.lanes import LEAD, MIN_SWITCH, SWITCH_TIME
from dorothie_gym.world.car.path import U_TURN_REACH
from dorothie_gym.world.town.model import Lane

LANDING = 6.0
"""Oncoming lane left after a U-turn, so that the car stands straight before it waits at the lane's end [m]."""

HALF_LENGTH = 2.5
"""Of the car [m]."""

FROM_PROP = 16.5
"""Where a lane switch or a U-turn ends, the car's middle is at least this far before that of a prop, less the way to
stop [m]: `hazards.ROADBLOCK_GAP`, half the car and half the prop."""

BRAKING = 3.0
"""Deceleration that plans count on [m/s^2]."""

Props = Iterable[tuple[float, float, float]]
"""Where the middles of props are: x, y and the height of the road there [m]."""


def switch_is_blocked(props: Props, lane: Lane, station: float, speed: float) -> bool:
    """Whether a prop is too close on the lane to switch to.

    Args:
        props: that the car sees.
        lane: the lane to switch to.
        station: how far along it the car is [m].
        speed: of the car [m/s].
    """
    way = LEAD + max(MIN_SWITCH, SWITCH_TIME * speed) + speed**2 / (2 * BRAKING)
    return _is_blocked(props, lane, station - HALF_LENGTH, station + way + FROM_PROP)


def landing_is_blocked(props: Props, lane: Lane, station: float) -> bool:
    """Whether a prop is too close on an oncoming lane to turn round onto it at a station [m]."""
    return _is_blocked(props, lane, station - U_TURN_REACH, station + LANDING + FROM_PROP)


def _is_blocked(props: Props, lane: Lane, begin: float, end: float) -> bool:
    for x, y, height in props:
        station, lateral = lane.project(np.array((x, y)))
        level = abs(lane.height_at(station) - height) < HEIGHT_MARGIN
        if level and abs(lateral) < lane.width_at(station) / 2 and begin < station < end:
            return True
    return False
