"""Truth of propositions by the knowledge and observations of a Co-Wizard, and the reasons for its actions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.maps.town import LightColour, Town
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass, StreetName
from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.knowledge import CoWizardKnowledge
from dorothie_gym.policies.observation_parser import is_dark, is_foggy, is_rainy, street_of
from dorothie_gym.policies.route_progress import light_ahead
from dorothie_gym.policies.travel_time import travel_time
from dorothie_gym.policies.view_range import FAR_SIGHT, camera_fault, sight
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.session.spaces.observations import ObservationMapping

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

SPEED_TOLERANCE: Final = 5.0
"""Difference up to which two speeds are called the same [km/h]."""

JUNCTION_NEAR: Final = 45.0
"""Distance to a junction from which on the car slows down for it [m]."""

ENDS_WITHIN: Final = 100.0
"""Distance to the end of a lane within which it explains that the car drives slowly or waits [m]."""

LANE_ENDS: Final = Proposition.of(Predicate.POSSIBLE, action=ActionValue.LANE_FOLLOW, negated=True)
"""The lane of the car ends, so that it cannot follow the lane."""

_BESIDE: Final = (ObjectClass.UNLABELED, ObjectClass.VEHICLES)  # hazards before which a car waits that changes lanes

CROWD: Final = 3
"""Minimum number of people or vehicles in a crowd."""

Judgement = Callable[[CoWizardKnowledge, CoWizardView, Proposition], bool | None]
"""Returns whether a proposition without negation is true; None if that is not known."""


def believes(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether the Co-Wizard believes a proposition; None if it does not know."""
    judge = _JUDGEMENTS.get(said.predicate)
    held = None if judge is None else judge(known, view, said)
    return held if held is None else held is not said.negated


def distance_to_goal(known: CoWizardKnowledge, view: CoWizardView) -> float | None:
    """Returns the route length to a goal on the map [m]; None without a goal or route."""
    return None if known.progress is None or not known.goal_is_on_map else known.progress.left(view.station)


def seconds_to_goal(known: CoWizardKnowledge, view: CoWizardView) -> int | None:
    """Returns the expected time until the car stops at the goal [s]; None if its place is unknown or the car halts."""
    if known.progress is None or not known.goal_is_on_map or known.halted:
        return None
    seconds = travel_time(known.town, known.progress, view.station, view.time, view.speed, known.cruise)
    return round(seconds) if math.isfinite(seconds) else None


def speed_limit(town: Town, lane: int) -> int:
    """Returns the speed limit of a lane [km/h]."""
    return round(3.6 * town.lanes[lane].speed_limit)


def lane_ends(town: Town, view: CoWizardView) -> bool:
    """Returns whether the lane of the car ends ahead, within sight of its end: it has to leave it, or to turn round."""
    lane = town.lanes[view.lane]
    return not town.successors(lane.id) and lane.length - view.station < ENDS_WITHIN


def street_here(town: Town, view: CoWizardView) -> StreetName:
    """Returns the street that the car is on; in a junction, the one that it comes from or is turning onto, if known."""
    lanes = (view.lane, *town.predecessors(view.lane), *(link.target for link in town.successors(view.lane)))
    streets = (street_of(view.raw, town, lane) for lane in lanes)
    return next((street for street in streets if street is not StreetName.UNKNOWN), StreetName.UNKNOWN)


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


# --- judgements by predicate ------------------------------------------------------------------------------------------


def _about_goal(known: CoWizardKnowledge, said: Proposition) -> bool:
    return said.get("place") in (None, known.goal)


