"""Limits and tunables of the ego car, and the feasibility of its physical actions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from dorothie_gym.ontology.actions import SPEED_STEP
from dorothie_gym.support import portable_math as pm

# --- Pedals and steering ----------------------------------------------------------------------------------------------

MAX_STEERING = math.pi / 3
"""Front wheel angle at full lock [rad], highway-env's."""

MAX_SLIP = pm.atan(pm.tan(MAX_STEERING) / 2)
"""Slip angle at full lock [rad]."""

MAX_ACCELERATION = 3.0
"""Acceleration at full throttle [m/s^2]."""

MAX_BRAKING = 8.0
"""Deceleration at full brake [m/s^2]; a dry road gives about 0.8 g."""


@dataclass(frozen=True, kw_only=True)
class VehicleControl:
    """Input of the ego's actuators, normalised (paper, appendix A.2).

    Attributes:
        throttle: in [0, 1].
        steer: in [-1, 1], positive right.
        brake: in [0, 1].
    """

    throttle: float
    steer: float
    brake: float

    @property
    def acceleration(self) -> float:
        """Acceleration on a dry road [m/s^2]."""
        return self.throttle * MAX_ACCELERATION - self.brake * MAX_BRAKING

    @property
    def steering_angle(self) -> float:
        """Front wheel angle [rad], positive right."""
        return self.steer * MAX_STEERING


class PIDGains(NamedTuple):
    """Gains of a controller; the integral is kept within `integral_limit`."""

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    integral_limit: float = 1.0


LATERAL = PIDGains(proportional=1.2, integral=0.1, derivative=0.1, integral_limit=0.5)
"""Controller of the distance from the path [m]."""

LONGITUDINAL = PIDGains(proportional=1.6, integral=0.15, integral_limit=0.8)
"""Controller of the speed [m/s]."""

# --- Speeds -----------------------------------------------------------------------------------------------------------

KMH = 1 / 3.6
"""[m/s] of one km/h."""

MIN_CRUISE, MAX_CRUISE = 5.0, 90.0
"""Range of the cruise speed [km/h]."""

EGO_STANDING = 0.1
"""Speed below which the ego counts as standing [m/s]."""

EGO_MOVING = 0.5
"""Speed above which the stopping distance matters for a manoeuvre [m/s]."""

U_TURN_SPEED = 3.5
"""Speed of a U-turn [m/s]."""

APPROACH_SPEED = 14.0 * KMH
"""Speed near a goal, under the design's 15 km/h [m/s]."""

APPROACH_DISTANCE = 20.0
"""Distance to a goal below which `APPROACH_SPEED` applies [m]."""

BLIND_SPEED = 1.5
"""Speed when there is almost no sight [m/s]."""

# --- Accelerations ----------------------------------------------------------------------------------------------------

LATERAL_ACCELERATION = 2.2
"""Comfortable lateral acceleration in curves [m/s^2]."""

PROFILE_BRAKING = 2.0
"""Deceleration towards a curve or the end of the path [m/s^2]."""

SURE_BRAKING = 1.8
"""Required deceleration at which the brake overrides the speed controller [m/s^2]."""

PLANNED_BRAKING = 3.0
"""Deceleration of the action Stop, and the one that plans count on [m/s^2]."""

HARD_STOP = 5.0
"""Deceleration with which the ego still stops before a junction when its plan is changed [m/s^2]."""

# --- Room for manoeuvres ----------------------------------------------------------------------------------------------

HALF_LENGTH = 2.5
"""Half the length of the ego [m]."""

PROP_DEPTH = 1.25
"""Half the length of the longest prop [m]: a prop is in sight when its centre is."""

LEAD = 1.0
"""Path before the start of a manoeuvre [m]."""

BEGUN = 1.0
"""Distance after which a manoeuvre from a standstill counts as begun [m]."""

SWITCH_TIME = 3.0
"""Duration of a lane switch [s]."""

MIN_SWITCH = 14.0
"""Length of the shortest lane switch [m]."""

U_TURN_REACH = 14.0
"""Room ahead of its centre that the ego needs for a U-turn [m]: 11 m for its centre where lanes are 3.5 m apart, 1 m
for its side, and the clearance beside it."""

U_TURN_SAMPLES = 4
"""Step in the points of a U-turn, half a metre apart, at which traffic checks for a conflict."""

LANDING = 6.0
"""Oncoming lane left after a U-turn [m], so that the ego stands straight before it waits at the lane's end."""

MANOEUVRE_PROP_GAP = 16.5
"""Minimum distance between the centres of ego and prop at the end of a lane switch or U-turn [m], without the
stopping distance: `obstacles.ROADBLOCK_GAP`, half the ego and half the prop."""


# --- Feasibility of physical actions ----------------------------------------------------------------------------------
# Feasibility of the physical actions: the conditions that planner, masks and policies share.
#
# `LocalPlanner.feasible` answers for the manoeuvres of the ego as it stands; the functions here are the conditions,
# for policies that know an observation only.


class FeasibleManoeuvres(NamedTuple):
    """Navigation actions that change the path and that the ego would carry out now.

    Attributes:
        lane_follow: a plan other than the lane's own course can still be given up. (A held ego in the middle of a
            manoeuvre accepts LaneFollow as Start; this is not listed.)
        switch_left: lane switch with a positive angle.
        switch_right: lane switch with a negative angle.
        u_turn: U-turn.
        j_turn: a turn at the next junction with a choice, if the path reaches one; refused for the turn that is
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


def cruise_by_limit(limit: float) -> float:
    """Returns the cruise speed on a lane with a speed limit [m/s]: a whole number of steps, not below the limit [km/h].

    The path keeps the ego at the limit itself.
    """
    return float(min(max(SPEED_STEP * math.ceil(limit / KMH / SPEED_STEP - 1e-6), MIN_CRUISE), MAX_CRUISE))


def is_past_stopping(speed: float, room: float) -> bool:
    """Returns whether a moving ego can no longer stop within a distance [m], at a speed [m/s]."""
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
