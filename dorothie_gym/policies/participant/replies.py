"""What the participant makes of the car's words."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue import Direction, ParsedText, Wording
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
)
from dorothie_gym.policies.observation_parser import SeenSubgoal
from dorothie_gym.policies.participant.arriving import NEAR, about_to_arrive, inch_on
from dorothie_gym.policies.participant.goals import announcement, describe, reason_topic, route_length, switch_target
from dorothie_gym.policies.participant.guidance import next_step, note_told
from dorothie_gym.policies.participant.reactions import note_blocked
from dorothie_gym.policies.participant.repairs import misunderstood, not_caught
from dorothie_gym.policies.participant.state import ParticipantState
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.route_progress import first_new_street
from dorothie_gym.policies.speech import LONGEST_BREATH, Remark, remark
from dorothie_gym.policies.utterance_input import heard_utterance

ELSEWHERE = 40.0
"""A car that stands farther than this from the target has not come to it [m]."""

SAYS_IT_ALL = 0.85
"""Chance that the order of two tasks is told by naming the first one as well."""

NODS_FIRST = 0.85
"""Chance that something that is about to be said begins with a word for what the car has said meanwhile."""

JUST_TOLD = 5.0
"""A question that was put while the answer was being given needs no other one [s]."""

UNSURE = 0.08
"""Chance that a yes does not come at once."""

ASKED_BACK = 8.0
"""What the car asks back about it has been told no longer ago than this [s]."""

_FREE = frozenset({ActionValue.LIGHT_CHANGE, ActionValue.SPEED_CHANGE, ActionValue.START})
"""What the car may do as it likes."""

_WAYS = frozenset({ActionValue.J_TURN, ActionValue.U_TURN, ActionValue.LANE_FOLLOW, ActionValue.LANE_SWITCH})
"""Actions that lead somewhere else."""

_UPTAKES = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM})

_AFTER_A_NOD = frozenset({DialogueMove.EXPLAIN, DialogueMove.INSTRUCT})

_AHEAD = frozenset({ActionValue.LANE_FOLLOW, ActionValue.J_TURN})


def listen(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Takes in what the car has said since the last decision, and prepares answers."""
    heard = heard_utterance(view.raw, Role.CO_WIZARD)
    if heard is None:
        return
    mind.heard_at = view.time
    mind.voice = mind.voice.heard_other(view.time, heard.acts)
    if heard.acts and not_caught(mind, view, heard, rng):
        return
    if mind.puzzled_by is not None:
        made_clear = any(act.move is DialogueMove.CLARIFY for act in heard.acts)
        heard, mind.puzzled_by = (mind.puzzled_by if made_clear else heard), None
    asked = any(act.move is DialogueMove.QUERY_W for act in heard.acts)
    before = mind.voice
    for act in heard.acts:
        answer = _ANSWERS.get(act.move)
        if asked and GoalStatus.UNKNOWN in act.slots:
            continue  # the question that follows is what is answered
        if answer is not None:
            answer(mind, view, act, heard.words, rng)
    if mind.voice is before and any(act.move is DialogueMove.EXPLAIN for act in heard.acts):
        _nod(mind, view, rng, alone=heard.acts[0].move not in _UPTAKES)  # what takes up an instruction needs no nod


