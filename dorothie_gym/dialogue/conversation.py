"""Utterances and their timing: in progress while they are spoken, delivered after the last word."""

from __future__ import annotations

from dataclasses import dataclass, replace

from dorothie_gym.dialogue.propositions import Proposition
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.roles import Role
from dorothie_gym.support.copying import shared

WORDS_PER_SECOND = 2.7
"""Speaking rate [words/s]; ordinary speech has 2 to 3 words per second (design, Time)."""

USUAL_WORD_ERROR_RATE = 0.047
"""Word error rate of sessions by default: that of spoken sessions (`recognition_errors.measured_errors`).

Systems of the time of the paper, and professional transcribers, have 5.1 % on telephone conversations of strangers
(Switchboard; Xiong et al., ICASSP 2018; Saon et al., Interspeech 2017).
"""

SHORTEST_SPAN = 0.6
"""Shortest duration of a span [s]; longer than a decision period (0.5 s), so that a speaker can continue."""


INAUDIBLE = "..."
"""Sign in a transcript for words that were not understood, and transcript of speech without any recognised word."""


def is_partly_inaudible(text: str) -> bool:
    """Returns whether a transcript has a sign for words that were not understood."""
    return any(word.startswith(INAUDIBLE) for word in text.split())


_ASKING_TO_REPEAT = frozenset(
    {"again", "pardon", "sorry", "huh", "what", "hear", "catch", "understand", "follow", "repeat", "missed", "excuse"}
)
_LONGEST_REQUEST = 6  # words of a request to repeat


def resembles_request_to_repeat(text: str) -> bool:
    """Returns whether words without sense may be those of a listener who has not understood: "calm again?"."""
    words = [word.strip(".,?!'").lower() for word in text.split()]
    return len(words) <= _LONGEST_REQUEST and not _ASKING_TO_REPEAT.isdisjoint(words)


def speech_seconds(text: str, words_per_second: float = WORDS_PER_SECOND) -> float:
    """Returns the duration of a spoken text [s].

    Args:
        text: spoken words.
        words_per_second: speaking rate [words/s], positive.

    Raises:
        ValueError: if `words_per_second` is not positive.
    """
    if words_per_second <= 0:
        raise ValueError(f"words_per_second must be positive, not {words_per_second}")
    return max(SHORTEST_SPAN, len(text.split()) / words_per_second)


@shared
@dataclass(frozen=True)
class Span:
    """Segment of an utterance with one dialogue act.

    Attributes:
        text: words of the span; never blank.
        act: the dialogue act (move and slot values).
        meaning: propositions that the speaker states, asks or requests; empty if they are unknown.
    """

    text: str
    act: DialogueAct
    meaning: tuple[Proposition, ...] = ()

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise ValueError("Span.text is blank: pass the words, or generate them with word_act")


@shared
@dataclass(frozen=True)
class Utterance:
    """Utterance of one speaker.

    Attributes:
        speaker: role of the speaker.
        spans: spans in order, at least one.
        start: start of the first word [s of the session].
        end: end of the last word [s of the session].
        exchange: exchange id of each span; empty until an `ExchangeTracker` has processed the utterance.
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
        """Text of all spans, joined by spaces."""
        return " ".join(span.text for span in self.spans)

    @property
    def acts(self) -> tuple[DialogueAct, ...]:
        """Dialogue act of each span, in order."""
        return tuple(span.act for span in self.spans)


def _ended(utterance: Utterance) -> Utterance:
    """Returns the utterance with a full stop for the comma of a speaker who meant to continue."""
    last = utterance.spans[-1]
    if not last.text.endswith(",") or not last.text.strip(","):
        return utterance
    text = last.text.rstrip(",") + ("." if utterance.text[0].isupper() else "")
    return replace(utterance, spans=(*utterance.spans[:-1], replace(last, text=text)))


_END_TOLERANCE = 1e-9
"""Tolerance for the rounding of summed decision periods [s]."""

_ORDER = {role: place for place, role in enumerate((Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD, Role.AGENT))}


class Conversation:
    """Buffer of utterances that have started and are not yet over.

    A speaker has at most one utterance in progress; further spans are appended to it. Speakers may overlap.
    """

    def __init__(self, words_per_second: float = WORDS_PER_SECOND, max_spans: int = 4) -> None:
        """Creates an empty buffer.

        Args:
            words_per_second: speaking rate [words/s], positive.
            max_spans: maximum number of spans in one utterance, at least 1.

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

    def say(
        self, speaker: Role, span: Span, now: float, onset: float = 0.0, pace: float = 1.0, seconds: float | None = None
    ) -> str | None:
        """Starts an utterance, or appends a span to the current one of the speaker.

        Args:
            speaker: role of the speaker.
            span: words and dialogue act.
            now: time of the decision [s].
            onset: time until the first word of an utterance that starts [s].
            pace: speaking rate relative to that of the conversation.
            seconds: duration of the span [s]; None estimates it from the words.

        Returns:
            None on success, otherwise the reason for the refusal.
        """
        if seconds is None:
            seconds = speech_seconds(span.text, pace * self.words_per_second)
        current = self._air.get(speaker)
        if current is None:
            self._air[speaker] = Utterance(speaker, (span,), now + onset, now + onset + seconds)
            return None
        if len(current.spans) >= self.max_spans:
            return f"{speaker.value} has {self.max_spans} acts in this utterance already: wait until it is over"
        end = max(current.end, now) + seconds
        self._air[speaker] = replace(current, spans=(*current.spans, span), end=end)
        return None

    def has_room(self, speaker: Role) -> bool:
        """Returns whether a speaker can begin an utterance, or a further span of the current one."""
        current = self._air.get(speaker)
        return current is None or len(current.spans) < self.max_spans

    def deliver(self, now: float) -> list[Utterance]:
        """Removes and returns the utterances that have ended at `now`.

        Args:
            now: time [s].

        Returns:
            Utterances sorted by start; the participant comes first among equal starts.
        """
        heard = [utterance for utterance in self._air.values() if utterance.end <= now + _END_TOLERANCE]
        if not heard:
            return heard
        for utterance in heard:
            del self._air[utterance.speaker]
        return sorted(map(_ended, heard), key=lambda utterance: (utterance.start, _ORDER[utterance.speaker]))

    def speaking(self, speaker: Role, now: float) -> float:
        """Returns the remaining speaking time of `speaker` at `now` [s]; 0 when silent."""
        utterance = self._air.get(speaker)
        return max(0.0, utterance.end - now) if utterance is not None else 0.0

    def in_air(self, speaker: Role) -> Utterance | None:
        """Returns the current utterance of `speaker`, or None."""
        return self._air.get(speaker)
