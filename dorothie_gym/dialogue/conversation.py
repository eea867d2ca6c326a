"""Utterances, and their timing between the first word and delivery to the listeners."""

from __future__ import annotations

from dataclasses import dataclass, replace

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


_TICK = 1e-9
"""Slack for sums of decision periods [s]."""

_ORDER = {role: place for place, role in enumerate((Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD, Role.AGENT))}


class Conversation:
    """Utterances that have begun and are not yet heard to their end.

    A speaker has at most one utterance in the air; what it says meanwhile is appended to it. Speakers may overlap.
    """

    def __init__(self, words_per_second: float = WORDS_PER_SECOND, max_spans: int = 4) -> None:
        """Starts in silence.

        Args:
            words_per_second: speaking rate [words/s], positive.
            max_spans: most acts in one utterance, at least 1.

        Raises:
            ValueError: if an argument is out of its range.
        """
        if words_per_second <= 0:
            raise ValueError(f"words_per_second must be positive, not {words_per_second}")
        if max_spans < 1:
            raise ValueError(f"max_spans must be at least 1, not {max_spans}")
        self.words_per_second = words_per_second
        self.max_spans = max_spans
        self._air: dict[Role, Utterance] = {}

    def say(self, speaker: Role, span: Span, now: float) -> str | None:
        """Begins an utterance, or goes on with the one that the speaker has in the air.

        Args:
            speaker: who speaks.
            span: the words and their act.
            now: time of the decision [s].

        Returns:
            None if it was said, else the reason why not.
        """
        seconds = speech_seconds(span.text, self.words_per_second)
        current = self._air.get(speaker)
        if current is None:
            self._air[speaker] = Utterance(speaker, (span,), now, now + seconds)
            return None
        if len(current.spans) >= self.max_spans:
            return f"{speaker.value} has {self.max_spans} acts in this utterance already: wait until it is over"
        end = max(current.end, now) + seconds
        self._air[speaker] = replace(current, spans=(*current.spans, span), end=end)
        return None

    def deliver(self, now: float) -> list[Utterance]:
        """Takes the utterances whose words are over at `now` out of the air.

        Args:
            now: time [s].

        Returns:
            The utterances by their start; the participant first where two begin together.
        """
        heard = [utterance for utterance in self._air.values() if utterance.end <= now + _TICK]
        for utterance in heard:
            del self._air[utterance.speaker]
        return sorted(heard, key=lambda utterance: (utterance.start, _ORDER[utterance.speaker]))

    def speaking(self, speaker: Role, now: float) -> float:
        """Returns the seconds that `speaker` has still to speak at `now`; 0 if silent."""
        utterance = self._air.get(speaker)
        return max(0.0, utterance.end - now) if utterance is not None else 0.0

    def in_air(self, speaker: Role) -> Utterance | None:
        """Returns what `speaker` is saying, or None."""
        return self._air.get(speaker)