def _check(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks, streets = act.values(Slot.LANDMARK), act.values(Slot.STREET)
    if mind.goal is not None and landmarks:
        right = landmarks == (mind.goal.name,) and streets in ((), (mind.goal.street,))
        if not right:
            mind.voice = mind.voice.plan_first(
                remark(DialogueMove.REPLY_N),
                remark(DialogueMove.INSTRUCT, mind.goal.name, mind.goal.street, joined=True),
            )
            return
    elif act.values(Slot.ACTION) and not _fits(mind, view, act, words, rng):
        _refuse_with_step(mind, view, rng)
        return
    if landmarks:
        mind.guiding = False  # it knows the place
    mind.voice = mind.voice.plan_first(remark(DialogueMove.CONFIRM), *_more(mind, rng))


def _fits(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> bool:
    """Whether an action that the car names is what is to be done next, or what it has just been told to do."""
    step = next_step(mind, view, DialogueMove.INSTRUCT, rng)
    actions = set(act.values(Slot.ACTION))
    if step is None or actions & _FREE:
        return True
    told = next((item for item in reversed(mind.voice.said) if item.act.values(Slot.ACTION)), None)
    if told is not None and mind.voice.has_just_spoken(view.time, ASKED_BACK) and actions & set(told.act.slots):
        return told.wording.direction in (None, words.direction)
    meant, wanted = set(step[2].act.values(Slot.ACTION)), step[2].wording.direction
    if wanted is Direction.STRAIGHT:
        return bool(actions & _AHEAD) and words.direction in (None, Direction.STRAIGHT)
    return bool(actions & meant) and (wanted is None or words.direction is wanted)


def _more(mind: ParticipantState, rng: np.random.Generator) -> tuple[Remark, ...]:
    """What is added to a yes now and then."""
    if rng.random() >= mind.style.reasons:
        return ()
    topic = "hint" if mind.guiding or rng.random() < 0.5 else reason_topic(mind)
    return (remark(DialogueMove.EXPLAIN, joined=True, wording=Wording(topic=topic)),)


def _refuse_with_step(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    step = next_step(mind, view, DialogueMove.INSTRUCT, rng)
    refusal = remark(DialogueMove.REPLY_N)
    if step is None or view.time - mind.stopped_at < JUST_TOLD or (step[0][0] == "on" and step[1] < NEAR):
        # it is to stop here, or right ahead, and is told so
        mind.voice = mind.voice.plan_first(refusal)
        return
    key, _, words = step
    note_told(mind, view, key)
    mind.voice = mind.voice.plan_first(refusal, replace(words, joined=True))


def _yes_or_no(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    objects, landmarks = act.values(Slot.OBJECT), act.values(Slot.LANDMARK)
    offered = _offered(mind, view, landmarks)
    if offered is not None:
        _judge_offer(mind, view, offered)
    elif act.values(Slot.STREET) and not landmarks and not act.values(Slot.ACTION):
        _judge_street(mind, view, act)
    elif objects:
        seen = any(thing.kind in objects for thing in view.objects)
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y if seen else DialogueMove.REPLY_N))
    elif landmarks and mind.goal is not None:
        if mind.goal.name in landmarks and _elsewhere(mind, view):
            _not_here(mind, view)
        elif mind.goal.name in landmarks:
            mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y))
        else:
            again = announcement(mind, view, rng)
            mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_N), replace(again, joined=True))
    elif set(act.values(Slot.ACTION)) & _WAYS:
        mind.guiding = True
        _judge_proposal(mind, view, act, words, rng)
    elif not act.slots and _just_short(mind, view):
        mind.voice = mind.voice.cleared().plan(remark(DialogueMove.REPLY_N), replace(inch_on(mind, view), joined=True))
    elif rng.random() < UNSURE:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_U), remark(DialogueMove.REPLY_Y))
    else:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y), *_more(mind, rng))


def _offered(mind: ParticipantState, view: ParticipantView, landmarks: tuple[SlotValue, ...]) -> SeenSubgoal | None:
    """The task, other than the one under way, that the car proposes to do first."""
    if mind.goal is None or mind.goal.name in landmarks:
        return None
    for subgoal in view.subgoals:
        landmark = view.landmark(subgoal.landmark)
        if subgoal.open and subgoal.allowed and landmark is not None and landmark.name in landmarks:
            return subgoal
    return None


def _judge_offer(mind: ParticipantState, view: ParticipantView, offered: SeenSubgoal) -> None:
    """Lets the car go to the place that it proposes if that is nearer, else insists on the one under way."""
    assert mind.goal is not None
    landmark = view.landmark(offered.landmark)
    left = mind.journey.left(view.station) if mind.journey is not None else math.inf
    if landmark is not None and route_length(mind, view, landmark) < left:
        switch_target(mind, view, offered, landmark)
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y))
        return
    first = remark(DialogueMove.INSTRUCT, mind.goal.name, wording=Wording(topic="first"), joined=True)
    mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_N), first)


