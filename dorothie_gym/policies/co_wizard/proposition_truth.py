"""Beliefs of the Co-Wizard about propositions, from its own observations, and the reasons for its actions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.maps.town import Town
from dorothie_gym.maps.traffic_lights import LightColour
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor
from dorothie_gym.policies.co_wizard.state import CoWizardState, Wish
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.route_progress import light_ahead
from dorothie_gym.policies.travel_time import travel_time
from dorothie_gym.policies.view_range import FAR_SIGHT, camera_fault, sight
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support import portable_math as pm

NAMED_ACTIONS: Final = {
    PhysicalAction.J_TURN: ActionValue.J_TURN,
    PhysicalAction.U_TURN: ActionValue.U_TURN,
    PhysicalAction.LANE_SWITCH: ActionValue.LANE_SWITCH,
}
"""Manoeuvres that the Co-Wizard names, and the slot value of each."""

OBEYED_WITHIN: Final = 15.0
"""Longest time from an instruction to its effect [s]."""

DETOUR_TIME: Final = 30.0
"""Time for which an obstacle explains a U-turn [s]."""

Belief = Callable[[CoWizardState, CoWizardView, Proposition], bool | None]
"""Returns whether a proposition without negation is true; None if the Co-Wizard does not know."""


def believes(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether the Co-Wizard believes a proposition; None if it does not know."""
    belief = _BELIEFS.get(said.predicate)
    held = None if belief is None else belief(state, view, said)
    return held if held is None else held is not said.negated


def seconds_to_goal(state: CoWizardState, view: CoWizardView) -> int | None:
    """Returns the expected time until the car stops at the goal [s]; None if its place is unknown or the car halts."""
    progress = state.route.progress
    if progress is None or not state.beliefs.exact or state.intentions.halted:
        return None
    seconds = travel_time(state.town, progress, view.station, view.time, view.speed)
    return round(seconds) if math.isfinite(seconds) else None


def is_localised(view: CoWizardView, most: float) -> bool:
    """Returns whether the variance of the position is at most `most` [m^2]."""
    return view.variance <= most


def sees_far(view: CoWizardView) -> bool:
    """Returns whether neither weather, darkness nor the camera limits the view much."""
    return sight(view.raw) >= FAR_SIGHT


def is_red_ahead(town: Town, view: CoWizardView) -> bool:
    """Returns whether the next traffic light on the route is near and not green."""
    return light_ahead(town, view.lane, view.station, view.time) not in (None, LightColour.GREEN)


def present_action(view: CoWizardView) -> ActionValue:
    """Returns the current action of the car."""
    if view.standing:
        return ActionValue.STOP
    return NAMED_ACTIONS.get(view.manoeuvre or PhysicalAction.LANE_FOLLOW, ActionValue.LANE_FOLLOW)


