"""Repairs of the dialogue: the participant has not understood the car, or the car the participant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.conversation import is_partly_inaudible, resembles_request_to_repeat, speech_seconds
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import SIGNS_OF_HEARING, DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, Slot, SlotValue
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.participant.failed_guidance import IN_VAIN
from dorothie_gym.policies.participant.order_history import times_told
from dorothie_gym.policies.participant.turn_by_turn_guidance import next_step, note_step
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import Remark, intend, repeated

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.heard_utterance import HeardUtterance
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

_WORTH_REPEATING = act_builders.QUESTIONS | {DialogueMove.EXPLAIN}
"""Moves whose repetition the participant requests."""

_TAKES_UP = frozenset({DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.EXPLAIN, DialogueMove.QUERY_W})
"""Moves of the car that show how it has understood an instruction."""

_SHORT_ANSWERS = frozenset({DialogueMove.REPLY_Y, DialogueMove.REPLY_N, DialogueMove.REPLY_U})


_ORDERING = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})

_ABOUT_TALK = frozenset({DialogueMove.CONFUSE, DialogueMove.ALIGN})

_AT_ONCE = frozenset({ActionValue.STOP, ActionValue.START, ActionValue.SPEED_CHANGE, ActionValue.LIGHT_CHANGE})
"""Actions that are wanted immediately and are not steps of the route."""

_SIDEWAYS = (ActionValue.J_TURN, ActionValue.LANE_SWITCH)


def has_missed(state: ParticipantState, view: ParticipantView, heard: HeardUtterance, rng: np.random.Generator) -> bool:
    """Returns whether the participant must ask again for words that were inaudible or said while it was speaking.

    Args:
        state: working copy of the state; keeps the utterance, to answer it after the clarification.
        view: observation.
        heard: utterance of the car.
        rng: random generator of the decision.
    """
    sign = heard.acts[0].move in SIGNS_OF_HEARING
    if not sign and is_partly_inaudible(heard.words.text) and state.speech.may_ask_back(view.time):
        state.say_first(intend(CommunicativeFunction.NEGATIVE_FEEDBACK))
        return True
    if heard.acts[0].move is DialogueMove.CLARIFY or not state.speech.may_ask_back(view.time):
        return False
    last, told = state.speech.last, heard.words.told
    if told is not None and last is not None and any(said.contains(told) for said in last.meaning):
        return False  # both say the same
    spoke_meanwhile = state.speech.last_end > view.time - speech_seconds(heard.words.text)
    matters = any(act.move in _WORTH_REPEATING and _has_named_slot(act) for act in heard.acts)
    if not (spoke_meanwhile and matters and state.speech.idle and rng.random() < state.style.puzzled):
        return False
    state.conversation = state.conversation.with_puzzle(heard)
    state.say_first(intend(CommunicativeFunction.NEGATIVE_FEEDBACK))
    return True


def ask_back(state: ParticipantState, view: ParticipantView, words: ParsedText, rng: np.random.Generator) -> None:
    """Reacts to a question of the car that was not understood: asks once, and then says where the car shall go.

    Args:
        state: working copy of the state.
        view: observation.
        words: what was heard.
        rng: random generator of the decision.
    """
    if state.speech.may_be_asked_for(view.time) and resembles_request_to_repeat(words.text):
        explain_again(state, view, rng)
    elif state.speech.may_ask_back(view.time):
        state.say_first(intend(CommunicativeFunction.NEGATIVE_FEEDBACK))
    elif not name_step_or_place(state, view, rng):
        state.say_first(intend(CommunicativeFunction.UNCERTAIN_ANSWER))


def name_step_or_place(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> bool:
    """Names the next step to a guided car, otherwise the place and its street; returns whether it names either.

    Nothing is named that was named just before.
    """
    goal, last = state.task.goal, state.speech.last_content
    lately = last is not None and state.speech.has_just_spoken(view.time, state.config.just_said)
    if goal is None or not state.task.announced:
        return False
    step = next_step(state, view, DialogueMove.INSTRUCT, rng) if state.guidance.guiding else None
    stops_soon = step is not None and step[0][0] == "on" and step[1] < state.config.stop_distance
    if step is not None and not stops_soon and not (lately and last is not None and last.act == step[2].act):
        note_step(state, view, step[0])
        state.say_only(step[2])
        return True
    place = intend(CommunicativeFunction.REQUEST, act_builders.destination(goal.name, goal.street))
    if stops_soon or (lately and last is not None and last.act == place.act):
        return False
    state.task = state.task.after_reminding(view.time)
    state.say_only(place)
    return True


def explain_again(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Reacts to a car that has not understood a remark.

    The remark is repeated once: an order as the next step or the destination, a remark about the moment as it was. Then
    the participant takes another way: it says the place instead of the turn, or the step instead of the place, and
    drops what is not worth it. After that it leaves the repair to the car.

    Args:
        state: working copy of the state.
        view: observation.
        rng: random generator of the decision.
    """
    last, goal = _last_worth_repeating(state), state.task.goal
    turns = state.speech.turns_of_repair(view.time)
    if turns > 1:
        return
    if turns or state.speech.has_just_asked_back:
        _explain_differently(state, view, rng)
        return
    lately = state.speech.has_just_spoken(view.time, state.config.checked_within)
    ordered = last is not None and last.act.move is DialogueMove.INSTRUCT and bool(last.act.slots)
    if last is not None and goal is not None and _is_about_place(last):
        state.say_first(intend(CommunicativeFunction.REQUEST, act_builders.destination(goal.name, goal.street)))
        return  # also a purpose came with the destination, which has to be understood
    if last is not None and lately and (not ordered or _is_of_the_moment(last)):
        again = ordered and max(times_told(state, action) for action in _actions(last)) >= IN_VAIN
        said = repeated(last, CommunicativeFunction.CORRECTION) if again else _again(last)
        state.say_first(said)
        return
    step = next_step(state, view, DialogueMove.CLARIFY, rng) if state.guidance.step is not None else None
    if state.guidance.guiding and step is not None:
        if not (step[0][0] == "on" and step[1] < state.config.stop_distance):  # the stop is announced next
            note_step(state, view, step[0])
            state.say_only(step[2])
    elif goal is not None and state.task.announced:
        state.say_first(intend(CommunicativeFunction.CORRECTION, act_builders.destination(goal.name)))
    elif last is not None:
        state.say_first(repeated(last, CommunicativeFunction.CORRECTION))