def _is_on_street(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    here = street_here(known.town, view)
    if here is StreetName.UNKNOWN or not is_localised(view, known.config.lost_variance):
        return None
    return here is said.get("street")


def _is_close(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    left = distance_to_goal(known, view)
    return None if left is None or not _about_goal(known, said) else left < known.config.close_distance


def _knows(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    place = said.get("place") or known.goal
    if place is None or (place is known.goal and not known.goal_is_findable):
        return False
    return any(mark.name is place and mark.place not in known.ruled_out for mark in view.landmarks)


def _has_route(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    return known.progress is not None and bool(known.progress.legs) and _about_goal(known, said)


def _is_right_way(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    return None if known.progress is None or not known.goal_is_on_map else not known.progress.astray


def _does(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    action = said.get("action")
    return present_action(view) is action if isinstance(action, ActionValue) else None


def _has_failed(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    found = {camera_fault(view.raw), None if is_localised(view, known.config.gps_variance) else Sensor.GPS} - {None}
    asked = said.get("sensor")
    return bool(found) if asked is None else asked in found


def _is_blocked(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether the car has met an obstacle lately, or sees one."""
    met = view.time - known.blocked_at < DETOUR_TIME
    return met or view.hazard is ObjectClass.STATIC or any(thing.kind is ObjectClass.STATIC for thing in view.objects)


def _drives_at(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    speed = said.get("speed")
    if said.get("limit") is True:
        return speed == speed_limit(known.town, view.lane)
    return abs(3.6 * view.speed - speed) <= SPEED_TOLERANCE if isinstance(speed, int) else None


def _weather_is(known: CoWizardKnowledge, view: CoWizardView, said: Proposition) -> bool | None:
    """Returns whether a parameter of the present weather is high; None for the weather to come."""
    parameter = said.get("parameter")
    judge = None if said.get("later") is True else _HIGH.get(parameter)
    return None if judge is None else judge(view.raw) is not (said.get("high") is False)


_HIGH: Final[dict[object, Callable[[ObservationMapping], bool]]] = {
    WeatherParameter.FOG_DENSITY: is_foggy,
    WeatherParameter.PRECIPITATION: is_rainy,
    WeatherParameter.SUN_ALTITUDE_ANGLE: is_dark,
}
"""Parameters of the weather that the car observes; that of the sun counts as "high" when the sun is down."""

_JUDGEMENTS: Final[dict[Predicate, Judgement]] = {
    Predicate.DRIVES_AT: _drives_at,
    Predicate.WEATHER: _weather_is,
    Predicate.SEES: lambda known, view, said: sees(view, said),
    Predicate.ON_STREET: _is_on_street,
    Predicate.LOCATED: lambda known, view, said: is_located(view, said),
    Predicate.CLOSE: _is_close,
    Predicate.KNOWS: _knows,
    Predicate.HAS_ROUTE: _has_route,
    Predicate.RIGHT_WAY: _is_right_way,
    Predicate.RED: lambda known, view, said: is_red_ahead(known.town, view),
    Predicate.SAFE: lambda known, view, said: (
        view.hazard is ObjectClass.UNLABELED and sees_far(view) and is_localised(view, known.config.lost_variance)
    ),
    Predicate.DOES: _does,
    Predicate.ARRIVED: lambda known, view, said: known.arrived and view.standing and _about_goal(known, said),
    Predicate.STANDS: lambda known, view, said: view.standing,
    Predicate.LOCALISED: lambda known, view, said: is_localised(view, known.config.lost_variance),
    Predicate.VISIBILITY: lambda known, view, said: sees_far(view),
    Predicate.FAILED: _has_failed,
    Predicate.LIGHTS_ON: lambda known, view, said: view.lights,
    Predicate.GOAL: lambda known, view, said: known.goal is not None and _about_goal(known, said),
    Predicate.BLOCKED: _is_blocked,
    Predicate.CROWDED: lambda known, view, said: (
        sum(thing.kind is said.get("object") for thing in view.objects) >= CROWD
    ),
    Predicate.HINDERS: lambda known, view, said: view.motion is Motion.HAZARD and view.hazard is said.get("object"),
}


def reason_to_be_slow(known: CoWizardKnowledge, view: CoWizardView) -> Proposition:
    """Returns why the car drives no faster; the speed limit where nothing else is in its way."""
    limit = speed_limit(known.town, view.lane)
    if view.motion is Motion.HAZARD and view.hazard is ObjectClass.TRAFFIC_LIGHT:
        return Proposition.of(Predicate.RED, object=ObjectClass.TRAFFIC_LIGHT)
    if lane_ends(known.town, view) and (view.motion is not Motion.HAZARD or view.hazard in _BESIDE):
        return LANE_ENDS
    if view.motion is Motion.HAZARD and view.hazard is not ObjectClass.UNLABELED:
        return Proposition.of(Predicate.HINDERS, object=view.hazard)
    if not sees_far(view) and view.cruise < limit - SPEED_TOLERANCE:
        return Proposition.of(Predicate.VISIBILITY, negated=True)
    if view.choice is not None and view.choice.distance < JUNCTION_NEAR:
        return Proposition.of(Predicate.WILL, action=ActionValue.J_TURN)
    if view.cruise < min(limit, known.usual_speed) - SPEED_TOLERANCE:
        return Proposition.of(Predicate.TOLD, action=ActionValue.SPEED_CHANGE)
    if view.cruise < limit - SPEED_TOLERANCE:
        return Proposition.of(Predicate.DRIVES_AT, action=ActionValue.LANE_FOLLOW, speed=round(view.cruise))
    return Proposition.of(Predicate.DRIVES_AT, speed=limit, limit=True)


# --- reasons ----------------------------------------------------------------------------------------------------------


def reason_to_stand(known: CoWizardKnowledge, view: CoWizardView) -> Proposition | None:
    """Returns why the car stands now, from the Co-Wizard's own actions; None if it does not know."""
    goal, since = known.goal, view.time if known.standstill.since is None else known.standstill.since
    resting = view.time < known.rests_until
    hazard = view.hazard if view.motion is Motion.HAZARD else known.rests_for if resting else ObjectClass.UNLABELED
    if known.arrived and known.sent_on and not known.goal_is_on_map:
        return Proposition.of(Predicate.TOLD, action=ActionValue.LANE_FOLLOW)
    if known.arrived and goal is not None:
        return Proposition.of(Predicate.ARRIVED, place=goal)
    if known.asks_for_detour:
        return Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC)
    if hazard is ObjectClass.TRAFFIC_LIGHT:
        return Proposition.of(Predicate.RED, object=hazard) if is_red_ahead(known.town, view) else None
    if view.motion in (Motion.HAZARD, Motion.WAITING) and lane_ends(known.town, view) and hazard in _BESIDE:
        return LANE_ENDS
    if hazard is not ObjectClass.UNLABELED:
        return Proposition.of(Predicate.HINDERS, object=hazard)
    if known.halted and since - known.told_to_stop_at < OBEYED_WITHIN:
        return known.stop_reason
    if goal is None and not known.directed:
        return Proposition.of(Predicate.GOAL, negated=True)
    guided = goal is not None and not known.goal_is_on_map and known.progress is None
    if view.motion is Motion.WAITING or known.pausing or (guided and not known.directed):
        return Proposition.of(Predicate.HAS_ROUTE, negated=True)
    return None


def reason_to_turn_round(known: CoWizardKnowledge, view: CoWizardView) -> Proposition | None:
    """Returns why the car turns round now; None if the Co-Wizard does not know."""
    told = view.time - known.told_to_turn_round_at < known.config.wish_time + OBEYED_WITHIN
    if known.to_turn_round or told:
        return Proposition.of(Predicate.TOLD, action=ActionValue.U_TURN)
    if view.time - known.blocked_at < DETOUR_TIME:
        return Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC)
    if known.goal is not None and known.goal_is_on_map:
        return Proposition.of(Predicate.BEHIND, place=known.goal)
    return None
