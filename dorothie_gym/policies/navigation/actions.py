"""Discrete driving actions, and their meaning as physical actions of the Co-Wizard."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Final

from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.policies.navigation.junction_exits import SECTORS, JunctionExits
from dorothie_gym.spaces import Motion, ObservationMapping, Physical

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
