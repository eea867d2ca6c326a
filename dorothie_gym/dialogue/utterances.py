"""What is said: spans of words that carry one act each, and utterances made of them."""

from __future__ import annotations

from dataclasses import dataclass

from dorothie_gym.ontology import DialogueAct, Role

WORDS_PER_SECOND = 2.7
"""Speaking rate [words/s]: ordinary talk runs at 2 to 3 words a second (design, Time)."""

SHORTEST_SPAN = 0.6
"""Least time a span takes [s]: longer than a decision period (0.5 s), so that a speaker can always go on."""


def speech_seconds(text: str, words_per_second: float = WORDS_PER_SECOND) -> float:
    """Returns how long `text` takes to say [s].

    Args:
        text: what is said.
        words_per_second: speaking rate [words/s], positive.

    Raises:
        ValueError: if `words_per_second` is not positive.
    """
    if words_per_second <= 0:
        raise ValueError(f"words_per_second must be positive, not {words_per_second}")
    return max(SHORTEST_SPAN, len(text.split()) / words_per_second)


@dataclass(frozen=True)
class Span:
    """A stretch of words with the one act it performs.

    Attributes:
        text: the words; never blank.
        act: the dialogue act (move and slot values).
    """

    text: str
    act: DialogueAct

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise ValueError("Span.text is blank: give the words, or let word_act find some")


@dataclass(frozen=True)
class Utterance:
    """What one speaker says in one breath.

    Attributes:
        speaker: who speaks.
        spans: the acts in order, at least one.
        start: when the first word begins [s of the session].
        end: when the last word is over [s of the session].
        exchange: id of the exchange that each span belongs to; empty until an `ExchangeTracker` has seen it.
    """

    speaker: Role
    spans: tuple[Span, ...]
    start: float
    end: float
    exchange: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not self.spans:
            raise ValueError("Utterance.spans is empty: an utterance has at least one span")
        if self.end < self.start:
            raise ValueError(f"Utterance.end ({self.end}) lies before its start ({self.start})")
        if self.exchange and len(self.exchange) != len(self.spans):
            raise ValueError(f"Utterance.exchange has {len(self.exchange)} ids for {len(self.spans)} spans")

    @property
    def text(self) -> str:
        """All the words, in order."""
        return " ".join(span.text for span in self.spans)

    @property
    def acts(self) -> tuple[DialogueAct, ...]:
        """The act of each span, in order."""
        return tuple(span.act for span in self.spans)
