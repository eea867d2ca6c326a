"""Feasibility of the physical actions: the conditions that planner, masks and policies share.

`LocalPlanner.feasible` answers for the manoeuvres of the ego as it stands; the functions here are the conditions, for
policies that know an observation only.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from dorothie_gym.maps.model import LEVEL_HEIGHT, Lane
from dorothie_gym.ontology import SPEED_STEP
from dorothie_gym.sim.ego.limits import (
    EGO_MOVING,
    HALF_LENGTH,
    HARD_STOP,
    LANDING,
    LEAD,
    MANOEUVRE_PROP_GAP,
    MAX_CRUISE,
    MIN_CRUISE,
    MIN_SWITCH,
    PLANNED_BRAKING,
    SWITCH_TIME,
    U_TURN_REACH,
    U_TURN_SPEED,
)

PropPlaces = Iterable[tuple[float, float, float]]
"""Middles of props and the height of the road there (x, y, height) [m]."""


class FeasibleManoeuvres(NamedTuple):
    """Navigation actions that change the path and that the ego would carry out now.

    Attributes:
        lane_follow: a plan other than the lane's own course can still be given up. (A held ego in the middle of a
            manoeuvre accepts LaneFollow as Start; this is not listed.)
        switch_left: lane switch with a positive angle.
        switch_right: lane switch with a negative angle.
        u_turn: U-turn.
        j_turn: a turn at the next junction with a choice, if the path comes to one; refused for the turn that is
            planned already, see `LocalPlanner.turn_ahead`.
    """

    lane_follow: bool
    switch_left: bool
    switch_right: bool
    u_turn: bool
    j_turn: bool


def may_change_cruise(cruise: float, up: bool) -> bool:
    """Returns whether one step more or less leaves the cruise speed [km/h] in its range."""
    return MIN_CRUISE <= cruise + (SPEED_STEP if up else -SPEED_STEP) <= MAX_CRUISE


def is_past_stopping(speed: float, room: float) -> bool:
    """Returns whether a moving ego cannot stop within some room [m] any more, at a speed [m/s]."""
    return speed > EGO_MOVING and speed * speed / (2 * HARD_STOP) > room


def has_room_to_switch(room: float) -> bool:
    """Returns whether a lane that is left to its end for so long [m] has room for a lane switch."""
    return room >= MIN_SWITCH + LEAD


def u_turn_braking(speed: float, squared_speed: float = U_TURN_SPEED**2) -> float:
    """Returns the distance over which the ego brakes to the speed of a U-turn [m].

    Args:
        speed: of the ego [m/s].
        squared_speed: square of the speed of a U-turn [m^2/s^2]; the scripted roles count on 12.0.
    """
    return max(0.0, speed * speed - squared_speed) / (2 * PLANNED_BRAKING)


def u_turn_start(station: float, speed: float) -> float:
    """Returns the station at which a U-turn begins that is requested at a station [m] and speed [m/s]."""
    return station + LEAD * (speed > EGO_MOVING) + u_turn_braking(speed)


def switch_is_blocked(props: PropPlaces, lane: Lane, station: float, speed: float) -> bool:
    """Returns whether a prop is too close on the lane to switch to.

    Args:
        props: props that the ego sees.
        lane: the lane to switch to.
        station: place of the ego along it [m].
        speed: of the ego [m/s].
    """
    way = LEAD + max(MIN_SWITCH, SWITCH_TIME * speed) + speed * speed / (2 * PLANNED_BRAKING)
    return _is_blocked(props, lane, station - HALF_LENGTH, station + way + MANOEUVRE_PROP_GAP)


def landing_is_blocked(props: PropPlaces, lane: Lane, station: float) -> bool:
    """Returns whether a prop is too close on an oncoming lane for a U-turn that ends at a station [m]."""
    return _is_blocked(props, lane, station - U_TURN_REACH, station + LANDING + MANOEUVRE_PROP_GAP)


def _is_blocked(props: PropPlaces, lane: Lane, begin: float, end: float) -> bool:
    for x, y, height in props:
        station, lateral = lane.project(np.array((x, y)))
        level = abs(lane.height_at(station) - height) < LEVEL_HEIGHT
        if level and abs(lateral) < lane.width_at(station) / 2 and begin < station < end:
            return True
    return False