def sees(view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether an object or place is in sight; None if the proposition names neither."""
    kind, place = said.get("object"), said.get("place")
    if isinstance(kind, ObjectClass):
        return any(thing.kind is kind for thing in view.objects) or view.hazard is kind
    if isinstance(place, LandmarkName):
        x, y = view.position
        return any(mark.name is place and pm.hypot(mark.x - x, mark.y - y) < 45.0 for mark in view.landmarks)
    return None


def is_located(view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether a place is on a street, by the map; None if the map does not show it."""
    marks = [mark for mark in view.landmarks if mark.name is said.get("place")]
    return any(mark.street is said.get("street") for mark in marks) if marks else None


# --- beliefs by predicate ---------------------------------------------------------------------------------------------


def _is_on_street(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    here = street_of(view.raw, state.town, view.lane)
    if here is StreetName.UNKNOWN or not is_localised(view, state.config.lost_variance):
        return None
    return here is said.get("street")


def _is_close(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    progress = state.route.progress
    if progress is None or not state.beliefs.exact or not _about_goal(state, said):
        return None
    return progress.left(view.station) < state.config.close_distance


def _knows(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    place = said.get("place") or state.beliefs.goal
    if place is None or (place is state.beliefs.goal and not (state.beliefs.exact or state.beliefs.described)):
        return False
    return any(mark.name is place and mark.place not in state.beliefs.ruled_out for mark in view.landmarks)


def _has_route(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    return state.route.progress is not None and bool(state.route.progress.legs) and _about_goal(state, said)


def _is_right_way(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    progress = state.route.progress
    if progress is None or not state.beliefs.exact:
        return None
    return not progress.astray


def _is_red(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    return is_red_ahead(state.town, view)


def _is_safe(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    return view.hazard is ObjectClass.UNLABELED and sees_far(view) and is_localised(view, state.config.lost_variance)


def _does(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    action = said.get("action")
    return present_action(view) is action if isinstance(action, ActionValue) else None


def _is_arrived(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    return state.intentions.arrived and view.standing and _about_goal(state, said)


def _has_failed(state: CoWizardState, view: CoWizardView, said: Proposition) -> bool | None:
    found = {camera_fault(view.raw), None if is_localised(view, state.config.gps_variance) else Sensor.GPS} - {None}
    asked = said.get("sensor")
    return bool(found) if asked is None else asked in found


def _about_goal(state: CoWizardState, said: Proposition) -> bool:
    return said.get("place") in (None, state.beliefs.goal)


_BELIEFS: Final[dict[Predicate, Belief]] = {
    Predicate.SEES: lambda state, view, said: sees(view, said),
    Predicate.ON_STREET: _is_on_street,
    Predicate.LOCATED: lambda state, view, said: is_located(view, said),
    Predicate.CLOSE: _is_close,
    Predicate.KNOWS: _knows,
    Predicate.HAS_ROUTE: _has_route,
    Predicate.RIGHT_WAY: _is_right_way,
    Predicate.RED: _is_red,
    Predicate.SAFE: _is_safe,
    Predicate.DOES: _does,
    Predicate.ARRIVED: _is_arrived,
    Predicate.STANDS: lambda state, view, said: view.standing,
    Predicate.LOCALISED: lambda state, view, said: is_localised(view, state.config.lost_variance),
    Predicate.VISIBILITY: lambda state, view, said: sees_far(view),
    Predicate.FAILED: _has_failed,
    Predicate.LIGHTS_ON: lambda state, view, said: view.lights,
    Predicate.GOAL: lambda state, view, said: state.beliefs.goal is not None and _about_goal(state, said),
    Predicate.HINDERS: lambda state, view, said: view.motion is Motion.HAZARD and view.hazard is said.get("object"),
}


# --- reasons ----------------------------------------------------------------------------------------------------------


def reason_to_stand(state: CoWizardState, view: CoWizardView) -> Proposition | None:
    """Returns why the car stands now, from the Co-Wizard's own actions; None if it does not know."""
    intentions, commands, goal = state.intentions, state.commands, state.beliefs.goal
    resting = view.time < commands.rest_until
    hazard = view.hazard if view.motion is Motion.HAZARD else commands.rest_for if resting else ObjectClass.UNLABELED
    if intentions.arrived and intentions.sent_on and not state.beliefs.exact:
        return Proposition.of(Predicate.TOLD, action=ActionValue.LANE_FOLLOW)
    if intentions.arrived and goal is not None:
        return Proposition.of(Predicate.ARRIVED, place=goal)
    if state.dialogue.detour_asked_at is not None:
        return Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC)
    if hazard is ObjectClass.TRAFFIC_LIGHT:
        return Proposition.of(Predicate.RED, object=hazard) if is_red_ahead(state.town, view) else None
    if hazard is not ObjectClass.UNLABELED:
        return Proposition.of(Predicate.HINDERS, object=hazard)
    since = view.time if commands.standing_since is None else commands.standing_since
    if intentions.halted and since - state.dialogue.stop_instructed_at < OBEYED_WITHIN:
        return state.dialogue.stop_reason
    if goal is None and intentions.directive is None:
        return Proposition.of(Predicate.GOAL, negated=True)
    guided = goal is not None and not state.beliefs.exact and state.route.progress is None
    if view.motion is Motion.WAITING or intentions.pausing or (guided and intentions.directive is None):
        return Proposition.of(Predicate.HAS_ROUTE, negated=True)
    return None


def reason_to_turn_round(state: CoWizardState, view: CoWizardView) -> Proposition | None:
    """Returns why the car turns round now; None if the Co-Wizard does not know."""
    goal = state.beliefs.goal
    told = view.time - state.dialogue.u_turn_instructed_at < state.config.wish_time + OBEYED_WITHIN
    if state.intentions.wish is Wish.U_TURN or told:
        return Proposition.of(Predicate.TOLD, action=ActionValue.U_TURN)
    if view.time - state.dialogue.blocked_at < DETOUR_TIME:
        return Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC)
    if goal is not None and state.beliefs.exact:
        return Proposition.of(Predicate.BEHIND, place=goal)
    return None
