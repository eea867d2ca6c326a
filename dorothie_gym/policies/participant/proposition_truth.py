"""Truth of propositions, judged from the knowledge and observations of a scripted or learned participant."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.participant.final_approach import about_to_arrive
from dorothie_gym.policies.participant.route_steps import route_step
from dorothie_gym.policies.route_progress import first_new_street

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

LEFT_TO_THE_CAR: Final = frozenset({ActionValue.LIGHT_CHANGE, ActionValue.SPEED_CHANGE, ActionValue.START})
"""Actions that the participant leaves to the car."""

_STILL_AWAY: Final = 4.0  # distance at which a car that claims to have arrived is told otherwise [m]

JUST_DONE: Final = 12.0
"""Time for which the question "are we there?" refers to the last errand [s]."""

CLOSE_DISTANCE: Final = 120.0
"""Distance within which the target is called close [m]."""

ARRIVED_WITHIN: Final = 2.0
"""Distance from the target within which the car has arrived there [m]."""


def has_just_finished(state: ParticipantState, view: ParticipantView, landmarks: Collection[object]) -> bool:
    """Returns whether the errand at one of the given landmarks was done a moment ago."""
    place, at = state.task.finished
    return place in landmarks and view.time - at <= JUST_DONE


def is_elsewhere(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car stands far from the target."""
    progress = state.route.progress
    far = progress is not None and progress.left(view.station) > state.config.elsewhere_distance
    return view.standing and far


def is_near_by(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car stands close to the target, but too far to have arrived."""
    progress = state.route.progress
    return view.standing and progress is not None and abs(progress.left(view.station)) > _STILL_AWAY


def believes(state: ParticipantState, view: ParticipantView, said: Proposition) -> bool | None:
    """Returns whether a proposition is true, from what the participant knows and sees; None if it cannot be decided."""
    found = _holds(state, view, said)
    return found if found is None else found is not said.negated


def _holds(state: ParticipantState, view: ParticipantView, said: Proposition) -> bool | None:
    goal = state.task.goal
    progress, place, street = state.route.progress, said.get("place"), said.get("street")
    about_goal = goal is not None and place in (None, goal.name)
    left = math.inf if progress is None else progress.left(view.station)
    match said.predicate:
        case Predicate.SEES:
            return any(thing.kind is said.get("object") for thing in view.objects)
        case Predicate.GOAL | Predicate.KNOWS | Predicate.LOCATED | Predicate.TASK:
            return about_goal and (street is None or (goal is not None and goal.street is street))
        case Predicate.ON_STREET:
            return street_of(view.raw, state.town, view.lane) is street
        case Predicate.ARRIVED:
            done = state.task.finished[0]
            if view.standing and place in (None, done) and done is not None and has_just_finished(state, view, (done,)):
                return True
            return about_goal and view.standing and about_to_arrive(state, view) and abs(left) < ARRIVED_WITHIN
        case Predicate.CLOSE:
            return about_goal and left < CLOSE_DISTANCE
        case Predicate.RIGHT_WAY:
            return None if progress is None else not progress.astray
        case Predicate.WILL | Predicate.DOES:
            return _is_wanted(state, view, said)
        case Predicate.STANDS:
            return view.standing
        case _:
            return None


def _is_wanted(state: ParticipantState, view: ParticipantView, said: Proposition) -> bool | None:
    """Returns whether an action that the car plans or proposes is the next step; None without a route."""
    step = route_step(state, view)
    if step is None or state.route.progress is None or state.route.progress.route is None:
        return None
    direction, action, street = said.get("direction"), said.get("action"), said.get("street")
    if action in LEFT_TO_THE_CAR:
        return True
    if street is not None and action is None:
        own = first_new_street(view.raw, state.town, view.lane, state.route.progress)
        return own is None or own is street
    if step.direction is Direction.STRAIGHT or step.key[0] == "on":
        return action in (ActionValue.LANE_FOLLOW, ActionValue.J_TURN, None) and direction in (None, Direction.STRAIGHT)
    return action in (step.action, None) and direction in (step.direction, None)
