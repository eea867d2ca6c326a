"""What the Co-Wizard answers to questions."""

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
from dorothie_gym.policies.co_wizard.acknowledgement import musing
from dorothie_gym.policies.co_wizard.driving import wanted_exit
from dorothie_gym.policies.co_wizard.initiative import dim_topic
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.route_progress import direction_of
from dorothie_gym.policies.speech import Remark, remark

LONG_REST = 60.0
"""Who has been standing for longer than this does not stand for what it stopped for at first [s]."""

CROSSINGS = 6
"""So many junctions of the plan are looked at for turns to tell of."""

CLOSE = 120.0
"""A goal within this distance is close [m]."""


def answer_yes_no(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers a question that wants a yes or a no."""
    objects, landmarks, actions = act.values(Slot.OBJECT), act.values(Slot.LANDMARK), act.values(Slot.ACTION)
    if ActionValue.LIGHT_CHANGE in actions:
        # a question about the lights in the dark is a wish
        yes = view.lights
        mind.lights = True
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_Y if yes else DialogueMove.REPLY_N))
        if not yes:
            wording = Wording(lights=True)
            mind.voice = mind.voice.plan(
                remark(DialogueMove.EXPLAIN, ActionValue.LIGHT_CHANGE, wording=wording, joined=True)
            )
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
        yes = _doing(mind, view) in actions
    else:
        yes = mind.journey is not None and mind.journey.left(view.station) < CLOSE
    more = _why_not_seen(view, rng) if objects and not yes else musing(mind, rng, joined=True)
    answer = remark(DialogueMove.REPLY_Y if yes else DialogueMove.REPLY_N, wording=Wording(topic=topic))
    mind.voice = mind.voice.plan(answer, *more)


def _why_not_seen(view: CoWizardView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """What keeps it from seeing something, if anything does."""
    bad = dim_topic(view)
    if bad is None or rng.random() < 0.3:
        return ()
    return (remark(DialogueMove.EXPLAIN, wording=Wording(topic=bad), joined=True),)


def _doing(mind: CoWizardState, view: CoWizardView) -> ActionValue:
    if view.standing:
        return ActionValue.STOP
    return {
        PhysicalAction.J_TURN: ActionValue.J_TURN,
        PhysicalAction.U_TURN: ActionValue.U_TURN,
        PhysicalAction.LANE_SWITCH: ActionValue.LANE_SWITCH,
    }.get(view.manoeuvre or PhysicalAction.LANE_FOLLOW, ActionValue.LANE_FOLLOW)


def answer_open(
    mind: CoWizardState, view: CoWizardView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Answers an open question."""
    actions, landmarks = act.values(Slot.ACTION), act.values(Slot.LANDMARK)
    if ActionValue.STOP in actions:
        _why_standing(mind, view)
    elif ActionValue.U_TURN in actions:
        _why_round(mind)
    elif ObjectClass.QUERIED in act.values(Slot.OBJECT):
        _what_it_sees(mind, view)
    elif ActionValue.QUERIED in actions:
        _which_way(mind, view)
    elif landmarks:
        mark = next((mark for mark in view.landmarks if mark.name in landmarks), None)
        if mark is None or mark.street is StreetName.UNKNOWN:
            mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_U))
        else:
            mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, mark.street))
    else:
        _where(mind, view)


def _why_standing(mind: CoWizardState, view: CoWizardView) -> None:
    reason = view.hazard if view.hazard is not ObjectClass.UNLABELED else mind.rest_for
    standing = view.time - (mind.standing_since if mind.standing_since is not None else view.time)
    if reason is not ObjectClass.UNLABELED and (view.hazard is reason or standing < LONG_REST):
        mind.hazard_told = view.time
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, reason))
    elif mind.arrived and mind.goal is not None:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_YN, mind.goal))
    elif mind.goal is None and mind.directive is None:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, LandmarkName.QUERIED))
    else:
        mind.halted = mind.halted and mind.arrived
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_U))


def _why_round(mind: CoWizardState) -> None:
    if mind.detour_at is not None or mind.blocked:
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, ObjectClass.STATIC))
    elif mind.goal is not None and mind.exact:
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, mind.goal, wording=Wording(topic="behind")))
    else:
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, wording=Wording(topic="told")))


def _what_it_sees(mind: CoWizardState, view: CoWizardView) -> None:
    things = tuple(dict.fromkeys(thing.kind for thing in view.objects))[:2] or (ObjectClass.ROAD,)
    mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, *things, wording=Wording(topic="seen")))


def _which_way(mind: CoWizardState, view: CoWizardView) -> None:
    turns = _turns(mind, view)
    if mind.directive is None and turns:
        for k, (told, side) in enumerate(turns):
            wording = Wording(direction=side, topic="plan")
            mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, *told, wording=wording, joined=k > 0))
        return
    way = wanted_exit(mind, view)
    if way is None:
        if mind.journey is None:
            mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_U))
        else:
            action = ActionValue.U_TURN if mind.journey.changes_before(None) else ActionValue.LANE_FOLLOW
            mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, action, wording=Wording(topic="plan")))
        return
    direction = direction_of(way)
    street = street_of(view.raw, mind.town, way.lane)
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    values: list[SlotValue] = [action]
    if street is not StreetName.UNKNOWN:
        values.append(street)
    wording = Wording(direction=direction, topic="plan")
    mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, *values, wording=wording))


def _turns(mind: CoWizardState, view: CoWizardView) -> list[tuple[list[SlotValue], Direction]]:
    """The next turns of the plan that lead elsewhere than straight on, at most two."""
    if mind.journey is None or mind.journey.turns_round_first(mind.town, view.station):
        return []
    found: list[tuple[list[SlotValue], Direction]] = []
    for crossing in itertools.islice(mind.journey.crossings(mind.town, view.station), CROSSINGS):
        street = street_of(view.raw, mind.town, crossing.exit.lane)
        if crossing.direction in (Direction.LEFT, Direction.RIGHT):
            values: list[SlotValue] = [ActionValue.J_TURN]
            found.append((values + [street] * (street is not StreetName.UNKNOWN), crossing.direction))
    return found[:2]


def _where(mind: CoWizardState, view: CoWizardView) -> None:
    street = street_of(view.raw, mind.town, view.lane)
    if street is StreetName.UNKNOWN:
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_U))
    else:
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, street))
