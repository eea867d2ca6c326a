"""Obstacles across the road: detection, announcement and detour."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.slots import ActionValue, LandmarkName, ObjectClass
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.destinations import plan_route
from dorothie_gym.policies.observation_parser import SeenObject, place_on_lanes
from dorothie_gym.policies.route_progress import first_new_street, lanes_ahead
from dorothie_gym.policies.speech import intend
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView

_JUST_TOLD = 8.0
"""Time for which an obstacle that the participant has reported needs no report of the car [s]."""


def watch_road(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> None:
    """Checks the path for obstacles, announces a new one, and asks about a detour or takes it."""
    asked_at = state.dialogue.detour_asked_at
    waited = 0.0 if asked_at is None or view.other_speaking else view.time - max(asked_at, state.speech.last_end)
    if asked_at is not None and waited > state.config.detour_answer_time:
        take_detour(state, view, rng, agreed=False)
    thing = _obstacle_on_path(state, view)
    if thing is None or view.manoeuvring or _is_behind_goal(state, view, thing):
        return
    lanes = lanes_ahead(state.town, view.lane, view.station, state.config.roadblock_sight)
    if state.route.progress is not None:
        lanes = (*lanes, *(leg.lane for leg in state.route.progress.legs[:5] if leg.lane not in lanes))
    place = place_on_lanes(state.town, lanes, thing.x, thing.y, width=2.2)
    if place is None or state.route.knows_roadblock(place):
        return
    state.route = state.route.with_roadblock(state.town, place)
    state.dialogue = state.dialogue.after_finding_obstacle(view.time)
    obstacle = Proposition.of(Predicate.BLOCKED, object=ObjectClass.STATIC, prop=thing.prop)
    told = ObjectClass.STATIC in state.speech.heard and view.time - state.dialogue.heard_at < _JUST_TOLD
    blocked = () if told else (intend(CommunicativeFunction.INFORM, obstacle, urgent=True),)
    state.speech = state.speech.cleared().plan(*blocked)
    if state.route.progress is not None:
        state.dialogue = state.dialogue.with_detour_question(view.time)
        detour = _proposed_detour(state, view, rng)
        state.say(intend(CommunicativeFunction.OFFER, detour, wording=Wording(topic="detour"), joined=not told))
    else:
        state.dialogue = state.dialogue.after_asking(view.time)
        lacks_goal = state.beliefs.goal is None or state.intentions.arrived
        way, where = act_builders.action(ActionValue.QUERIED), act_builders.destination(LandmarkName.QUERIED)
        state.say(intend(CommunicativeFunction.SET_QUESTION, where if lacks_goal else way, joined=not told))
    state.intentions = state.intentions.blocked()


def _proposed_detour(state: CoWizardState, view: CoWizardView, rng: np.random.Generator) -> Proposition:
    """Returns a proposed detour: over a street, by a U-turn, or unspecified."""
    route = state.route.to_goal.replanned(state.town, view.here, state.route.blocked)
    street = first_new_street(view.raw, state.town, view.lane, route)
    if street is not None and rng.random() < state.config.detour_by_street:
        return act_builders.action(None, street=street)
    turns_round = route.turns_round_first(state.town, view.station) and rng.random() < 0.5
    return act_builders.action(ActionValue.U_TURN if turns_round else None)


def _obstacle_on_path(state: CoWizardState, view: CoWizardView) -> SeenObject | None:
    """Returns the nearest obstacle on the planned waypoints."""
    for thing in view.objects:
        if thing.kind is not ObjectClass.STATIC or thing.distance > state.config.roadblock_sight:
            continue
        if _distance_to_path(view.waypoints, thing) < state.config.path_width:
            return thing
        if view.motion is Motion.HAZARD and view.hazard is ObjectClass.STATIC:
            return thing
    return None


def _is_behind_goal(state: CoWizardState, view: CoWizardView, thing: SeenObject) -> bool:
    """Returns whether an obstacle lies beyond the place where the car will stop."""
    progress = state.route.progress
    return progress is not None and state.beliefs.exact and thing.distance > progress.left(view.station)


def _distance_to_path(waypoints: np.ndarray, thing: SeenObject) -> float:
    """Returns the distance of an obstacle from the line through the waypoints [m]."""
    if len(waypoints) < 2:
        return math.inf
    begin, step = waypoints[:-1], np.diff(waypoints, axis=0)  # (n - 1, 2)
    offset = np.array([thing.x, thing.y]) - begin
    share = np.einsum("ij,ij->i", offset, step) / np.maximum(np.einsum("ij,ij->i", step, step), 1e-9)
    return float(pn.hypot(*(offset - np.clip(share, 0.0, 1.0)[:, None] * step).T).min())


def take_detour(state: CoWizardState, view: CoWizardView, rng: np.random.Generator, *, agreed: bool = True) -> None:
    """Plans another route, and says so.

    Args:
        state: working copy of the state.
        view: observation.
        rng: random generator of the decision.
        agreed: whether the participant has requested it or agreed to it.
    """
    state.dialogue = state.dialogue.with_detour_question(None)
    state.intentions = state.intentions.resumed()
    plan_route(state, view)
    progress = state.route.progress
    if progress is None or progress.route is None:
        return
    street = first_new_street(view.raw, state.town, view.lane, progress)
    if street is not None:
        over = act_builders.action(None, street=street)
        function = CommunicativeFunction.ACCEPT if agreed else CommunicativeFunction.INFORM
        state.say(intend(function, over, wording=Wording(topic="detour")))
    if progress.turns_round_first(state.town, view.station) and rng.random() < 0.6:
        turn = act_builders.action(ActionValue.U_TURN)
        state.say(intend(CommunicativeFunction.INFORM, turn, joined=street is not None))