def _is_about_place(last: Remark) -> bool:
    """Returns whether a remark names a destination or its purpose, rather than a step."""
    purpose = any(said.predicate is Predicate.PURPOSE for said in last.meaning)
    orders = last.act.move in _ORDERING and GoalStatus.ABANDONED not in last.act.slots
    return purpose or (orders and bool(last.act.values(Slot.LANDMARK)) and not last.act.values(Slot.ACTION))


def _again(last: Remark) -> Remark:
    """Returns a remark to be said again: in the same words if it is small talk, or about an object."""
    asks = last.act.move in act_builders.QUESTIONS and bool(last.act.values(Slot.OBJECT))
    keeps = asks or last.act.move is DialogueMove.IRRELEVANT
    return last if keeps and not last.joined else replace(last, text="", joined=False)


def _last_worth_repeating(state: ParticipantState) -> Remark | None:
    """Returns what matters most in the last utterance: the destination or the order; otherwise its last remark.

    A request to repeat, and the question whether one was understood, are not repeated.
    """
    breath: list[Remark] = []
    for item in reversed(state.speech.said):
        if item.act.move not in _ABOUT_TALK:
            breath.append(item)
        if breath and not item.joined:
            break
    orders = (item for item in reversed(breath) if item.act.move in _ORDERING and item.act.slots)
    return next(orders, breath[0] if breath else None)


