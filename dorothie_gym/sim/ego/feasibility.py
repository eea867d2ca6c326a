"""Feasibility of the physical actions: the conditions that planner, masks and policies share.

`LocalPlanner.feasible` answers for the manoeuvres of the ego as it stands; the functions here are the conditions, for
policies that know an observation only.
"""

from __future__ import annotations

from typing import NamedTuple

from dorothie_gym.ontology.actions import SPEED_STEP
from dorothie_gym.sim.ego.limits import (
    EGO_MOVING,
    HARD_STOP,
    LEAD,
    MAX_CRUISE,
    MIN_CRUISE,
    MIN_SWITCH,
    PLANNED_BRAKING,
    U_TURN_SPEED,
)


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


def u_turn_braking(speed: float, squared_speed: float = U_TURN_SPEED * U_TURN_SPEED) -> float:
    """Returns the distance over which the ego brakes to the speed of a U-turn [m].

    Args:
        speed: speed of the ego [m/s].
        squared_speed: square of the speed of a U-turn [m^2/s^2]; the scripted roles count on 12.0.
    """
    return max(0.0, speed * speed - squared_speed) / (2 * PLANNED_BRAKING)
