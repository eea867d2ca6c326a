"""Intentions: communicative functions with propositions, which determine the dialogue move.

The functions are those of ISO 24617-2 (Bunt et al., 2012) that occur between passenger and car. Each has a path through
the decision tree of the annotators (`ontology.DECISION_TREE`), and thereby a move.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.propositions import Proposition
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove, walk
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import SlotValue


class CommunicativeFunction(enum.StrEnum):
    """Communicative function of a proposition, named as in ISO 24617-2 where possible."""

    # initiatives
    REQUEST = "request"
    """Asks for an action, directly or indirectly: "turn left", "you should be turning left"."""
    INFORM = "inform"
    """Makes an unsolicited remark."""
    PROPOSITIONAL_QUESTION = "propositional_question"
    """Asks whether the proposition is true."""
    SET_QUESTION = "set_question"
    """Asks for the argument that is left open, or for one of two: "before or after?"."""
    CHECK_QUESTION = "check_question"
    """Asks whether something inferred is right."""
    OFFER = "offer"
    """Proposes an action of the speaker and asks for consent: "shall I find another way?"."""
    FEEDBACK_ELICITATION = "feedback_elicitation"
    """Asks whether the other speaker is following: "did you get that?"."""
    # responses about the talk
    POSITIVE_FEEDBACK = "positive_feedback"
    """Shows that an utterance was received: "okay", "got it", also by repeating a part of it."""
    NEGATIVE_FEEDBACK = "negative_feedback"
    """Shows that a message has not arrived or was not understood."""
    # responses about the drive
    CORRECTION = "correction"
    """Amplifies or repairs what was said before: "I said turn around"."""
    ACCEPT = "accept"
    """Accepts a request: "will do", "KFC it is"."""
    CONFIRM = "confirm"
    """Confirms a check: "that's it"."""
    AFFIRMATIVE_ANSWER = "affirmative_answer"
    """Answers yes, or consents to an offer."""
    NEGATIVE_ANSWER = "negative_answer"
    """Answers no, denies a check, or declines an offer."""
    UNCERTAIN_ANSWER = "uncertain_answer"
    """Answers that the answer is unknown or unsure."""
    ANSWER = "answer"
    """Answers a set question."""
    # anything else
    OTHER = "other"
    """Has nothing to do with the drive."""

    @property
    def move(self) -> DialogueMove:
        """The dialogue move of the function."""
        return _MOVES[self]


_TALK, _DRIVE = "only about the talk", "about the drive"
_OPENS, _REACTS = "it opens something", "it reacts to something"

TREE_ANSWERS: Final[Mapping[CommunicativeFunction, tuple[str, ...]]] = MappingProxyType(
    {
        CommunicativeFunction.REQUEST: (_OPENS, "a command"),
        CommunicativeFunction.INFORM: (_OPENS, "a statement"),
        CommunicativeFunction.FEEDBACK_ELICITATION: (_OPENS, "a question", "whether the other side is following"),
        CommunicativeFunction.CHECK_QUESTION: (_OPENS, "a question", "whether something inferred is right"),
        CommunicativeFunction.PROPOSITIONAL_QUESTION: (
            _OPENS,
            "a question",
            "something the speaker cannot infer",
            "yes or no",
        ),
        CommunicativeFunction.OFFER: (_OPENS, "a question", "something the speaker cannot infer", "yes or no"),
        CommunicativeFunction.SET_QUESTION: (_OPENS, "a question", "something the speaker cannot infer", "any other"),
        CommunicativeFunction.POSITIVE_FEEDBACK: (_REACTS, _TALK, "it did"),
        CommunicativeFunction.NEGATIVE_FEEDBACK: (_REACTS, _TALK, "it did not"),
        CommunicativeFunction.CORRECTION: (_REACTS, _DRIVE, "amplifies or repairs it"),
        CommunicativeFunction.ACCEPT: (_REACTS, _DRIVE, "accepts or verifies it"),
        CommunicativeFunction.CONFIRM: (_REACTS, _DRIVE, "accepts or verifies it"),
        CommunicativeFunction.AFFIRMATIVE_ANSWER: (_REACTS, _DRIVE, "answers it", "yes"),
        CommunicativeFunction.NEGATIVE_ANSWER: (_REACTS, _DRIVE, "answers it", "no"),
        CommunicativeFunction.UNCERTAIN_ANSWER: (_REACTS, _DRIVE, "answers it", "unknown or unsure"),
        CommunicativeFunction.ANSWER: (_REACTS, _DRIVE, "answers it", "anything else"),
        CommunicativeFunction.OTHER: ("nothing to do with the drive",),
    }
)
"""Answers that lead from the root of the decision tree to the move of each function."""

_MOVES: Final = MappingProxyType({function: walk(answers) for function, answers in TREE_ANSWERS.items()})


@shared
@dataclass(frozen=True, kw_only=True)
class Intention:
    """Intention of a speaker in one span of an utterance.

    Attributes:
        function: communicative function.
        content: the proposition that is stated, asked, requested or answered; None if there is none, as in "okay".
        elided: arguments of the content that the other speaker knows, and that words and slots omit:
            the effect in an answer to "why did we stop?".
    """

    function: CommunicativeFunction
    content: Proposition | None = None
    elided: frozenset[str] = frozenset()

    @property
    def spoken(self) -> Proposition | None:
        """The content without elided arguments."""
        return None if self.content is None else self.content.without(*self.elided)

    @property
    def slots(self) -> frozenset[SlotValue]:
        """Slot values of the spoken content."""
        spoken = self.spoken
        return frozenset() if spoken is None else spoken.slots()

    @property
    def act(self) -> DialogueAct:
        """The dialogue act: the move by the decision tree, the slots by the spoken content."""
        return DialogueAct(self.function.move, self.slots)