def _explain_differently(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> None:
    """Says the place and its street where a turn was not understood, and the step or a hint where the place was not."""
    last, goal = state.speech.last_content, state.task.goal
    about_way = last is None or last.act.slots or last.act.move in act_builders.QUESTIONS
    if not about_way:
        state.say_first(intend(CommunicativeFunction.INFORM, wording=Wording(topic="unimportant")))
        return
    turned = last is not None and bool(set(last.act.values(Slot.ACTION)) & set(_SIDEWAYS))
    if turned and goal is not None and state.task.announced:
        state.task = state.task.after_reminding(view.time)
        state.say_only(intend(CommunicativeFunction.REQUEST, act_builders.destination(goal.name, goal.street)))
    elif not name_step_or_place(state, view, rng):
        state.say_first(intend(CommunicativeFunction.INFORM, wording=Wording(topic="unimportant")))


def _is_of_the_moment(said: Remark) -> bool:
    """Returns whether a remark is repeated unchanged: a question, yes or no, small talk, an action off the route."""
    if said.act.move in act_builders.QUESTIONS | _SHORT_ANSWERS or said.act.move is DialogueMove.IRRELEVANT:
        return True
    return bool(set(said.act.values(Slot.ACTION)) & _AT_ONCE)


def _actions(said: Remark) -> tuple[ActionValue, ...]:
    return tuple(value for value in said.act.values(Slot.ACTION) if isinstance(value, ActionValue))


def _has_named_slot(act: DialogueAct) -> bool:
    return any(value.label not in ("Unknown", "Queried") for value in act.slots)


def correction(state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText) -> Remark | None:
    """Returns the correction of a car that takes up an instruction that was not given; None if it has understood.

    Args:
        state: working copy of the state.
        view: observation.
        act: act of the car.
        words: words of the car.
    """
    if act.move not in _TAKES_UP or state.task.goal is None or not state.task.announced:
        return None
    return _corrected_place(state, act) or _corrected_side(state, view, act, words)


def _corrected_place(state: ParticipantState, act: DialogueAct) -> Remark | None:
    """Names the place again if the car has adopted another one or abandoned this one."""
    goal = state.task.destination
    named = {value for value in act.values(Slot.LANDMARK) if value.label not in ("Unknown", "Queried")}
    said = {value for item in state.speech.said for value in item.act.slots}
    dropped = {item.wording.dropped for item in state.speech.said}
    gives_up = named == {goal.name} and act.values(Slot.STATUS) == (GoalStatus.ABANDONED,)
    if not named or (goal.name in named and not gives_up):
        return None
    if not gives_up and named & (said | dropped) and not _revives(state, act, named):
        return None
    if act.move is DialogueMove.EXPLAIN and GoalStatus.UNKNOWN not in act.slots:
        return None  # a remark about something in sight
    street = goal.street if goal.street.label not in ("Unknown", "Queried") else None
    return intend(CommunicativeFunction.CORRECTION, act_builders.destination(goal.name, street))


def _revives(state: ParticipantState, act: DialogueAct, named: set[SlotValue]) -> bool:
    """Returns whether the car resumes an errand that the participant has cancelled."""
    if act.move not in (DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM) or act.values(Slot.STATUS):
        return False
    last = next((item for item in reversed(state.speech.said) if named & set(item.act.slots)), None)
    return last is not None and last.wording.dropped is None and GoalStatus.ABANDONED in last.act.slots


def _corrected_side(
    state: ParticipantState, view: ParticipantView, act: DialogueAct, words: ParsedText
) -> Remark | None:
    """Returns the turn again if another direction was taken up."""
    if words.direction is None or act.move is DialogueMove.EXPLAIN:
        return None
    if view.time - state.speech.last_end > state.config.repeat_memory:
        return None
    for item in reversed(state.speech.said):
        wanted = item.wording.direction
        same = set(item.act.values(Slot.ACTION)) & set(act.values(Slot.ACTION)) & set(_SIDEWAYS)
        if wanted is not None and same:
            right = wanted is words.direction
            return None if right else repeated(item, CommunicativeFunction.CORRECTION)
    return None
