"""Answers of the Co-Wizard to questions."""

from __future__ import annotations

import itertools

import numpy as np

from dorothie_gym.dialogue import Direction, ParsedText, Wording
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    LandmarkName,
    ObjectClass,
    PhysicalAction,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.policies.co_wizard.acknowledgement import plan_remark
from dorothie_gym.policies.co_wizard.driving import wanted_exit
from dorothie_gym.policies.co_wizard.initiative import ANNOUNCED, visibility_topic
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.route_progress import direction_of
from dorothie_gym.policies.speech import Remark, remark


def answer_yes_no(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers a yes/no question."""
    objects, landmarks, actions = act.values(Slot.OBJECT), act.values(Slot.LANDMARK), act.values(Slot.ACTION)
    if ActionValue.LIGHT_CHANGE in actions:
        _answer_lights(state, view)
        return
    topic = None
    if objects:
        topic = "seen"
        yes = any(thing.kind in objects for thing in view.objects) or view.hazard in objects
    elif landmarks:
        topic = "known"
        yes = any(mark.name in landmarks for mark in view.landmarks)
    elif actions:
        topic = "doing"
        yes = _present_action(view) in actions
    else:
        progress = state.route.progress
        yes = progress is not None and progress.left(view.station) < state.config.close_distance
    more = _visibility_reason(view, rng) if objects and not yes else plan_remark(state, rng, joined=True)
    answer = remark(DialogueMove.REPLY_Y if yes else DialogueMove.REPLY_N, wording=Wording(topic=topic))
    state.say(answer, *more)


def _answer_lights(state: CoWizardState, view: CoWizardView) -> None:
    """Answers a question about the head lights, which also asks for them to be switched on."""
    state.intentions = state.intentions.with_lights(True)
    state.say(remark(DialogueMove.REPLY_Y if view.lights else DialogueMove.REPLY_N))
    if not view.lights:
        wording = Wording(lights=True)
        state.say(remark(DialogueMove.EXPLAIN, ActionValue.LIGHT_CHANGE, wording=wording, joined=True))


def _visibility_reason(view: CoWizardView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns a remark about the condition that limits the view, if there is one, by chance."""
    topic = visibility_topic(view)
    if topic is None or rng.random() < 0.3:
        return ()
    return (remark(DialogueMove.EXPLAIN, wording=Wording(topic=topic), joined=True),)


def _present_action(view: CoWizardView) -> ActionValue:
    if view.standing:
        return ActionValue.STOP
    return ANNOUNCED.get(view.manoeuvre or PhysicalAction.LANE_FOLLOW, ActionValue.LANE_FOLLOW)


def answer_open(
    state: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers an open question."""
    actions, landmarks = act.values(Slot.ACTION), act.values(Slot.LANDMARK)
    if ActionValue.STOP in actions:
        _explain_standing(state, view)
    elif ActionValue.U_TURN in actions:
        _explain_u_turn(state)
    elif ObjectClass.QUERIED in act.values(Slot.OBJECT):
        _name_objects(state, view)
    elif ActionValue.QUERIED in actions:
        _name_way(state, view)
    elif landmarks:
        mark = next((mark for mark in view.landmarks if mark.name in landmarks), None)
        if mark is None or mark.street is StreetName.UNKNOWN:
            state.say(remark(DialogueMove.REPLY_U))
        else:
            state.say(remark(DialogueMove.REPLY_W, mark.street))
    else:
        _name_street(state, view)


def _explain_standing(state: CoWizardState, view: CoWizardView) -> None:
    commands, goal = state.commands, state.beliefs.goal
    reason = view.hazard if view.hazard is not ObjectClass.UNLABELED else commands.rest_for
    standing = view.time - (commands.standing_since if commands.standing_since is not None else view.time)
    recent = view.hazard is reason or standing < state.config.long_standstill
    if reason is not ObjectClass.UNLABELED and recent:
        state.dialogue = state.dialogue.after_explaining_hazard(view.time)
        state.say(remark(DialogueMove.REPLY_W, reason))
    elif state.intentions.arrived and goal is not None:
        state.say(remark(DialogueMove.QUERY_YN, goal))
    elif goal is None and state.intentions.directive is None:
        state.say(remark(DialogueMove.QUERY_W, LandmarkName.QUERIED))
    else:
        if not state.intentions.arrived:
            state.intentions = state.intentions.resumed()
        state.say(remark(DialogueMove.REPLY_U))


def _explain_u_turn(state: CoWizardState) -> None:
    if state.dialogue.detour_asked_at is not None or state.route.blocked:
        state.say(remark(DialogueMove.REPLY_W, ObjectClass.STATIC))
    elif state.beliefs.goal is not None and state.beliefs.exact:
        state.say(remark(DialogueMove.REPLY_W, state.beliefs.goal, wording=Wording(topic="behind")))
    else:
        state.say(remark(DialogueMove.REPLY_W, wording=Wording(topic="instructed")))


def _name_objects(state: CoWizardState, view: CoWizardView) -> None:
    things = tuple(dict.fromkeys(thing.kind for thing in view.objects))[:2] or (ObjectClass.ROAD,)
    state.say(remark(DialogueMove.REPLY_W, *things, wording=Wording(topic="seen")))


def _name_way(state: CoWizardState, view: CoWizardView) -> None:
    turns = _next_turns(state, view)
    if state.intentions.directive is None and turns:
        for k, (values, side) in enumerate(turns):
            wording = Wording(direction=side, topic="plan")
            state.say(remark(DialogueMove.REPLY_W, *values, wording=wording, joined=k > 0))
        return
    way, progress = wanted_exit(state, view), state.route.progress
    if way is None:
        if progress is None:
            state.say(remark(DialogueMove.REPLY_U))
        else:
            action = ActionValue.U_TURN if progress.changes_before(None) else ActionValue.LANE_FOLLOW
            state.say(remark(DialogueMove.REPLY_W, action, wording=Wording(topic="plan")))
        return
    direction = direction_of(way)
    street = street_of(view.raw, state.town, way.lane)
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    slots: list[SlotValue] = [action]
    if street is not StreetName.UNKNOWN:
        slots.append(street)
    wording = Wording(direction=direction, topic="plan")
    state.say(remark(DialogueMove.REPLY_W, *slots, wording=wording))


def _next_turns(state: CoWizardState, view: CoWizardView) -> list[tuple[list[SlotValue], Direction]]:
    """Returns the next turns of the route to the left or right, at most two: slots and direction of each."""
    progress = state.route.progress
    if progress is None or progress.turns_round_first(state.town, view.station):
        return []
    found: list[tuple[list[SlotValue], Direction]] = []
    for crossing in itertools.islice(progress.crossings(state.town, view.station), state.config.plan_junctions):
        street = street_of(view.raw, state.town, crossing.exit.lane)
        if crossing.direction in (Direction.LEFT, Direction.RIGHT):
            values: list[SlotValue] = [ActionValue.J_TURN]
            found.append((values + [street] * (street is not StreetName.UNKNOWN), crossing.direction))
    return found[:2]


def _name_street(state: CoWizardState, view: CoWizardView) -> None:
    street = street_of(view.raw, state.town, view.lane)
    if street is StreetName.UNKNOWN:
        state.say(remark(DialogueMove.REPLY_U))
    else:
        state.say(remark(DialogueMove.REPLY_W, street))
