"""Requests that the Co-Wizard cannot carry out, or has not understood: answered with the reason and an offer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.propositions import Predicate, Proposition
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.dialogue.unmet_requests import unmet_request
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.policies.co_wizard.acknowledgement import sign_of_hearing
from dorothie_gym.policies.speech import intend

if TYPE_CHECKING:
    from collections.abc import Collection

    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.heard_utterance import HeardUtterance

_REQUESTING: Final = frozenset({DialogueMove.INSTRUCT, DialogueMove.QUERY_YN, DialogueMove.CLARIFY})
"""Moves by which something is asked for."""

_UNDECIDED: Final = frozenset({DialogueMove.IRRELEVANT, DialogueMove.ACKNOWLEDGE, DialogueMove.CONFUSE})
"""Moves that words without anything to drive for may be taken for: "turn the radio up"."""

_ASKING: Final = frozenset({DialogueMove.QUERY_YN, DialogueMove.QUERY_W, DialogueMove.CHECK})
"""Moves that want an answer."""


def refuse_unmet(state: CoWizardState, heard: HeardUtterance) -> frozenset[int]:
    """Answers the acts of an utterance that ask for what the car cannot do; returns their numbers.

    Args:
        state: working copy of the state.
        heard: the utterance.
    """
    refused = set[int]()
    for number, act in enumerate(heard.acts):
        asks = act.move in _REQUESTING or (heard.classified and act.move in _UNDECIDED)
        reason = unmet_request(heard.words_of(number).text) if asks else None
        if reason is not None:
            refused.add(number)
            if number == min(refused):
                _refuse(state, reason)
    return frozenset(refused)


def answer_in_any_case(state: CoWizardState, heard: HeardUtterance, planned: Collection[int]) -> None:
    """Answers a request that nothing has been said to, so that it is not met by silence.

    Where the acts are observed, a speaker who needs no answer is not given one.

    Args:
        state: working copy of the state.
        heard: the utterance.
        planned: numbers of the acts whose plan has been taken over.
    """
    if not heard.classified or planned or not state.speech.idle:
        return
    last = heard.acts[-1]
    if last.move in _ASKING:
        state.say(intend(Function.UNCERTAIN_ANSWER))
    elif last.move is DialogueMove.INSTRUCT and last.slots:
        state.say(sign_of_hearing("ordered"))
    elif last.move is DialogueMove.INSTRUCT and len(heard.acts) == 1:
        _refuse(state, "unknown")


def _refuse(state: CoWizardState, reason: str) -> None:
    impossible = Proposition.of(Predicate.POSSIBLE, negated=True)
    state.say(intend(Function.INFORM, impossible, wording=Wording(topic=f"unmet_{reason}")))
