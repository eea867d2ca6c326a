"""Repairs of the dialogue: the participant has not understood the car, or the car the participant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.conversation import is_partly_inaudible, speech_seconds
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, Slot, SlotValue
from dorothie_gym.policies import act_builders
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

_SIDEWAYS = (ActionValue.J_TURN, ActionValue.LANE_SWITCH)


def has_missed(state: ParticipantState, view: ParticipantView, heard: HeardUtterance, rng: np.random.Generator) -> bool:
    """Returns whether the participant must ask again for words that were inaudible or said while it was speaking.

    Args:
        state: working copy of the state; keeps the utterance, to answer it after the clarification.
        view: observation.
        heard: utterance of the car.
        rng: random generator of the decision.
    """
    if is_partly_inaudible(heard.words.text) and state.speech.may_ask_back(view.time):
        state.say_first(intend(CommunicativeFunction.NEGATIVE_FEEDBACK))
        return True
    if heard.acts[0].move is DialogueMove.CLARIFY:
        return False
    spoke_meanwhile = state.speech.last_end > view.time - speech_seconds(heard.words.text)
    matters = any(act.move in _WORTH_REPEATING and _has_named_slot(act) for act in heard.acts)
    if not (spoke_meanwhile and matters and state.speech.idle and rng.random() < state.style.puzzled):
        return False
    state.conversation = state.conversation.with_puzzle(heard)
    state.say_first(intend(CommunicativeFunction.NEGATIVE_FEEDBACK))
    return True


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
