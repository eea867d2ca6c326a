"""What the participant makes of the car's words."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dorothie_gym.dialogue import Wording
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Role,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.policies.hearing import heard_utterance
from dorothie_gym.policies.participant.goals import announcement
from dorothie_gym.policies.participant.guidance import next_step, note_told
from dorothie_gym.policies.participant.mind import ParticipantMind, View
from dorothie_gym.policies.participant.reactions import note_blocked
from dorothie_gym.policies.scenery import SeenLandmark
from dorothie_gym.policies.speech import remark

ELSEWHERE = 40.0
"""A car that stands farther than this from the target has not come to it [m]."""

JUST_TOLD = 5.0
"""A question that was put while the answer was being given needs no other one [s]."""

_FAMOUS = frozenset(LandmarkName) - {
    LandmarkName.HOUSE,
    LandmarkName.PERSON,
    LandmarkName.UNKNOWN,
    LandmarkName.QUERIED,
}


def listen(mind: ParticipantMind, view: View, rng: np.random.Generator) -> None:
    """Takes in what the car has said since the last decision, and prepares answers."""
    heard = heard_utterance(view.raw, Role.CO_WIZARD)
    if heard is None:
        return
    mind.heard_at = view.time
    mind.voice = mind.voice.heard_other(view.time, heard.acts)
    for act in heard.acts:
        answer = _ANSWERS.get(act.move)
        if answer is not None:
            answer(mind, view, act, rng)


def _check(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    landmarks, streets = act.values(Slot.LANDMARK), act.values(Slot.STREET)
    if mind.goal is not None and landmarks:
        right = landmarks == (mind.goal.name,) and streets in ((), (mind.goal.street,))
        if not right:
            mind.voice = mind.voice.plan_first(
                remark(DialogueMove.REPLY_N),
                remark(DialogueMove.INSTRUCT, mind.goal.name, mind.goal.street, joined=True),
            )
            return
    elif act.values(Slot.ACTION) and not _fits(mind, view, act, rng):
        _refuse_with_step(mind, view, rng)
        return
    mind.voice = mind.voice.plan_first(remark(DialogueMove.CONFIRM))


def _fits(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> bool:
    """Whether an action that the car names is what is to be done next."""
    step = next_step(mind, view, DialogueMove.INSTRUCT, rng)
    actions = set(act.values(Slot.ACTION))
    free = {ActionValue.LIGHT_CHANGE, ActionValue.SPEED_CHANGE, ActionValue.START}
    return step is None or bool(actions & free) or bool(actions & set(step[2].act.values(Slot.ACTION)))


def _refuse_with_step(mind: ParticipantMind, view: View, rng: np.random.Generator) -> None:
    step = next_step(mind, view, DialogueMove.INSTRUCT, rng)
    mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_N))
    if step is not None:
        key, _, words = step
        note_told(mind, view, key)
        mind.voice = mind.voice.plan(words)


def _yes_or_no(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    objects, landmarks = act.values(Slot.OBJECT), act.values(Slot.LANDMARK)
    if objects:
        seen = any(thing.kind in objects for thing in view.objects)
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y if seen else DialogueMove.REPLY_N))
    elif landmarks and mind.goal is not None:
        if mind.goal.name in landmarks and _elsewhere(mind, view):
            _not_here(mind, view)
        elif mind.goal.name in landmarks:
            mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y))
        else:
            again = announcement(mind, view, rng)
            mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_N), again)
    elif act.values(Slot.ACTION) and mind.guiding and not _fits(mind, view, act, rng):
        _refuse_with_step(mind, view, rng)
    elif rng.random() < 0.05:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_U), remark(DialogueMove.REPLY_Y))
    else:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y))


def _open_question(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    landmarks, streets, actions = act.values(Slot.LANDMARK), act.values(Slot.STREET), act.values(Slot.ACTION)
    if mind.goal is None:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_U))
    elif landmarks == (LandmarkName.QUERIED,) and view.time - mind.told_at < JUST_TOLD:
        return
    elif landmarks == (LandmarkName.QUERIED,):
        mind.told, mind.told_at = True, view.time
        mind.voice = mind.voice.cleared().plan(announcement(mind, view, rng))
    elif actions:
        mind.guiding = True
        _say_way(mind, view, DialogueMove.REPLY_W, rng)
    elif StreetName.QUERIED in streets:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_W, mind.goal.street))
    elif landmarks and mind.goal.name not in landmarks:
        # "before or after ...?": what is under way is finished first
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_W, wording=Wording(topic="after")))
    else:
        _describe(mind, view, DialogueMove.REPLY_W)


def _say_way(mind: ParticipantMind, view: View, move: DialogueMove, rng: np.random.Generator) -> None:
    step = next_step(mind, view, move, rng)
    if step is None:
        return
    key, _, words = step
    note_told(mind, view, key)
    mind.voice = mind.voice.cleared().plan(words)


def _describe(mind: ParticipantMind, view: View, move: DialogueMove) -> None:
    """Says where the target is, and goes on to tell the way."""
    assert mind.goal is not None
    mind.guiding = True
    values: list[SlotValue] = [mind.goal.street] if mind.goal.street is not StreetName.UNKNOWN else []
    near = _near(mind.goal, view)
    if near is not None:
        values.append(near.name)
    mind.voice = mind.voice.plan_first(remark(move, *values, wording=Wording(topic="where")))


def _elsewhere(mind: ParticipantMind, view: View) -> bool:
    """Whether the car stands, and not at the target."""
    return view.standing and mind.journey is not None and mind.journey.left(view.station) > ELSEWHERE


def _not_here(mind: ParticipantMind, view: View) -> None:
    """The car takes another place for the target."""
    assert mind.goal is not None
    mind.guiding = True
    mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_N, mind.goal.name))


def _near(goal: SeenLandmark, view: View) -> SeenLandmark | None:
    """A well-known place close to the target."""
    found = [
        (abs(other.x - goal.x) + abs(other.y - goal.y), other.row, other)
        for other in view.landmarks
        if other.name in _FAMOUS and other.name is not goal.name
    ]
    return min(found)[2] if found and min(found)[0] < 90.0 else None


def _explanation(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    landmarks, statuses = act.values(Slot.LANDMARK), act.values(Slot.STATUS)
    if GoalStatus.UNKNOWN in statuses and mind.goal is not None and mind.goal.name in landmarks:
        if not mind.guiding:
            _describe(mind, view, DialogueMove.EXPLAIN)
        return
    if mind.goal is not None and mind.goal.name in landmarks and not statuses and _elsewhere(mind, view):
        _not_here(mind, view)
        return
    if act.values(Slot.OBJECT):
        mind.excused_until = view.time + 30.0
        if ObjectClass.STATIC in act.values(Slot.OBJECT):
            note_blocked(mind, view, near=True)
    if mind.voice.idle and rng.random() < 0.2:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE))


def _confusion(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    last = mind.voice.last
    if mind.guiding and mind.guided is not None:
        _say_way(mind, view, DialogueMove.CLARIFY, rng)
    elif mind.goal is not None and mind.told:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.CLARIFY, mind.goal.name))
    elif last is not None:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.CLARIFY, *last.act.slots))


def _uptake(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    """A car that repeats the place knows it, and finds the way by itself."""
    if mind.goal is not None and mind.goal.name in act.values(Slot.LANDMARK):
        mind.guiding = False


def _alignment(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    mind.voice = mind.voice.plan_first(remark(DialogueMove.ACKNOWLEDGE, wording=Wording(topic="align")))


def _request(mind: ParticipantMind, view: View, act: DialogueAct, rng: np.random.Generator) -> None:
    if mind.goal is not None:
        mind.guiding = True
        _say_way(mind, view, DialogueMove.INSTRUCT, rng)


_ANSWERS: dict[DialogueMove, Callable[[ParticipantMind, View, DialogueAct, np.random.Generator], None]] = {
    DialogueMove.CHECK: _check,
    DialogueMove.QUERY_YN: _yes_or_no,
    DialogueMove.QUERY_W: _open_question,
    DialogueMove.EXPLAIN: _explanation,
    DialogueMove.CONFUSE: _confusion,
    DialogueMove.ALIGN: _alignment,
    DialogueMove.INSTRUCT: _request,
    DialogueMove.ACKNOWLEDGE: _uptake,
    DialogueMove.CONFIRM: _uptake,
}
