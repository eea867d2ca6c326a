"""Discrete driving actions, their meaning as physical actions of the Co-Wizard, and an estimate of their mask."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import LinkType
from dorothie_gym.ontology.actions import SPEED_STEP, PhysicalAction
from dorothie_gym.policies.feasibility import can_switch_lane, can_turn_round, u_turn_start
from dorothie_gym.policies.navigation.observation_fields import SECTORS
from dorothie_gym.session.spaces.actions import Physical
from dorothie_gym.sim.ego.limits import (
    HALF_LENGTH,
    LEAD,
    MAX_CRUISE,
    MIN_CRUISE,
    MIN_SWITCH,
    U_TURN_SPEED,
    is_past_stopping,
)
from dorothie_gym.sim.ego.manoeuvres import find_feasible
from dorothie_gym.sim.state.codes import J_TURN, LANE_FOLLOW, LANE_SWITCH, START, STOP, U_TURN, Feasible, Motion
from dorothie_gym.support.compilation import compiled, direct
from dorothie_gym.support.compilation.records import plain

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.navigation.driver_view import DriverArrays
    from dorothie_gym.policies.navigation.junction_exits import ExitArrays
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.world_arrays import WorldArrays

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
    """Switches the headlights."""
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

_SPEED_CHANGE, _LIGHT_CHANGE = int(PhysicalAction.SPEED_CHANGE), int(PhysicalAction.LIGHT_CHANGE)
_NOTHING, _FOLLOW, _SWITCH_LEFT, _SWITCH_RIGHT, _ROUND, _STOP, _START, _FASTER, _SLOWER, _LIGHTS = (
    int(action) for action in NavigationAction if action < FIRST_TURN
)
_STOPPED = int(Motion.STOPPED)

UNDER_WAY = (_SWITCH_LEFT, _SWITCH_RIGHT, _ROUND)
"""Actions, turns apart, that start a manoeuvre."""


def physical_of(action: NavigationAction, driver: DriverArrays) -> Physical | None:
    """Maps an action to a physical action; None for no action.

    A manoeuvre that is being prepared continues when it is chosen again, so a driver may repeat an action until it
    takes effect. A turn into a sector without an exit becomes a turn by the sector's angle: the car refuses it, or
    takes the exit that fits best.

    Args:
        action: action chosen.
        driver: arrays of the driver, with its view.
    """
    order, angle = _order_of(driver, int(action))
    if order == 0:
        return None
    up = action is not NavigationAction.SLOWER
    if order == _LIGHT_CHANGE:
        up = not plain(driver.inputs)[0]["lights"]
    return Physical(action=PhysicalAction(order), angle=angle, up=up)


@compiled
def order_of(driver: DriverArrays, action: int) -> tuple[int, int]:
    """Returns the `PhysicalAction` of a `NavigationAction`, 0 if it has none, and its angle [degrees]."""
    order, angle = LANE_FOLLOW, 0
    if action == _NOTHING or prepares(driver, action):
        order = 0
    elif action >= FIRST_TURN:
        order, angle = J_TURN, turn_angle(driver, action - FIRST_TURN)
    elif action == _SWITCH_LEFT or action == _SWITCH_RIGHT:
        order, angle = LANE_SWITCH, LEFT if action == _SWITCH_LEFT else RIGHT
    elif action == _ROUND:
        order = U_TURN
    elif action == _STOP:
        order = STOP
    elif action == _START:
        order = START
    elif action == _LIGHTS:
        order = _LIGHT_CHANGE
    elif action == _FASTER or action == _SLOWER:
        order = _SPEED_CHANGE
    return order, angle


_order_of = direct(order_of)


@compiled
def prepares(driver: DriverArrays, action: int) -> bool:
    """Returns whether the car prepares or carries out a `NavigationAction` already."""
    view = driver.inputs[0]
    if view.motion == _STOPPED:
        return False
    if action >= FIRST_TURN:
        sector = action - FIRST_TURN
        own = view.exit_lane[sector] >= 0 and view.exit_angle[sector] == view.angle
        return bool(own and view.manoeuvre == J_TURN)
    if action == _SWITCH_LEFT or action == _SWITCH_RIGHT:
        return bool(view.manoeuvre == LANE_SWITCH and view.angle == (LEFT if action == _SWITCH_LEFT else RIGHT))
    return bool(action == _ROUND and view.manoeuvre == U_TURN)


@compiled
def turn_angle(driver: DriverArrays, sector: int) -> int:
    """Returns the angle of the exit in a sector of the next junction, or that of the sector [degrees]."""
    view = driver.inputs[0]
    return int(view.exit_angle[sector]) if view.exit_lane[sector] >= 0 else SECTORS[sector]


@compiled
def write_mask(town: TownArrays, exits: ExitArrays, world: WorldArrays, driver: DriverArrays) -> None:
    """Writes which actions the ego would carry out, by its planned path; the view of the driver is up to date."""
    plan, mask = world.plan[0], driver.mask
    feasible = find_feasible(town, world, world.vehicles[0].speed)
    mask[:] = 0
    mask[_NOTHING], mask[_LIGHTS] = 1, 1
    mask[_STOP], mask[_START] = not plan.held, plan.held
    mask[_FASTER] = plan.cruise + SPEED_STEP <= MAX_CRUISE
    mask[_SLOWER] = plan.cruise - SPEED_STEP >= MIN_CRUISE
    for flag, action in _FEASIBLE:
        mask[action] = feasible & flag > 0
    for action in UNDER_WAY:
        if prepares(driver, action):
            mask[action] = 1
    if feasible & _MAY_TURN > 0 and plan.choice >= 0:
        for sector in range(len(SECTORS)):
            mask[FIRST_TURN + sector] = exits.lane[plan.choice, sector] >= 0


_MAY_TURN = int(Feasible.J_TURN)
_FEASIBLE = (
    (int(Feasible.LANE_FOLLOW), _FOLLOW),
    (int(Feasible.SWITCH_LEFT), _SWITCH_LEFT),
    (int(Feasible.SWITCH_RIGHT), _SWITCH_RIGHT),
    (int(Feasible.U_TURN), _ROUND),
)


# --- estimated mask ---------------------------------------------------------------------------------------------------

END_TOLERANCE = 0.5
"""Distance past the end of its lane at which a U-turn may still begin [m]."""

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

    def __init__(self, town: Town) -> None:
        self._town = town

    def mask(self, driver: DriverArrays) -> NDArray[np.bool_]:
        """Returns which actions are feasible now (18,), judged from a driver's view."""
        town, view = self._town, plain(driver.inputs)[0]
        held, manoeuvre = view["motion"] == Motion.STOPPED, int(view["manoeuvre"])
        lane, station = town.lanes[int(view["lane"])], float(view["station"])
        speed, cruise = float(view["speed"]), float(view["cruise"])
        mask = np.zeros(len(ACTIONS), dtype=np.bool_)
        mask[NavigationAction.NOTHING] = mask[NavigationAction.LIGHTS] = True
        mask[NavigationAction.STOP], mask[NavigationAction.START] = not held, held
        mask[NavigationAction.FASTER], mask[NavigationAction.SLOWER] = cruise < MAX_CRUISE, cruise > MIN_CRUISE
        # whether the car can no longer stop before the junction at which it is about to turn
        turning = manoeuvre == PhysicalAction.J_TURN and view["junction_ahead"] and not lane.in_junction
        committed = turning and is_past_stopping(speed, float(view["junction_distance"]) - HALF_LENGTH)
        if not lane.in_junction and manoeuvre not in _OFF_LINE:
            for action, side in _SIDES.items():
                mask[action] = can_switch_lane(town, lane.id, station, side, MIN_SWITCH + LEAD)
            start = u_turn_start(station, speed, U_TURN_SPEED * U_TURN_SPEED)
            on_lane = start <= lane.length + END_TOLERANCE
            mask[NavigationAction.U_TURN] = on_lane and can_turn_round(town, lane.id, start)
        if not lane.in_junction and not committed:
            mask[NavigationAction.LANE_FOLLOW] = held or manoeuvre > 0
        for number in UNDER_WAY:
            mask[number] |= prepares(driver, number)
        if not committed:
            mask[FIRST_TURN:] = view["exit_lane"] >= 0
        return mask
