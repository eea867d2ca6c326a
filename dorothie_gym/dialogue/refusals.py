"""Refusals and questions by their words: whether a driver asks, agrees or declines, with what reason and offer.

The reader is a closed list of patterns, so that a session is judged alike on every computer and by every reader of the
list. It is meant for short utterances of a driver, and reads text only: no acts, no propositions.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from dorothie_gym.ontology.slots import LandmarkName, StreetName


class Reason(enum.StrEnum):
    """Reason why a request cannot or must not be fulfilled."""

    NOT_THERE = "not_there"
    """The place or street does not exist in the town."""
    CLOSED = "closed"
    """Something blocks the street."""
    RULES = "rules"
    """The rules of the road forbid it."""
    UNSEEN = "unseen"
    """It cannot be seen or known from inside the car."""


_NOT: Final = r"(?:\bno\b|\bnot\b|n't\b|\bcannot\b|\bnever\b|\bnowhere\b|\bneither\b|\bunable\b|\bwithout\b)"

_REASONS: Final[Mapping[Reason, re.Pattern[str]]] = MappingProxyType(
    {
        Reason.NOT_THERE: re.compile(
            rf"{_NOT}[^.;!?]*\b(?:map|exists?|in (?:this |the )?town|around here|such (?:a )?(?:place|street))\b"
            r"|\b(?:map|town)\b[^.;!?]*\b(?:no|not|lacks|without|nowhere|n't)\b"
            r"|\bthere(?: is|'s| are)(?: no\b|n't| not\b)"
        ),
        Reason.CLOSED: re.compile(
            r"\b(?:closed|blocked|barrier|barricade|roadblock|road block|blocks|obstacles?|obstructed|dead end)\b"
        ),
        Reason.RULES: re.compile(
            r"\b(?:illegal|unlawful|against the (?:law|rules?)|rules? of the road|traffic (?:law|rules?)|forbidden"
            r"|prohibited|break the (?:law|rules?))\b"
            r"|(?:\bnot |n't )(?:be )?(?:allowed|legal|permitted|lawful)\b"
        ),
        Reason.UNSEEN: re.compile(
            r"(?:\bnot |n't |\bcannot |\bno way to |\bunable to |\bimpossible to )"
            r"(?:able to |be able to )?(?:see|know|tell|look|check|find out)\b|\bno idea\b|\bout of (?:my )?sight\b"
        ),
    }
)

_DECLINES: Final = re.compile(
    r"\b(?:cannot|unable|impossible|sorry|afraid|refuse|no idea|against)\b"
    r"|\b(?:can|won|don|isn|aren|doesn|didn|wouldn|couldn|mustn|shouldn|hasn|haven)'t\b"
    r"|\b(?:do|does|did|will|would|could|should|must|may|am|is|are|has|have) not\b|\bnowhere\b"
    r"|^no\b|\bthere(?:'s| is| are) no\b"
)

_OFFERS: Final = re.compile(
    r"\b(?:instead|alternatively|otherwise|rather|how about|what about|shall (?:i|we)|should (?:i|we)|do you want"
    r"|would you like|want me to|(?:i|we) (?:can|could) (?:take|drive|go|turn|stop|bring|keep|stay|look|show|offer))\b"
)

_ASKS: Final = re.compile(
    r"\?|^(?:(?:sorry|excuse me|okay|hm+|well|and|so)[, ]+)*(?:which|where|what|who|whose|how|do you|did you|is it"
    r"|are you|shall i|should i|can you tell|could you tell|would you)\b"
)

_AGREES: Final = re.compile(
    r"\b(?:yes|sure|of course|certainly|okay|ok|all right|alright|understood|i will|i'll|will do|right away|on my way"
    r"|no problem|gladly|absolutely|got it|with pleasure)\b"
)


def plain(text: str) -> str:
    """Returns a text in lower case, with plain apostrophes and single spaces."""
    return " ".join(text.replace("\u2019", "'").lower().split())


def declines(text: str) -> bool:
    """Returns whether an utterance declines a request."""
    return _DECLINES.search(plain(text)) is not None


def reasons_of(text: str) -> frozenset[Reason]:
    """Returns the reasons that an utterance states."""
    said = plain(text)
    return frozenset(reason for reason, pattern in _REASONS.items() if pattern.search(said))


def offers(text: str) -> bool:
    """Returns whether an utterance offers something else."""
    return _OFFERS.search(plain(text)) is not None


def asks(text: str) -> bool:
    """Returns whether an utterance asks something."""
    return _ASKS.search(plain(text)) is not None


def agrees(text: str) -> bool:
    """Returns whether an utterance promises to fulfil a request."""
    return _AGREES.search(plain(text)) is not None and not declines(text)


def consents(text: str) -> bool:
    """Returns whether an utterance begins with a promise, as in "Sure, I won't"; it may go on with a negation."""
    said = plain(text)
    promise, refusal = _AGREES.search(said), _DECLINES.search(said)
    return promise is not None and (refusal is None or promise.start() < refusal.start())


def says(text: str, word: str) -> bool:
    """Returns whether an utterance contains a word, or several in a row, in any spelling of case."""
    return re.search(rf"(?<!\w){re.escape(plain(word))}(?:'?s)?(?!\w)", plain(text)) is not None


_PLACE_WORDS: Final[Mapping[LandmarkName, tuple[str, ...]]] = MappingProxyType(
    {
        LandmarkName.BURGER_KING: ("burger king", "burgerking"),
        LandmarkName.COCO: ("coco",),
        LandmarkName.IKEA: ("ikea",),
        LandmarkName.KFC: ("kfc", "k f c"),
        LandmarkName.PANERA: ("panera",),
        LandmarkName.QDOBA: ("qdoba",),
        LandmarkName.SEVEN_ELEVEN: ("7-eleven", "seven eleven", "seveneleven", "7 eleven"),
        LandmarkName.SHELL: ("shell",),
        LandmarkName.HOUSE: ("house",),
        LandmarkName.PERSON: ("friend", "person"),
    }
)

STREETS: Final = tuple(name for name in StreetName if name not in (StreetName.UNKNOWN, StreetName.QUERIED))
"""Names of streets."""


def named_places(text: str) -> tuple[LandmarkName, ...]:
    """Returns the places that an utterance names, in the order of the ontology."""
    return tuple(name for name, words in _PLACE_WORDS.items() if any(says(text, word) for word in words))


def named_streets(text: str) -> tuple[StreetName, ...]:
    """Returns the streets that an utterance names, in the order of the ontology."""
    return tuple(name for name in STREETS if says(text, name.label))
