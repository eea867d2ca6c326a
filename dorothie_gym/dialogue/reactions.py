"""Reactions by their words: corrections of what the other speaker has said, and answers of few words."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from dorothie_gym.ontology.dialogue_acts import DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText

_OTHER: Final = (
    "other side",
    "the other side",
    "the one after",
    "the one before",
    "the other one",
    "other kerb",
    "wrong side",
    "after it",
    "before it",
    "it's the other",
    "that's the wrong",
    "nobody said",
    "who said",
    "who asked",
    "i never",
    "i think you mis",
    "you misunder",
    "you misheard",
    "you've got the wrong",
    "you got the wrong",
    "you've stopped",
    "you stopped",
    "that was you",
    "this isn't it",
    "that isn't",
    "this is not",
    "other way",
    "the other way ,",
    "wrong way",
    "not that",
    "not this",
    "not the",
)
_MEANT: Final = (
    "i said",
    "i meant",
    "i mean",
    "i asked",
    "i wanted",
    "i was wanting",
    "i told you",
    "that's not",
    "not what i",
    "i told",
    " we're after",
    " i want$",
    " we want$",
    " i wanted$",
    " we need$",
    " i'm after",
    "i never said",
)
_NOT_NAMED: Final = re.compile(
    r"#\w+ (?:, )?(?:\w+ , )?not (?:the |on |at |to )?#\w+"
    r"|, not (?:at|on|in|before|after|past|that|this|there|here|it|them)\b"
    r"|\b(?:left|right) (?:, )?not (?:the )?(?:left|right|#left|#ok)\b"
)
"""What is meant before what is not: "Bishop, not Beal"."""
DENIALS: Final = frozenset({"no", "nah", "nope", "not", "never", "wrong"})
"""Words that deny what has been said."""
_LONGEST_ANSWER: Final = 6
_NEGATIVE: Final = frozenset({"no", "not", "never", "cannot", "nothing", "neither", "nor", "hardly"})


def short_answer(parsed: ParsedText) -> DialogueMove | None:
    """Returns the answer that few words give which name nothing: "it certainly is", "only if it's safe"."""
    words = [word for word in parsed.masked.split() if word != ","]
    if parsed.values or parsed.plan.steps or parsed.question or len(words) > _LONGEST_ANSWER:
        return None
    denied = any(word in _NEGATIVE or word.endswith("n't") for word in words)
    return DialogueMove.REPLY_N if denied else DialogueMove.REPLY_Y


def insists(parsed: ParsedText) -> bool:
    """Returns whether a span says what has been said before."""
    return (
        not parsed.question
        and bool(parsed.plan.steps or parsed.values)
        and any(phrase in parsed.masked for phrase in ("i said", "i told you", "i asked", "like i said", "as i said"))
    )


def corrects(parsed: ParsedText) -> bool:
    """Returns whether a span sets right what the other speaker has announced: "no, I meant the second left"."""
    if parsed.question:
        return False
    if any(phrase in f"{parsed.masked}$" for phrase in _MEANT) or parsed.masked.startswith(_OTHER):
        return True
    if not (parsed.plan.steps or parsed.values) or parsed.masked.startswith(("no thanks", "no thank you")):
        return False
    words = parsed.masked.split()
    denied = not DENIALS.isdisjoint(words[:3]) or _NOT_NAMED.search(parsed.masked) is not None
    return denied or any(phrase in f"{parsed.masked}$" for phrase in _MEANT)
