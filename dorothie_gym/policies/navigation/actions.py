"""Discrete driving actions, their meaning as physical actions of the Co-Wizard, and an estimate of their mask."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.policies.feasibility import can_switch_lane, can_turn_round, u_turn_start
from dorothie_gym.policies.navigation.junction_exits import SECTORS, JunctionExits
from dorothie_gym.sim.ego.feasibility import is_past_stopping
from dorothie_gym.sim.ego.limits import HALF_LENGTH, LEAD, MAX_CRUISE, MIN_CRUISE, MIN_SWITCH, U_TURN_SPEED
from dorothie_gym.spaces import ExitColumn, Motion, ObservationMapping, Physical

LEFT, RIGHT = 90, -90
"""Angles of a lane switch [degrees]."""


class NavigationAction(enum.IntEnum):
    """Action of `Navigation-v0`; the last eight take the exit in a sector of the next junction with a choice."""

    NOTHING = 0
    LANE_FOLLOW = 1
    SWITCH_LEFT = 2
    SWITCH_RIGHT = 3
    U_TURN = 4
    STOP = 5
    START = 6
    FASTER = 7
    SLOWER = 8
    LIGHTS = 9
    """Switches the head lights."""
    TURN_BACK = 10
    TURN_SHARP_RIGHT = 11
    TURN_RIGHT = 12
    TURN_HALF_RIGHT = 13
    TURN_STRAIGHT = 14
    TURN_HALF_LEFT = 15
    TURN_LEFT = 16
    TURN_SHARP_LEFT = 17

    @property
    def sector(self) -> int | None:
        """Sector of a turn, an index of `junction_exits.SECTORS`; None for other actions."""
        return int(self) - FIRST_TURN if int(self) >= FIRST_TURN else None

    @classmethod
    def turn(cls, sector: int) -> NavigationAction:
        """Returns the action that turns into a sector."""
        return cls(FIRST_TURN + sector)


FIRST_TURN = 10
ACTIONS = tuple(NavigationAction)
assert len(ACTIONS) == FIRST_TURN + len(SECTORS)

PLAIN_ACTIONS: Final[Mapping[int, Physical]] = {
    NavigationAction.LANE_FOLLOW: Physical(action=PhysicalAction.LANE_FOLLOW),
    NavigationAction.SWITCH_LEFT: Physical(action=PhysicalAction.LANE_SWITCH, angle=LEFT),
    NavigationAction.SWITCH_RIGHT: Physical(action=PhysicalAction.LANE_SWITCH, angle=RIGHT),
    NavigationAction.U_TURN: Physical(action=PhysicalAction.U_TURN),
    NavigationAction.STOP: Physical(action=PhysicalAction.STOP),
    NavigationAction.START: Physical(action=PhysicalAction.START),
    NavigationAction.FASTER: Physical(action=PhysicalAction.SPEED_CHANGE, up=True),
    NavigationAction.SLOWER: Physical(action=PhysicalAction.SPEED_CHANGE, up=False),
}
"""Physical actions of the actions that do not depend on the observation."""


UNDER_WAY = {
    NavigationAction.SWITCH_LEFT: (PhysicalAction.LANE_SWITCH, LEFT),
    NavigationAction.SWITCH_RIGHT: (PhysicalAction.LANE_SWITCH, RIGHT),
    NavigationAction.U_TURN: (PhysicalAction.U_TURN, 0),
}
"""Manoeuvres, and the value of `LocalPlanner.manoeuvre` while they are prepared or driven."""


def physical_of(action: NavigationAction, observation: ObservationMapping, exits: JunctionExits) -> Physical | None:
    """Maps an action to a physical action; None for no action.

    A manoeuvre that is being prepared continues when it is chosen again, so a driver may repeat an action until it
    takes effect. A turn into a sector without an exit becomes a turn by the sector's angle: the car refuses it, or
    takes the exit that fits best.

    Args:
        action: action chosen.
        observation: observation of the Co-Wizard.
        exits: exits of the town's junctions.
    """
    if action is NavigationAction.NOTHING or prepares(action, observation, exits):
        return None
    if action is NavigationAction.LIGHTS:
        return Physical(action=PhysicalAction.LIGHT_CHANGE, up=not observation["lights"])
    sector = action.sector
    if sector is None:
        return PLAIN_ACTIONS[action]
    angle = _angle_of(sector, observation, exits)
    return Physical(action=PhysicalAction.J_TURN, angle=SECTORS[sector] if angle is None else angle)


def prepares(action: NavigationAction, observation: ObservationMapping, exits: JunctionExits) -> bool:
    """Returns whether the car prepares or carries out an action already."""
    if int(observation["motion"]) == Motion.STOPPED:
        return False
    manoeuvre = UNDER_WAY.get(action)
    if action.sector is not None:
        angle = _angle_of(action.sector, observation, exits)
        manoeuvre = None if angle is None else (PhysicalAction.J_TURN, angle)
    return manoeuvre == (int(observation["manoeuvre"]), int(observation["manoeuvre_angle"][0]))


def _angle_of(sector: int, observation: ObservationMapping, exits: JunctionExits) -> int | None:
    """Returns the angle of the exit in a sector of the next junction [degrees]; None where the sector has none."""
    choice = exits.choice_ahead(observation)
    way = exits.by_sector(choice)[sector] if choice is not None else None
    return None if way is None else way.angle


# --- estimated mask ---------------------------------------------------------------------------------------------------

END_TOLERANCE = 0.5
"""Distance by which a U-turn may begin behind the end of its lane [m]."""

_OFF_LINE = (PhysicalAction.LANE_SWITCH, PhysicalAction.U_TURN)
_SIDES = {
    NavigationAction.SWITCH_LEFT: LinkType.LANE_CHANGE_LEFT,
    NavigationAction.SWITCH_RIGHT: LinkType.LANE_CHANGE_RIGHT,
}


class EstimatedActionMask:
    """Estimate of the mask of `NavigationEnv`.

    The mask of the environment follows from the planned path. This estimate knows neither the progress of a lane
    switch or U-turn, nor whether a roadblock leaves too little room for one, and it shares the errors of the pose.
    """

    def __init__(self, town: Town, exits: JunctionExits) -> None:
        self._town, self._exits = town, exits

    def mask(self, observation: ObservationMapping) -> NDArray[np.bool_]:
        """Returns which actions would be carried out now (18,)."""
        town, held = self._town, int(observation["motion"]) == Motion.STOPPED
        lane, station = town.lanes[int(observation["lane"])], float(observation["station"][0])
        speed, cruise = float(observation["speed"][0]), float(observation["cruise_speed"][0])
        manoeuvre = int(observation["manoeuvre"])
        mask = np.zeros(len(ACTIONS), dtype=np.bool_)
        mask[NavigationAction.NOTHING] = mask[NavigationAction.LIGHTS] = True
        mask[NavigationAction.STOP], mask[NavigationAction.START] = not held, held
        mask[NavigationAction.FASTER], mask[NavigationAction.SLOWER] = cruise < MAX_CRUISE, cruise > MIN_CRUISE
        committed = self._is_committed(observation, speed)
        if not lane.in_junction and manoeuvre not in _OFF_LINE:
            for action, side in _SIDES.items():
                mask[action] = can_switch_lane(town, lane.id, station, side, MIN_SWITCH + LEAD)
            start = u_turn_start(station, speed, U_TURN_SPEED**2)
            on_lane = start <= lane.length + END_TOLERANCE
            mask[NavigationAction.U_TURN] = on_lane and can_turn_round(town, lane.id, start)
        if not lane.in_junction and not committed:
            mask[NavigationAction.LANE_FOLLOW] = held or manoeuvre > 0
        for action in UNDER_WAY:
            mask[action] |= prepares(action, observation, self._exits)
        choice = None if committed else self._exits.choice_ahead(observation)
        if choice is not None:
            mask[FIRST_TURN:] = [way is not None for way in self._exits.by_sector(choice)]
        return mask

    def _is_committed(self, observation: ObservationMapping, speed: float) -> bool:
        """Returns whether the car can no longer stop before the junction at which it is about to turn."""
        first = observation["exits"][0]
        if int(observation["manoeuvre"]) != PhysicalAction.J_TURN or not first[ExitColumn.PRESENT]:
            return False
        if self._town.lanes[int(observation["lane"])].in_junction:
            return False
        left = float(first[ExitColumn.DISTANCE]) - HALF_LENGTH
        return is_past_stopping(speed, left)
