"""What the driver can do: one number a decision, and which numbers would not be refused."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Any, Final

from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.policies.navigation.junction_exits import SECTORS, JunctionExits
from dorothie_gym.spaces import Motion, Physical

LEFT, RIGHT = 90, -90
"""Angles of a lane switch [degrees]."""


class NavigationAction(enum.IntEnum):
    """An action of `Navigation-v0`; the last eight take the way on at the next junction that lies in a sector."""

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
        """The sector of a turn, see `ways.SECTORS`; None for other actions."""
        return int(self) - FIRST_TURN if int(self) >= FIRST_TURN else None

    @classmethod
    def turn(cls, sector: int) -> NavigationAction:
        """The action that turns into a sector."""
        return cls(FIRST_TURN + sector)


FIRST_TURN = 10
ACTIONS = tuple(NavigationAction)
assert len(ACTIONS) == FIRST_TURN + len(SECTORS)

PLAIN: Final[Mapping[int, Physical]] = {
    NavigationAction.LANE_FOLLOW: Physical(action=PhysicalAction.LANE_FOLLOW),
    NavigationAction.SWITCH_LEFT: Physical(action=PhysicalAction.LANE_SWITCH, angle=LEFT),
    NavigationAction.SWITCH_RIGHT: Physical(action=PhysicalAction.LANE_SWITCH, angle=RIGHT),
    NavigationAction.U_TURN: Physical(action=PhysicalAction.U_TURN),
    NavigationAction.STOP: Physical(action=PhysicalAction.STOP),
    NavigationAction.START: Physical(action=PhysicalAction.START),
    NavigationAction.FASTER: Physical(action=PhysicalAction.SPEED_CHANGE, up=True),
    NavigationAction.SLOWER: Physical(action=PhysicalAction.SPEED_CHANGE, up=False),
}
"""What the car is told to do by the actions that mean the same everywhere."""


UNDER_WAY = {
    NavigationAction.SWITCH_LEFT: (PhysicalAction.LANE_SWITCH, LEFT),
    NavigationAction.SWITCH_RIGHT: (PhysicalAction.LANE_SWITCH, RIGHT),
    NavigationAction.U_TURN: (PhysicalAction.U_TURN, 0),
}
"""Manoeuvres, and what `LocalPlanner.manoeuvre` is while they are prepared or driven."""


def physical_of(action: NavigationAction, seen: Mapping[str, Any], ways: JunctionExits) -> Physical | None:
    """What the Co-Wizard does for an action; None for nothing.

    What is being prepared just goes on when it is asked for again: drivers may ask for what they want as long as they
    want it. A turn into a sector without a way on is a turn with the sector's angle: the car refuses it, or takes the
    way that fits best.

    Args:
        action: what was chosen.
        seen: what the Co-Wizard observes.
        ways: ways on at the town's junctions.
    """
    if action is NavigationAction.NOTHING or prepares(action, seen, ways):
        return None
    if action is NavigationAction.LIGHTS:
        return Physical(action=PhysicalAction.LIGHT_CHANGE, up=not seen["lights"])
    sector = action.sector
    if sector is None:
        return PLAIN[action]
    angle = _angle_of(sector, seen, ways)
    return Physical(action=PhysicalAction.J_TURN, angle=SECTORS[sector] if angle is None else angle)


def prepares(action: NavigationAction, seen: Mapping[str, Any], ways: JunctionExits) -> bool:
    """Whether an action is what the car is about to do anyway."""
    if int(seen["motion"]) == Motion.STOPPED:
        return False
    manoeuvre = UNDER_WAY.get(action)
    if action.sector is not None:
        angle = _angle_of(action.sector, seen, ways)
        manoeuvre = None if angle is None else (PhysicalAction.J_TURN, angle)
    return manoeuvre == (int(seen["manoeuvre"]), int(seen["manoeuvre_angle"][0]))


def _angle_of(sector: int, seen: Mapping[str, Any], ways: JunctionExits) -> int | None:
    """Angle of the turn into a sector at the next choice of ways [degrees]; None where no way leads there."""
    choice = ways.choice_ahead(seen)
    way = ways.after(choice)[sector] if choice is not None else None
    return None if way is None else way.angle
