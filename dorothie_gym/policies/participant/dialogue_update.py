"""State update from an utterance of the car: one reaction of the participant for each dialogue move."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.conversation import speech_seconds
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import SIGNS_OF_HEARING, DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import (
    ActionValue,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.heard_utterance import HeardUtterance, heard_utterance
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.participant.acknowledging import answers_question, needs_nod, take_note, thank
from dorothie_gym.policies.participant.advance_directions import answer_with_way, take_up_confirmation
from dorothie_gym.policies.participant.answer_parts import addition, checked, denied
from dorothie_gym.policies.participant.answers import (
    answer_yes_no,
    check,
    correct_arrival,
    deny_arrival,
    deny_other_place,
    go_first,
    is_just_short,
)
from dorothie_gym.policies.participant.early_corrections import contradicts_turn
from dorothie_gym.policies.participant.final_approach import straight_on
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.participant.proposition_truth import has_just_finished, is_elsewhere, is_near_by
from dorothie_gym.policies.participant.repairs import ask_back, correction, explain_again, has_missed
from dorothie_gym.policies.participant.route_steps import route_step
from dorothie_gym.policies.participant.standstill import waits_for_road
from dorothie_gym.policies.participant.stories import story_remark
from dorothie_gym.policies.participant.subgoals import announcement, describe, pick_up_wording
from dorothie_gym.policies.participant.turn_by_turn_guidance import next_step, note_step
from dorothie_gym.policies.participant.unprompted_remarks import note_blocked
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import LONGEST_BREATH, Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView


REASON_FIRST = 0.7
"""Share of the given reasons that come before the destination when the car asks for it."""

TIME_TO_STOP = 5.0
"""Time before the place in which a question for the way can still be answered, and the car be stopped [s]."""

SLOW = 4.0
"""Speed at which a car creeps towards a place [m/s]."""

_YES_NO = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.CONFIRM})


_POOR_VIEW = frozenset({Predicate.FAILED, Predicate.VISIBILITY})
"""Remarks of a car with a poor view."""

_GARBLED_WHERE = re.compile(r"(so|and|now|well|okay|,| )*where\b")
"""Beginning of a question for the destination, the rest of which was not understood."""

_CLAIMS_ARRIVAL = re.compile(r"\b(here|here's|arrived|reached|this is|that's|we're at|we are at)\b")
"""Words by which the car says that it has reached a place."""

_LACKS_PLACE = re.compile(
    r"\b((can't|cannot) find|(is not|isn't|not)( \w+)? on my|doesn't show|don't have|isn't marked"
    r"|(don't know|no idea) where (?!we|i\b))\b"
)
"""Words by which the car says that it does not find the place, even if parts of them are misheard."""

_KNOWS_WAY = re.compile(
    r"\b((?<!don't )know (the way|how to get)|have (a|the) (route|way)|(the|got the) way (is clear|on my map))\b"
    r"|\b(minutes?|seconds) (to go|from here)\b"
)
"""Words by which the car says that it knows the way to its destination."""

_KNOWS_PLACE = re.compile(
    r"\b(know (where it is|the way|the place|how to get)|(it's|have it) on my map|have (a|the) (route|way))\b"
    r"|\b(minutes?|seconds?)( and a half)? (to go|from here)\b"
)
"""Words by which the car says that it needs no directions."""

_MEASURES = re.compile(r"\b(minutes?|seconds?|meters?)\b")
"""Words by which the car says how far it is."""

_LACKS_GOAL = re.compile(r"\b(no destination|nothing on my list|don't know where to go)\b")
"""Words by which the car says that it was not told where to go, or has not understood it."""

_OBEYED = re.compile(r"\b(you (told|asked) me|you said|told to)\b")
"""Words by which the car says that it has stopped on an order."""

_LACKS_WAY = re.compile(r"\b(know the way|where to turn|which way)\b")
"""Words by which the car says that it has stopped because it does not know the way."""


def listen(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Processes the utterance of the car since the last decision and queues replies."""
    heard = heard_utterance(view.raw, Role.CO_WIZARD)
    if heard is None:
        return
    state.conversation = state.conversation.after_hearing(view.time)
    state.speech = state.speech.heard_other(view.time, heard.acts, rng, state.clock.interval / 2.0)
    if _asks_what_is_being_said(state, view, heard) or (heard.acts and has_missed(state, view, heard, rng)):
        return
    puzzled_by = state.conversation.puzzled_by
    if puzzled_by is not None:
        made_clear = any(act.move is DialogueMove.CLARIFY for act in heard.acts)
        heard = puzzled_by if made_clear else heard
        state.conversation = state.conversation.with_puzzle(None)
    noticed = state.conversation.noticed.after_hearing(heard.words, view.time)
    state.conversation = state.conversation.with_noticed(noticed)
    state.speech = state.speech.without_told(heard.words.told)
    if heard.words.told is not None and heard.words.told.predicate in _POOR_VIEW:
        state.conversation = state.conversation.after_talking_about_view()
        state.speech = state.speech.without_statements(_POOR_VIEW)
    _note_knowledge(state, view, heard.words)
    if take_up_confirmation(state, view, heard, rng):
        return
    asked = any(act.move is DialogueMove.QUERY_W for act in heard.acts)
    before = state.speech
    for act in heard.acts:
        answer = _ANSWERS.get(act.move)
        if asked and GoalStatus.UNKNOWN in act.slots:
            continue  # the question that follows is answered instead
        if answer is not None:
            answer(state, view, act, heard.words, rng)
    again = _to_say_again(state, view, heard) if state.speech is before else None
    if again is not None:
        state.say_first(again)
    elif state.speech is before and answers_question(state, heard):
        thank(state, view, rng)
    elif state.speech is before and needs_nod(state, view, heard):
        take_note(state, view, heard, rng)


