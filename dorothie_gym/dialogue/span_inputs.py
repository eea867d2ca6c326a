"""Inputs of the trained tagger of spans: features of each word of an utterance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dorothie_gym.dialogue.clause_moods import ClauseMood
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import ActionValue

MARKS: Final = ("", ",", ".", "?", "!", "other")
"""Marks behind a word."""

MOODS: Final = tuple(ClauseMood)

ACTIONS: Final = tuple(value for value in ActionValue if value.label not in ("Unknown", "Queried"))
"""Actions of the car, whose names in a span the tagger checks."""

SIGNS: Final = 2 * (1 + len(MOODS)) + 10 + len(ACTIONS)
"""Number of signs of a span: its first and last mood, each with "none", ten yes-or-no questions, and its actions."""

LANDMARK: Final = "#landmark"
STREET: Final = "#street"
CONTINUED: Final = "#+"
NUMBER: Final = "#number"
NO_WORD: Final = "-"
"""Mask of a token without letters and digits, such as a dash."""

MASKS: Final = (LANDMARK, STREET, CONTINUED, NUMBER, NO_WORD)


@dataclass(frozen=True, kw_only=True)
class SpanFeatures:
    """Features of an utterance, by word.

    Attributes:
        words: words in lower case without marks; names and numbers are masked.
        marks: the mark behind each word, as an index of `MARKS`.
        begins: whether a span of the rules begins at the word.
        moves: move of the rules' span.
        signs: signs of the rules' span, `SIGNS` zeros and ones.
        after: move of the other speaker before the utterance.
    """

    words: tuple[str, ...]
    marks: tuple[int, ...]
    begins: tuple[bool, ...]
    moves: tuple[DialogueMove, ...]
    signs: tuple[tuple[int, ...], ...]
    after: DialogueMove | None = None
