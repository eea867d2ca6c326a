"""Contradictory or repeated orders: the participant admits it before it says them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.participant.failed_guidance import IN_VAIN
from dorothie_gym.policies.participant.order_history import has_turned_since, last_given, times_given
from dorothie_gym.policies.policy import replace
from dorothie_gym.policies.speech import LONGEST_BREATH, intend

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView
    from dorothie_gym.policies.speech import Remark

JUST_ORDERED: Final = 9.0
"""Time after an order within which one that contradicts it needs a word of why [s]."""

_ORDERS: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})
_SIDES: Final = frozenset({Direction.LEFT, Direction.RIGHT})
_TURNS: Final = frozenset({ActionValue.J_TURN, ActionValue.U_TURN})
_WAYS: Final = _TURNS | {ActionValue.LANE_FOLLOW}
_COUNTED: Final = _TURNS | {ActionValue.LANE_SWITCH, ActionValue.START, ActionValue.SPEED_CHANGE}
"""Orders that need a remark the third time; a third stop is worded as the statement that this is the place."""


def admit_repetition(state: ParticipantState, view: ParticipantView) -> None:
    """Puts "that's the third time I'm saying it" in front of an order that was given twice at this place."""
    queue = state.speech.queue
    if not queue or queue[0].joined or view.speaking > 0.0:
        return
    breath = queue[: 1 + next((number for number, item in enumerate(queue[1:]) if not item.joined), len(queue))]
    if any(said.predicate in _ADMITTING and said.get("times") for item in breath for said in item.meaning):
        return
    for item in breath[:LONGEST_BREATH]:
        action = next(iter(_COUNTED & item.act.slots), None)
        if action is None or item.act.move is not DialogueMove.INSTRUCT:
            continue
        if times_given(state, view, item) >= IN_VAIN:
            tried = Proposition.of(Predicate.TRIED, action=action, times=IN_VAIN)
            wording = Wording(topic="said_before")
            admitted = intend(CommunicativeFunction.INFORM, tried, elided=("action", "times"), wording=wording)
            state.speech = state.speech.led_by(admitted)
            return


def own_up(state: ParticipantState, view: ParticipantView) -> None:
    """Puts "sorry, change of plan" in front of an order that contradicts the one before.

    An order that is already preceded by a word of why, or that follows a turn of the car, needs none. The first order
    after a described way that was left begins with "okay, from here".
    """
    queue = state.speech.queue
    if not queue or queue[0].joined or view.speaking > 0.0 or view.turning or _goes_another_way(state, queue[0]):
        return
    last = last_given(state)
    if last is not None and has_turned_since(view, last):
        return
    if not state.speech.has_just_spoken(view.time, JUST_ORDERED) or state.town.lanes[view.lane].in_junction:
        return
    former = _last_order(state)
    if former is not None and queue[0].act.move is DialogueMove.INSTRUCT and _contradicts(former, queue[0]):
        wording = Wording(topic="changed_mind")
        state.speech = state.speech.led_by(intend(CommunicativeFunction.INFORM, wording=wording))


_ADMITTING: Final = frozenset({Predicate.TRIED, Predicate.PASSED})
_EXPLAINS_WAY: Final = _ADMITTING | {Predicate.RIGHT_WAY, Predicate.BLOCKED}


def _goes_another_way(state: ParticipantState, first: Remark) -> bool:
    """Leads the first order after a described way no longer holds; returns whether it did, or needs no word of why."""
    if not state.guidance.rerouted:
        return False
    explained = any(said.predicate in _EXPLAINS_WAY for said in first.meaning)
    orders = first.act.move in _ORDERS and bool(_WAYS & first.act.slots)
    if not (explained or orders):
        return False
    state.guidance = replace(state.guidance, rerouted=False)
    described = any((item.wording.topic or "").startswith("way_") for item in state.speech.said)
    if described and orders and not explained and first.act.move is DialogueMove.INSTRUCT:
        wording = Wording(topic="from_here")
        state.speech = state.speech.led_by(intend(CommunicativeFunction.INFORM, wording=wording))
    return True


def _last_order(state: ParticipantState) -> Remark | None:
    """Returns the last order, unless something else that explains another one was said after it."""
    for item in reversed(state.speech.said):
        if item.act.move in _ORDERS and _WAYS & item.act.slots:
            return item
        if item.act.move is not DialogueMove.ACKNOWLEDGE:
            return None
    return None


def _contradicts(former: Remark, order: Remark) -> bool:
    """Returns whether two orders cannot both be meant: left and right, or another way and turning round."""
    actions = [next(iter(_WAYS & item.act.slots), None) for item in (former, order)]
    if None in actions:
        return False
    if former.wording.topic in ("further", "run_up") or former.wording.distance is not None:
        return False  # a little way to the place, before anything else
    other_side = {former.wording.direction, order.wording.direction} >= _SIDES
    turns_round = actions[0] is not actions[1] and ActionValue.U_TURN in actions
    return turns_round or (actions[0] is actions[1] is ActionValue.J_TURN and other_side)
