"""Feasibility of manoeuvres, judged from a role's observation.

Policies that need to know which actions the car would accept read the engine's mask (`Policy.reads_mask`). The
functions here
are for roles that decide by their own belief: the scripted Co-Wizard, whose refused commands are part of the recorded
sessions, and drivers that are trained and measured with an estimated mask. The engine knows the planned path and the
true place of the car; its mask differs where the pose is inaccurate, a manoeuvre is in progress, or a roadblock leaves
too little room.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.maps.lane_neighbours import oncoming_lanes
from dorothie_gym.policies.route_legs import SWITCH_ROOM
from dorothie_gym.policies.route_progress import U_TURN_SPEED_SQUARED
from dorothie_gym.sim.ego.limits import EGO_MOVING, LEAD, u_turn_braking

if TYPE_CHECKING:
    from dorothie_gym.maps.model import LinkType
    from dorothie_gym.maps.town import Town


def slowing_distance(speed: float, target_squared: float = U_TURN_SPEED_SQUARED) -> float:
    """Returns the distance in which the car slows down for a U-turn [m].

    Args:
        speed: current speed [m/s].
        target_squared: square of the speed of the U-turn [m^2/s^2].
    """
    return u_turn_braking(speed, target_squared)


def u_turn_start(station: float, speed: float, target_squared: float = U_TURN_SPEED_SQUARED) -> float:
    """Returns the station at which a U-turn commanded now would begin [m]; arguments as in `slowing_distance`."""
    return station + slowing_distance(speed, target_squared) + LEAD * (speed > EGO_MOVING)


def can_turn_round(town: Town, lane: int, start: float) -> bool:
    """Returns whether a lane has an oncoming lane beside it at the start of a U-turn [m], or at its end if nearer."""
    return oncoming_lanes(town).at(lane, min(start, town.lanes[lane].length)) is not None


def can_switch_lane(town: Town, lane: int, station: float, side: LinkType, room: float = SWITCH_ROOM) -> bool:
    """Returns whether a lane has a neighbour on a side, and more than `room` metres are left to change to it.

    A lane that ends may be left up to its end, and entered only where there is room to leave it again.
    """
    beside = town.neighbour(lane, side)
    if beside is None:
        return False
    if town.merge(lane) is side:
        return True
    if town.merge(beside) is not None:
        there, _ = town.lanes[beside].project(town.lanes[lane].position(station))
        if there + 2.0 * room > town.lanes[beside].wide_until:
            return False
    return town.lanes[lane].length - station > room