def _note_knowledge(state: ParticipantState, view: ParticipantView, words: ParsedText) -> None:
    """Leaves the way to a car that says that it knows it, and remembers that it has said how far it is."""
    said = words.text.lower()
    if _MEASURES.search(said) is not None:
        state.conversation = state.conversation.after_hearing_how_far(view.time)
    knows = _KNOWS_PLACE.search(said) is not None and _LACKS_PLACE.search(said) is None
    if knows and not words.question and not state.task.described:
        state.set_guiding(False)


# --- open questions -------------------------------------------------------------------------------------------------


def _open_question(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks, actions = act.values(Slot.LANDMARK), act.values(Slot.ACTION)
    if state.task.goal is None:
        state.say_first(intend(Function.UNCERTAIN_ANSWER))
    elif words.order is not None and landmarks:
        _name_order(state, landmarks, rng)
    elif _correct(state, view, act, words):
        return
    elif GoalStatus.QUERIED in act.values(Slot.STATUS) or not state.task.announced:
        _name_target(state, view, rng)
    elif landmarks == (LandmarkName.QUERIED,):
        _name_target(state, view, rng, *addition(state, view, rng))
    elif actions:
        if not _was_just_named(state, view):
            state.set_guiding(True)
            _name_step(state, view, DialogueMove.REPLY_W, rng)
    elif landmarks or act.values(Slot.STREET) or words.asked is not None:
        describe(state, view, Function.ANSWER, rng, asks_street=bool(act.values(Slot.STREET)))
    elif _GARBLED_WHERE.match(words.text.lower()) or state.speech.has_just_asked_back:
        _name_target(state, view, rng)  # most probably
    else:
        ask_back(state, view, words, rng)


def _asks_what_is_being_said(state: ParticipantState, view: ParticipantView, heard: HeardUtterance) -> bool:
    """Returns whether the car has asked where to go, or something inaudible, while it was being told."""
    asks = bool(heard.acts) and all(
        act.move is DialogueMove.QUERY_W and not act.values(Slot.ACTION) for act in heard.acts
    )
    explicit = any(LandmarkName.QUERIED in act.slots for act in heard.acts)
    meanwhile = state.speech.last_end > view.time - speech_seconds(heard.words.text)
    told = _is_just_announced(state, view) or _was_just_named(state, view)
    return asks and told and not state.speech.has_just_asked_back and (explicit or meanwhile)


def _is_just_announced(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the destination is being named, or was a moment ago, so that a question for it is settled."""
    return view.time - state.task.announced_at < state.config.just_said


def _name_target(state: ParticipantState, view: ParticipantView, rng: np.random.Generator, *more: Remark) -> None:
    """Answers the question where to go."""
    state.task = state.task.after_announcement(view.time)
    announced = announcement(state, view, rng).meaning[0]
    street = announced.get("street")
    place = act_builders.first_name([announced.get("place")])
    wanted = act_builders.destination(place, street if isinstance(street, StreetName) else None)
    answer = intend(Function.ANSWER, wanted, wording=pick_up_wording(state, view))
    reason = story_remark(state, view, rng) if rng.random() < REASON_FIRST * state.style.reasons else ()
    state.say_only(*reason[:1], replace(answer, joined=bool(reason)), *more)


def _name_order(state: ParticipantState, landmarks: Collection[SlotValue], rng: np.random.Generator) -> None:
    """Answers the question about the order of two tasks: the target is finished first."""
    goal = state.task.destination
    other = act_builders.first_name(name for name in landmarks if name is not goal.name)
    order = Proposition.of(Predicate.ORDER, place=goal.name, then=other)
    state.say_first(intend(Function.ANSWER, order, elided=("place", "then"), wording=Wording(topic="after")))
    if rng.random() < state.config.explains_order:
        state.speech = state.speech.with_second(go_first(goal.name))


def _was_just_named(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the place was named so recently that the car cannot have reacted yet."""
    goal = state.task.goal
    if goal is None or not state.speech.has_just_spoken(view.time, state.config.just_said):
        return False
    for item in reversed(state.speech.said[-LONGEST_BREATH:]):
        if goal.name in item.act.values(Slot.LANDMARK):
            return True
        if not item.joined:
            break  # the beginning of the last utterance
    return False


def _name_step(state: ParticipantState, view: ParticipantView, move: DialogueMove, rng: np.random.Generator) -> None:
    """Announces the next step, unless a stop instruction or the same answer is being spoken."""
    step = None if view.turning else next_step(state, view, move, rng)
    if step is None:
        return
    key, distance, words = step
    if key[0] == "on" and distance < state.config.stop_distance:
        if distance > TIME_TO_STOP * max(view.speed, SLOW) and not view.standing:  # the stop is announced next
            state.say_only(order(move, ActionValue.LANE_FOLLOW, Wording(topic="run_up")))
        return
    if key[0] in ("turn", "on") and waits_for_road(state, view):
        state.say_first(intend(Function.UNCERTAIN_ANSWER))  # there is no way round
        return
    answers = move is DialogueMove.REPLY_W
    if answers and state.guidance.step == key and view.time - state.guidance.step_at < state.config.just_said:
        return  # the question was asked during the answer
    way = answer_with_way(state, view, key, distance, move, rng)
    if way:
        state.say_only(*way)
        return
    note_step(state, view, key)
    state.say_only(words, *(addition(state, view, rng) if answers else ()))


# --- other moves ----------------------------------------------------------------------------------------------------


def _explanation(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    landmarks, statuses = act.values(Slot.LANDMARK), act.values(Slot.STATUS)
    if _correct(state, view, act, words) or contradicts_turn(state, view, act, words):
        return
    names_goal = state.task.goal is not None and state.task.goal.name in landmarks
    lost = GoalStatus.UNKNOWN in statuses or _LACKS_PLACE.search(words.text.lower()) is not None
    if lost and state.task.goal is not None and (names_goal or not landmarks):
        describe(state, view, Function.INFORM, rng)
        return
    if _has_another_goal(state, act, words):
        goal = state.task.destination
        state.feel(Happening.MISUNDERSTOOD, view.time)
        state.task = state.task.after_reminding(view.time)
        state.say_only(intend(Function.CORRECTION, act_builders.destination(goal.name, goal.street)))
        return
    claims = bool(landmarks) and not statuses and _CLAIMS_ARRIVAL.search(words.text.lower()) is not None
    if claims and not names_goal and view.standing and not has_just_finished(state, view, landmarks):
        deny_other_place(state, landmarks)
        return
    if claims and names_goal and is_elsewhere(state, view) and not has_just_finished(state, view, landmarks):
        deny_arrival(state)
        return
    if claims and names_goal and is_near_by(state, view) and not has_just_finished(state, view, landmarks):
        state.set_guiding(True)
        if is_just_short(state, view):
            correct_arrival(state, view)
        else:
            deny_arrival(state)
        return
    if ActionValue.U_TURN in act.values(Slot.ACTION):
        _let_turn_round(state, view)
    if act.values(Slot.OBJECT):
        state.motion = state.motion.excused(view.time + state.config.excuse_time)
        if ObjectClass.STATIC in act.values(Slot.OBJECT):
            note_blocked(state, view, near=True)


def _let_turn_round(state: ParticipantState, view: ParticipantView) -> None:
    """Does not order a U-turn that the car has just announced by itself."""
    step = route_step(state, view)
    if step is not None and step.key[0] == "round" and state.guidance.guiding:
        note_step(state, view, step.key)
        first = state.speech.first
        if first is not None and ActionValue.U_TURN in first.act.values(Slot.ACTION):
            state.speech = state.speech.cleared()


def _has_another_goal(state: ParticipantState, act: DialogueAct, words: ParsedText) -> bool:
    """Returns whether the car says that it knows the way, although it is guided to a place that is not on its map."""
    guided = state.guidance.guiding and state.task.described and state.task.goal is not None
    return guided and not act.slots and _KNOWS_WAY.search(words.text.lower()) is not None


def _answer_to_why(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Reacts to the car's reason for a standstill.

    Denies a wrong claim of arrival, gives requested directions, and repeats the destination if the car still
    stands at the place of a previous errand.
    """
    goal, said, places, asked = state.task.goal, words.text.lower(), act.values(Slot.LANDMARK), state.speech.last
    if goal is not None and _LACKS_GOAL.search(said):
        state.task = state.task.after_reminding(view.time)
        state.say_first(announcement(state, view, rng))
        return
    if act.values(Slot.OBJECT):
        state.motion = state.motion.excused(view.time + state.config.excuse_time)
    if goal is None or asked is None or ActionValue.STOP not in asked.act.slots:
        return
    if _OBEYED.search(said) and view.standing and math.isinf(state.task.resume_at) and not is_near_by(state, view):
        state.say_first(intend(Function.REQUEST, act_builders.action(ActionValue.START)))
        return  # it was a misunderstanding
    if _LACKS_WAY.search(said):
        state.set_guiding(True)
        before = state.speech
        _name_step(state, view, DialogueMove.INSTRUCT, rng)
        if state.speech is before:  # there is no turn before the place
            state.say_first(straight_on())
    elif not places or not _CLAIMS_ARRIVAL.search(said):
        return
    elif goal.name not in places:
        state.task = state.task.after_reminding(view.time)
        state.say_first(announcement(state, view, rng))
    elif is_elsewhere(state, view) and not has_just_finished(state, view, places):
        deny_arrival(state)
    elif is_just_short(state, view):
        correct_arrival(state, view)


def _to_say_again(state: ParticipantState, view: ParticipantView, heard: HeardUtterance) -> Remark | None:
    """Returns the question that the car has misheard, or the destination that it denies; None without either."""
    if not _denies_destination(state, heard):
        return _misheard_question(state, heard)
    goal = state.task.destination
    state.task = state.task.after_reminding(view.time)
    return intend(Function.REQUEST, act_builders.destination(goal.name, goal.street))


def _denies_destination(state: ParticipantState, heard: HeardUtterance) -> bool:
    """Returns whether the car has answered that it is not going to the place where it should."""
    last, goal = state.speech.last, state.task.goal
    checked = last is not None and last.act.move is DialogueMove.CHECK and goal is not None
    denied = bool(heard.acts) and heard.acts[0].move in (DialogueMove.REPLY_N, DialogueMove.REPLY_U)
    return checked and denied and goal is not None and last is not None and goal.name in last.act.slots


def _misheard_question(state: ParticipantState, heard: HeardUtterance) -> Remark | None:
    """Returns the open question to be asked once more, because the car has answered it with a yes or a no."""
    last, before = state.speech.last, state.speech.said[-2:-1]
    if last is None or last.act.move is not DialogueMove.QUERY_W or heard.acts[0].move not in _YES_NO:
        return None
    return None if before and before[0].act == last.act else replace(last, text="", joined=False)


def _correct(state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText) -> bool:
    """Corrects a misunderstanding of the car; returns whether there was one."""
    again = correction(state, view, act, words)
    if again is None:
        return False
    state.feel(Happening.MISUNDERSTOOD, view.time)
    state.task = state.task.after_reminding(view.time)
    refusal = (denied(checked(state, act, words)),) if act.move is DialogueMove.CONFIRM else ()
    state.say_only(*refusal, replace(again, joined=bool(refusal)))
    return True


def _confusion(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Explains again what the car has not understood."""
    state.feel(Happening.MISUNDERSTOOD, view.time)
    if all(item.act.move in SIGNS_OF_HEARING for item in state.speech.queue):
        state.speech = state.speech.cleared()  # an "okay" to what was said before
    explain_again(state, view, rng)


def _acknowledgement(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Ends the guidance of a car that repeats the place, because it knows the way; corrects one that names another."""
    if _correct(state, view, act, words):
        return
    if state.task.goal is not None and state.task.goal.name in act.values(Slot.LANDMARK):
        state.set_guiding(False)


def _alignment(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    topic = "hears" if words.about_hearing else "align"
    state.say_first(intend(Function.POSITIVE_FEEDBACK, wording=Wording(topic=topic)))


def _request(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText, rng: np.random.Generator
) -> None:
    """Guides a car that asks for help; a car that names a place or a turn only repeats an instruction."""
    if act.values(Slot.LANDMARK):
        _acknowledgement(state, view, act, words, rng)
    elif state.task.goal is not None and not act.values(Slot.ACTION):
        state.set_guiding(True)
        _name_step(state, view, DialogueMove.INSTRUCT, rng)
        if words.told is not None and words.told.predicate in _POOR_VIEW:
            known = Proposition.of(Predicate.KNOWS, place=state.task.goal.name)
            state.say_first(intend(Function.INFORM, known, elided=("place",), wording=Wording(topic="guides")))


_ANSWERS: dict[
    DialogueMove, Callable[[ParticipantState, ParticipantView, DialogueAct, ParsedText, np.random.Generator], None]
] = {
    DialogueMove.CHECK: check,
    DialogueMove.QUERY_YN: answer_yes_no,
    DialogueMove.QUERY_W: _open_question,
    DialogueMove.EXPLAIN: _explanation,
    DialogueMove.CLARIFY: _explanation,
    DialogueMove.CONFUSE: _confusion,
    DialogueMove.ALIGN: _alignment,
    DialogueMove.INSTRUCT: _request,
    DialogueMove.ACKNOWLEDGE: _acknowledgement,
    DialogueMove.CONFIRM: _acknowledgement,
    DialogueMove.REPLY_W: _answer_to_why,
}
