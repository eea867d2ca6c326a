"""Wording of orders: remarks by which the participant requests an action, answers with it, or clarifies it."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.intentions import CommunicativeFunction
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import ActionValue, StreetName

FUNCTIONS: Final = MappingProxyType(
    {
        DialogueMove.INSTRUCT: CommunicativeFunction.REQUEST,
        DialogueMove.REPLY_W: CommunicativeFunction.ANSWER,
        DialogueMove.CLARIFY: CommunicativeFunction.CORRECTION,
    }
)
"""Communicative function of an order, by move."""


def of_place(topic: str, place: LandmarkName | None) -> str:
    """Returns the topic of a remark that calls a place "it"; another one for people, who are no "it"."""
    return f"{topic}_person" if place is LandmarkName.PERSON else topic


def order(
    move: DialogueMove,
    action: ActionValue,
    wording: Wording | None = None,
    *,
    street: StreetName | None = None,
    place: LandmarkName | None = None,
    urgent: bool = False,
) -> Remark:
    """Returns the remark that instructs the car to carry out an action.

    Args:
        move: an instruction, an answer to an open question, or a clarification.
        action: the action.
        wording: further particulars; direction and speed are part of the content.
        street: street of the action, or street to enter.
        place: place of the action.
        urgent: whether it may be said without leaving the car time to answer.

    Raises:
        KeyError: the move is not one of the three.
    """
    particulars = Wording() if wording is None else wording
    wanted = act_builders.action(
        action,
        direction=particulars.direction,
        street=street,
        place=place,
        speed=None if particulars.speed is None else round(particulars.speed),
    )
    return intend(FUNCTIONS[move], wanted, wording=particulars, urgent=urgent)
