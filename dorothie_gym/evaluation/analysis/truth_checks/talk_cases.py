"""Case of a check of the talk: a passage of a session, and whether it is as it should be."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import UtteranceRecord


class Case(NamedTuple):
    """Passage that a check has judged.

    Attributes:
        right: whether it has no fault.
        time: its start [s].
        words: what is said in it.
    """

    right: bool
    time: float
    words: str


def plain_words(text: str) -> str:
    """Returns a text without capitals and punctuation, for comparisons of wordings."""
    return " ".join(re.findall(r"[a-z0-9'-]+", text.lower()))


def judged(right: bool, *utterances: UtteranceRecord) -> Case:
    """Returns the case of a passage of one or more utterances."""
    return Case(right, utterances[0].start, " / ".join(said.text for said in utterances))
