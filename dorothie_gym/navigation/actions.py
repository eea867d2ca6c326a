"""What the driver can do: one number a decision, and which numbers would not be refused."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.envs.prospect import Prospect
from dorothie_gym.navigation.ways import SECTORS, Ways
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.spaces import Motion, Physical
from dorothie_gym.world.car.driver import MAX_CRUISE, MIN_CRUISE
from dorothie_gym.world.town import LinkType
from dorothie_gym.world.world import World

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


_UNDER_WAY = {
    NavigationAction.SWITCH_LEFT: (PhysicalAction.LANE_SWITCH, LEFT),
    NavigationAction.SWITCH_RIGHT: (PhysicalAction.LANE_SWITCH, RIGHT),
    NavigationAction.U_TURN: (PhysicalAction.U_TURN, 0),
}
"""Manoeuvres, and what `LocalPlanner.manoeuvre` is while they are prepared or driven."""


def physical_of(action: NavigationAction, seen: Mapping[str, Any], ways: Ways) -> Physical | None:
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


def prepares(action: NavigationAction, seen: Mapping[str, Any], ways: Ways) -> bool:
    """Whether an action is what the car is about to do anyway."""
    if int(seen["motion"]) == Motion.STOPPED:
        return False
    manoeuvre = _UNDER_WAY.get(action)
    if action.sector is not None:
        angle = _angle_of(action.sector, seen, ways)
        manoeuvre = None if angle is None else (PhysicalAction.J_TURN, angle)
    return manoeuvre == (int(seen["manoeuvre"]), int(seen["manoeuvre_angle"][0]))


def _angle_of(sector: int, seen: Mapping[str, Any], ways: Ways) -> int | None:
    """Angle of the turn into a sector at the next choice of ways [degrees]; None where no way leads there."""
    choice = ways.choice_ahead(seen)
    way = ways.after(choice)[sector] if choice is not None else None
    return None if way is None else way.angle


class Controls:
    """Tells which actions would be carried out, for the car of a session.

    Attributes:
        ways: ways on at the town's junctions.
    """

    def __init__(self, world: World, ways: Ways) -> None:
        self._world, self.ways = world, ways
        self._prospect = Prospect(world)

    @property
    def choice(self) -> tuple[int, float] | None:
        """The lane at whose end the car has to choose a way, and how far it is [m]; None if the path comes to none."""
        options = self._prospect.options()
        return (options.lane, options.distance) if options.exits else None

    def mask(self, seen: Mapping[str, Any]) -> NDArray[np.int8]:
        """Which actions the car follows now (18,): 1 for those; `seen` is what the Co-Wizard observes."""
        world, planner = self._world, self._world.planner
        speed, cruise = float(world.car.speed), world.driver.cruise
        mask = np.zeros(len(ACTIONS), dtype=np.int8)
        mask[NavigationAction.NOTHING] = mask[NavigationAction.LIGHTS] = 1
        mask[NavigationAction.STOP], mask[NavigationAction.START] = not planner.held, planner.held
        mask[NavigationAction.FASTER], mask[NavigationAction.SLOWER] = cruise < MAX_CRUISE, cruise > MIN_CRUISE
        committed = planner.is_committed(speed)
        if not (planner.in_manoeuvre or world.town.lanes[planner.lane].in_junction):
            mask[NavigationAction.SWITCH_LEFT] = planner.may_switch(LinkType.LANE_CHANGE_LEFT, speed)
            mask[NavigationAction.SWITCH_RIGHT] = planner.may_switch(LinkType.LANE_CHANGE_RIGHT, speed)
            mask[NavigationAction.U_TURN] = planner.may_turn_round(speed)
            leaves = planner.held or planner.manoeuvre[0] is not None
            mask[NavigationAction.LANE_FOLLOW] = leaves and not committed
        for action in _UNDER_WAY:
            mask[action] |= prepares(action, seen, self.ways)
        choice = None if committed else self.choice
        if choice is not None:
            mask[FIRST_TURN:] = [way is not None for way in self.ways.after(choice[0])]
        return mask
