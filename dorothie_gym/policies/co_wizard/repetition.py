"""Orders that the participant repeats without success: the Co-Wizard remarks on them, and asks for another route."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.slots import ActionValue
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.speech import intend

if TYPE_CHECKING:
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView

REPEATED: Final = 3
"""Number of equal orders at which the Co-Wizard remarks on the repetition."""

MEMORY: Final = 120.0
"""Time within which orders count as repeated [s]."""

_COUNTED: Final = frozenset({ActionValue.U_TURN, ActionValue.LANE_SWITCH})


def note_order(state: CoWizardState, view: CoWizardView, action: ActionValue) -> None:
    """Records an order; remarks on one that was carried out twice before, and asks for another route.

    Orders that the car could not carry out yet do not count.

    Args:
        state: working copy of the state.
        view: observation.
        action: requested action.
    """
    if action not in _COUNTED:
        return
    done_at = state.commands.manoeuvred_at
    state.dialogue = state.dialogue.after_order(action, view.time, view.time - MEMORY, done_at=done_at)
    if sum(known is action for known, _ in state.dialogue.orders) < REPEATED:
        return
    state.dialogue = state.dialogue.with_orders_settled()
    tried = Proposition.of(Predicate.TRIED, action=action, times=REPEATED - 1)
    remark = intend(CommunicativeFunction.INFORM, tried, elided=("action", "times"), wording=Wording(topic="tried"))
    way = act_builders.action(ActionValue.QUERIED)
    question = intend(CommunicativeFunction.SET_QUESTION, way, wording=Wording(topic="another_way"), joined=True)
    state.say(remark, question)
