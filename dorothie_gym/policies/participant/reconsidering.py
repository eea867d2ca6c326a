"""Orders that contradict the last one: the participant says that it has changed its mind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.realization_context import Direction, Wording
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies.speech import intend

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView
    from dorothie_gym.policies.speech import Remark

JUST_ORDERED: Final = 9.0
"""Time after an order within which one that contradicts it needs a word of why [s]."""

_ORDERS: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.REPLY_W})
_SIDES: Final = frozenset({Direction.LEFT, Direction.RIGHT})
_TURNS: Final = frozenset({ActionValue.J_TURN, ActionValue.U_TURN})


def own_up(state: ParticipantState, view: ParticipantView) -> None:
    """Puts "sorry, change of plan" in front of an order that contradicts the one before.

    An order that is already preceded by a word of why, or that follows a turn of the car, needs none.
    """
    queue = state.speech.queue
    if not queue or queue[0].joined or view.speaking > 0.0 or view.turning:
        return
    if not state.speech.has_just_spoken(view.time, JUST_ORDERED) or state.town.lanes[view.lane].in_junction:
        return
    former = _last_order(state)
    if former is not None and queue[0].act.move is DialogueMove.INSTRUCT and _contradicts(former, queue[0]):
        wording = Wording(topic="changed_mind")
        state.speech = state.speech.led_by(intend(CommunicativeFunction.INFORM, wording=wording))


def _last_order(state: ParticipantState) -> Remark | None:
    """Returns the last order, unless something else that explains another one was said after it."""
    for item in reversed(state.speech.said):
        if item.act.move in _ORDERS and _TURNS & item.act.slots:
            return item
        if item.act.move is not DialogueMove.ACKNOWLEDGE:
            return None
    return None


def _contradicts(former: Remark, order: Remark) -> bool:
    """Returns whether two orders cannot both be meant: left and right, or a turn and turning round."""
    actions = [next(iter(_TURNS & item.act.slots), None) for item in (former, order)]
    if None in actions:
        return False
    other_side = {former.wording.direction, order.wording.direction} >= _SIDES
    return actions[0] is not actions[1] or (actions[0] is ActionValue.J_TURN and other_side)
