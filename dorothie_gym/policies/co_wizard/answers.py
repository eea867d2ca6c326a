"""What the Co-Wizard answers to questions."""

from __future__ import annotations

import numpy as np

from dorothie_gym.dialogue import Direction, Heard, Wording
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
from dorothie_gym.policies.co_wizard.driving import wanted_exit
from dorothie_gym.policies.co_wizard.mind import CoWizardMind, View
from dorothie_gym.policies.co_wizard.uptake import musing
from dorothie_gym.policies.journey import direction_of
from dorothie_gym.policies.scenery import street_of
from dorothie_gym.policies.speech import remark

CLOSE = 120.0
"""A goal within this distance is close [m]."""


def answer_yes_no(mind: CoWizardMind, view: View, act: DialogueAct, words: Heard, rng: np.random.Generator) -> None:
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
    if objects:
        yes = any(thing.kind in objects for thing in view.objects) or view.hazard in objects
    elif landmarks:
        yes = any(mark.name in landmarks for mark in view.landmarks)
    elif actions:
        yes = _doing(mind, view) in actions
    else:
        yes = mind.journey is not None and mind.journey.left(view.station) < CLOSE
    more = musing(mind, rng, joined=True)
    mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_Y if yes else DialogueMove.REPLY_N), *more)


def _doing(mind: CoWizardMind, view: View) -> ActionValue:
    if view.standing:
        return ActionValue.STOP
    return {
        PhysicalAction.J_TURN: ActionValue.J_TURN,
        PhysicalAction.U_TURN: ActionValue.U_TURN,
        PhysicalAction.LANE_SWITCH: ActionValue.LANE_SWITCH,
    }.get(view.manoeuvre or PhysicalAction.LANE_FOLLOW, ActionValue.LANE_FOLLOW)


def answer_open(mind: CoWizardMind, view: View, act: DialogueAct, words: Heard, rng: np.random.Generator) -> None:
    """Answers an open question."""
    actions, landmarks = act.values(Slot.ACTION), act.values(Slot.LANDMARK)
    if ActionValue.STOP in actions:
        _why_standing(mind, view)
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


def _why_standing(mind: CoWizardMind, view: View) -> None:
    if view.hazard is not ObjectClass.UNLABELED:
        mind.hazard_told = view.time
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, view.hazard))
    elif mind.arrived and mind.goal is not None:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_YN, mind.goal))
    elif mind.goal is None and mind.directive is None:
        mind.voice = mind.voice.plan(remark(DialogueMove.QUERY_W, LandmarkName.QUERIED))
    else:
        mind.halted = mind.halted and mind.arrived
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_U))


def _which_way(mind: CoWizardMind, view: View) -> None:
    way = wanted_exit(mind, view)
    if way is None:
        if mind.journey is None:
            mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_U))
        else:
            action = ActionValue.U_TURN if mind.journey.changes_before(None) else ActionValue.LANE_FOLLOW
            mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, action))
        return
    direction = direction_of(way)
    street = street_of(view.raw, mind.town, way.lane)
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    values: list[SlotValue] = [action]
    if street is not StreetName.UNKNOWN:
        values.append(street)
    mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, *values, wording=Wording(direction=direction)))


def _where(mind: CoWizardMind, view: View) -> None:
    street = street_of(view.raw, mind.town, view.lane)
    if street is StreetName.UNKNOWN:
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_U))
    else:
        mind.voice = mind.voice.plan(remark(DialogueMove.REPLY_W, street))
