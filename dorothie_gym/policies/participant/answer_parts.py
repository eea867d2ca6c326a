"""Parts of the answers of the participant: subject of a question, yes and no to it, and possible additions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.ontology.slots import ActionValue, Slot, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.participant.stories import story_remark
from dorothie_gym.policies.participant.target_hints import hint, is_in_mind
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    import numpy as np

    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.dialogue.propositions import Proposition
    from dorothie_gym.ontology.dialogue_acts import DialogueAct
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView


def checked(state: ParticipantState, act: DialogueAct, words: ParsedText) -> Proposition:
    """Returns the subject of a check or proposal of the car: a destination, an action, or the current destination."""
    place = act_builders.first_name(act.values(Slot.LANDMARK))
    street = next((value for value in act.values(Slot.STREET) if isinstance(value, StreetName)), None)
    wanted = next((value for value in act.values(Slot.ACTION) if isinstance(value, ActionValue)), None)
    if place is not None:
        return act_builders.destination(place, street)
    if wanted is not None or street is not None:
        return act_builders.action(wanted, words if wanted is not None else None, street=street)
    goal = state.task.goal
    return act_builders.destination(None if goal is None else goal.name)


def short(function: Function, content: Proposition) -> Remark:
    """Returns an answer without explicit content: "yes", "that's it"."""
    return intend(function, content, elided=act_builders.arguments_of(content))


def denied(content: Proposition) -> Remark:
    """Returns the answer that the content of a question is wrong or not wanted: "no"."""
    return short(Function.NEGATIVE_ANSWER, content.opposite)


def addition(state: ParticipantState, view: ParticipantView, rng: np.random.Generator) -> tuple[Remark, ...]:
    """Returns, with some probability, a hint or reason to add to an answer."""
    if rng.random() >= state.style.reasons or not state.task.announced:
        return ()  # the listener does not know yet what it would be about
    if state.guidance.guiding or not is_in_mind(state, view) or rng.random() < 0.5:
        return hint(state, view, rng)
    return tuple(item for item in story_remark(state, view, rng) if item.wording.topic != "reason")
