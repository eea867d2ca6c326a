"""Feasibility of predicted navigation actions, judged from the Co-Wizard's observation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.maps.model import Exit, LinkType
from dorothie_gym.ontology.actions import LANE_SWITCH_LEFT, LANE_SWITCH_RIGHT, PhysicalAction
from dorothie_gym.policies.feasibility import can_switch_lane, can_turn_round, u_turn_start
from dorothie_gym.policies.route_legs import SAME_WAY
from dorothie_gym.policies.route_progress import Choice, direction_of, lanes_beside
from dorothie_gym.session.spaces.actions import Physical
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support.portable_math import wrap_degrees

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.policies.co_wizard.view import CoWizardView

AT_END: Final = 6.0
"""Distance to a junction below which a standing car has no room to drive up to it [m]."""


@dataclass(frozen=True, kw_only=True)
class FeasibleAction:
    """Action that the car can carry out now.

    Attributes:
        physical: the action; None if the car performs it anyway.
        direction: direction of the action, for its wording.
    """

    physical: Physical | None
    direction: Direction | None = None


def feasible_action(action: PhysicalAction, angle: float, view: CoWizardView, town: Town) -> FeasibleAction | None:
    """Returns the feasible action for a predicted navigation action, or None if there is none.

    Args:
        action: one of the six navigation actions.
        angle: its argument [degrees, positive left]; a turn takes the exit nearest to it, a lane switch its
            sign.
        view: observation of the Co-Wizard.
        town: the map.
    """
    match action:
        case PhysicalAction.STOP:
            return FeasibleAction(physical=Physical(action=action)) if view.motion is not Motion.STOPPED else None
        case PhysicalAction.START:
            starts = view.motion is Motion.STOPPED and not _at_end(view)
            return FeasibleAction(physical=Physical(action=action)) if starts else None
        case PhysicalAction.LANE_FOLLOW:
            return _follow(view)
        case PhysicalAction.J_TURN:
            return _turn(angle, view, town)
        case PhysicalAction.U_TURN:
            return _turn_round(view, town)
        case PhysicalAction.LANE_SWITCH:
            return _switch(angle >= 0.0, view, town)
    return None


def _follow(view: CoWizardView) -> FeasibleAction | None:
    """Returns lane following: nothing to do unless the car is stopped or prepares a manoeuvre."""
    if view.motion is Motion.WAITING or _at_end(view):
        return None
    idle = view.motion is not Motion.STOPPED and view.manoeuvre is None
    return FeasibleAction(physical=None if idle else Physical(action=PhysicalAction.LANE_FOLLOW))


def _at_end(view: CoWizardView) -> bool:
    """Returns whether the car stands before a junction without a planned turn and thus would have to wait."""
    near = view.choice is not None and view.choice.distance < AT_END
    return near and view.standing and view.manoeuvre is None


def _turn(angle: float, view: CoWizardView, town: Town) -> FeasibleAction | None:
    if view.choice is None or view.manoeuvring:
        return None
    way = _nearest_exit(angle, view.choice, town)
    planned = view.manoeuvre is PhysicalAction.J_TURN and abs(wrap_degrees(view.angle - way.angle)) < 1.0
    turns = planned and view.motion is not Motion.STOPPED
    physical = None if turns else Physical(action=PhysicalAction.J_TURN, angle=way.angle)
    return FeasibleAction(physical=physical, direction=direction_of(way))


def _nearest_exit(angle: float, choice: Choice, town: Town) -> Exit:
    """Returns the exit nearest in angle, from the car's lane or, if it has none there, from an adjacent lane."""

    def misfit(way: Exit) -> tuple[float, int]:
        return abs(float(wrap_degrees(way.angle - angle))), way.connector

    own = min(choice.exits, key=misfit)
    beside = [way for lane in lanes_beside(town, choice.lane) for way in town.exits(lane) if way.junction_id >= 0]
    return own if misfit(own)[0] <= SAME_WAY else min([own, *beside], key=misfit)


def _turn_round(view: CoWizardView, town: Town) -> FeasibleAction | None:
    lane = town.lanes[view.lane]
    if view.manoeuvre is PhysicalAction.U_TURN and view.motion is not Motion.STOPPED:
        return FeasibleAction(physical=None, direction=Direction.BACK)
    if lane.in_junction or view.manoeuvring or town.neighbour(view.lane, town.traffic.to_middle) is not None:
        return None
    if not can_turn_round(town, view.lane, u_turn_start(view.station, view.speed)):
        return None
    return FeasibleAction(physical=Physical(action=PhysicalAction.U_TURN), direction=Direction.BACK)


def _switch(left: bool, view: CoWizardView, town: Town) -> FeasibleAction | None:
    lane = town.lanes[view.lane]
    side = LinkType.LANE_CHANGE_LEFT if left else LinkType.LANE_CHANGE_RIGHT
    if lane.in_junction or view.manoeuvring or not can_switch_lane(town, view.lane, view.station, side):
        return None
    angle = int(LANE_SWITCH_LEFT if left else LANE_SWITCH_RIGHT)
    direction = Direction.LEFT if left else Direction.RIGHT
    return FeasibleAction(physical=Physical(action=PhysicalAction.LANE_SWITCH, angle=angle), direction=direction)