def _judge_street(mind: ParticipantState, view: ParticipantView, act: DialogueAct) -> None:
    """Agrees to a way round that is the participant's own, or insists on that."""
    own = first_new_street(view.raw, mind.town, view.lane, mind.journey)
    if own is None or own in act.values(Slot.STREET):
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_Y))
        return
    instead = remark(DialogueMove.INSTRUCT, own, wording=Wording(topic="detour"), joined=True)
    mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_N), instead)


def _judge_proposal(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Says yes to the right way, and no with the right one to another."""
    if not _fits(mind, view, act, words, rng):
        _refuse_with_step(mind, view, rng)
        return
    step = next_step(mind, view, DialogueMove.INSTRUCT, rng)
    if step is not None:
        note_told(mind, view, step[0])
    first = (remark(DialogueMove.REPLY_U),) if rng.random() < UNSURE else ()
    mind.voice = mind.voice.plan_first(*first, remark(DialogueMove.REPLY_Y), *_more(mind, rng))


def _open_question(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks, actions = act.values(Slot.LANDMARK), act.values(Slot.ACTION)
    if mind.goal is None:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_U))
    elif words.order is not None and landmarks:
        _say_order(mind, rng)
    elif _put_right(mind, view, act, words):
        return
    elif GoalStatus.QUERIED in act.values(Slot.STATUS):
        _say_target(mind, view, rng)
    elif landmarks == (LandmarkName.QUERIED,) and (view.time - mind.told_at < JUST_TOLD or _just_named(mind, view)):
        return
    elif landmarks == (LandmarkName.QUERIED,):
        _say_target(mind, view, rng, *_more(mind, rng))
    elif actions and _just_named(mind, view):
        return
    elif actions:
        mind.guiding = True
        _say_way(mind, view, DialogueMove.REPLY_W, rng)
    else:
        describe(mind, view, DialogueMove.REPLY_W, rng)


def _say_target(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator, *more: Remark) -> None:
    """To "where to?": the place that comes next."""
    mind.told, mind.told_at = True, view.time
    named = [value for value in announcement(mind, view, rng).act.slots if value.slot in (Slot.LANDMARK, Slot.STREET)]
    answer = remark(DialogueMove.REPLY_W, *named, wording=Wording(topic="goal"))
    mind.voice = mind.voice.cleared().plan(answer, *more)


def _say_order(mind: ParticipantState, rng: np.random.Generator) -> None:
    """To "before or after?": what is under way is finished first."""
    assert mind.goal is not None
    mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_W, wording=Wording(topic="after")))
    if rng.random() < SAYS_IT_ALL:
        first = remark(DialogueMove.INSTRUCT, mind.goal.name, wording=Wording(topic="first"), joined=True)
        mind.voice = replace(mind.voice, queue=(mind.voice.queue[0], first, *mind.voice.queue[1:]))


def _just_named(mind: ParticipantState, view: ParticipantView) -> bool:
    """Whether the car has been told of the place a moment ago and cannot have taken it up yet."""
    if mind.goal is None or not mind.voice.has_just_spoken(view.time, JUST_TOLD):
        return False
    return any(mind.goal.name in item.act.values(Slot.LANDMARK) for item in mind.voice.said[-LONGEST_BREATH:])


def _say_way(mind: ParticipantState, view: ParticipantView, move: DialogueMove, rng: np.random.Generator) -> None:
    step = next_step(mind, view, move, rng)
    if step is None:
        return
    key, distance, words = step
    if key[0] == "on" and distance < NEAR:
        return  # the place is right ahead: that is what is to be said now
    if move is DialogueMove.REPLY_W and mind.guided == key and view.time - mind.guided_at < JUST_TOLD:
        return  # it was asked while the answer was being given
    note_told(mind, view, key)
    more = _more(mind, rng) if move is DialogueMove.REPLY_W else ()
    mind.voice = mind.voice.cleared().plan(words, *more)


def _elsewhere(mind: ParticipantState, view: ParticipantView) -> bool:
    """Whether the car stands, and not at the target."""
    return view.standing and mind.journey is not None and mind.journey.left(view.station) > ELSEWHERE


def _just_short(mind: ParticipantState, view: ParticipantView) -> bool:
    """Whether the car stands just before the target, to which it is guided."""
    near = mind.guiding and view.standing and mind.journey is not None and about_to_arrive(mind, view)
    return near and mind.journey is not None and mind.journey.left(view.station) > 0.0


def _not_here(mind: ParticipantState, view: ParticipantView) -> None:
    """The car takes another place for the target."""
    assert mind.goal is not None
    mind.guiding = True
    mind.voice = mind.voice.plan_first(remark(DialogueMove.REPLY_N, mind.goal.name))


def _explanation(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks, statuses = act.values(Slot.LANDMARK), act.values(Slot.STATUS)
    if _put_right(mind, view, act, words):
        return
    if GoalStatus.UNKNOWN in statuses and mind.goal is not None and mind.goal.name in landmarks:
        describe(mind, view, DialogueMove.EXPLAIN, rng)
        return
    if mind.goal is not None and mind.goal.name in landmarks and not statuses and _elsewhere(mind, view):
        _not_here(mind, view)
        return
    if act.values(Slot.OBJECT):
        mind.excused_until = view.time + 30.0
        if ObjectClass.STATIC in act.values(Slot.OBJECT):
            note_blocked(mind, view, near=True)


def _nod(mind: ParticipantState, view: ParticipantView, rng: np.random.Generator, *, alone: bool) -> None:
    """Shows that it has heard: before what it says anyway, else now and then `alone`, in a word of its own."""
    waiting = mind.voice.queue
    if waiting and not waiting[0].urgent and not waiting[0].text:
        done = GoalStatus.COMPLETE in waiting[0].act.slots
        if waiting[0].act.move in _AFTER_A_NOD and not done and rng.random() < NODS_FIRST:
            first = replace(waiting[0], joined=True)
            mind.voice = replace(mind.voice, queue=(remark(DialogueMove.ACKNOWLEDGE), first, *waiting[1:]))
    elif not alone or not mind.voice.idle or (mind.guiding and about_to_arrive(mind, view)):
        return
    elif rng.random() < mind.style.nods:
        mind.voice = mind.voice.plan(remark(DialogueMove.ACKNOWLEDGE), *_more(mind, rng))


def _put_right(mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText) -> bool:
    """Says again what the car has taken for something else; tells whether it had to."""
    again = misunderstood(mind, view, act, words)
    if again is None:
        return False
    mind.told_at = view.time
    refusal = (remark(DialogueMove.REPLY_N),) if act.move is DialogueMove.CONFIRM else ()
    mind.voice = mind.voice.cleared().plan(*refusal, replace(again, joined=bool(refusal)))
    return True


def _confusion(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    last = mind.voice.last
    if mind.guiding and mind.guided is not None:
        _say_way(mind, view, DialogueMove.CLARIFY, rng)
    elif mind.goal is not None and mind.told:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.CLARIFY, mind.goal.name))
    elif last is not None:
        mind.voice = mind.voice.plan_first(remark(DialogueMove.CLARIFY, *last.act.slots, wording=last.wording))


def _uptake(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """A car that repeats the place knows it, and finds the way itself; one that names another has to be put right."""
    if _put_right(mind, view, act, words):
        return
    if mind.goal is not None and mind.goal.name in act.values(Slot.LANDMARK):
        mind.guiding = False


def _alignment(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    mind.voice = mind.voice.plan_first(remark(DialogueMove.ACKNOWLEDGE, wording=Wording(topic="align")))


def _request(
    mind: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """A car that wants to be guided is; one that names a place, or a turn, only repeats what it was told."""
    if act.values(Slot.LANDMARK):
        _uptake(mind, view, act, words, rng)
    elif mind.goal is not None and not act.values(Slot.ACTION):
        mind.guiding = True
        _say_way(mind, view, DialogueMove.INSTRUCT, rng)


_ANSWERS: dict[
    DialogueMove, Callable[[ParticipantState, ParticipantView, DialogueAct, ParsedText, np.random.Generator], None]
] = {
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
