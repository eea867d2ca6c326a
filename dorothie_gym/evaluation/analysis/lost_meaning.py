"""Misrecognised utterances whose meaning was lost, and whether the speakers repaired it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.dialogue.dialogue_act_classifier import guess_spans
from dorothie_gym.ontology.dialogue_acts import DialogueMove
from dorothie_gym.ontology.slots import SlotValue
from dorothie_gym.session.recording.events import UtteranceRecord
from dorothie_gym.speech.spoken_form import spoken_words
from dorothie_gym.speech.spoken_understanding import readable

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

REPAIRED_WITHIN: Final = 30.0
"""Time after an utterance within which its meaning is repaired [s]; the car drives about 250 m in this time."""

ASKS: Final = frozenset(
    {
        DialogueMove.CONFUSE,
        DialogueMove.CHECK,
        DialogueMove.ALIGN,
        DialogueMove.QUERY_W,
        DialogueMove.QUERY_YN,
    }
)
"""Moves by which a listener asks about an utterance."""

_EMPTY: Final = frozenset({"Unknown", "Queried"})


@dataclass(frozen=True, kw_only=True)
class LostMeaning:
    """Utterance that lost a detail in recognition.

    Attributes:
        utterance: the utterance.
        lost: annotated values of slots that the parser reads in the spoken words, with and without their marks and
            capitals, and not in the recognised words.
        wrong: values that it reads in the recognised words only.
        asked: whether the listener asked, as its next utterance, within `REPAIRED_WITHIN`.
        said_again: whether one of the speakers said a lost value within `REPAIRED_WITHIN`, in words that were
            recognised with it.
    """

    utterance: UtteranceRecord
    lost: frozenset[SlotValue]
    wrong: frozenset[SlotValue]
    asked: bool
    said_again: bool

    @property
    def is_repaired(self) -> bool:
        """Whether the listener asked, or the value was repeated."""
        return self.asked or self.said_again


def lost_meanings(session: Session) -> Iterator[LostMeaning]:
    """Yields, in order, the utterances that lost a detail in recognition.

    Both the spoken and the recognised words are read by the parser, and the speaker must have meant the result; so
    neither parser errors nor missing marks count.
    """
    said = sorted(session.utterances(), key=lambda each: each.end)
    for place, utterance in enumerate(said):
        heard = utterance.moves[0].recognised
        if heard is None:
            continue
        understood = _details(heard)
        lost = (_details(utterance.text) & _annotated(utterance)) - understood
        if lost:
            lost &= _details(readable(" ".join(spoken_words(utterance.text))))
        if not lost:
            continue
        after = [each for each in said[place + 1 :] if each.start <= utterance.end + REPAIRED_WITHIN]
        yield LostMeaning(
            utterance=utterance,
            lost=lost,
            wrong=understood - _details(utterance.text),
            asked=_asks(utterance, after),
            said_again=any(lost & _details(each.moves[0].recognised or each.text) for each in after),
        )


def _annotated(utterance: UtteranceRecord) -> frozenset[SlotValue]:
    return frozenset(value for move in utterance.moves for value in move.act.slots)


def _asks(utterance: UtteranceRecord, after: Sequence[UtteranceRecord]) -> bool:
    later = (each for each in after if each.start >= utterance.end)  # an earlier start is no answer
    answer = next((each for each in later if each.speaker is not utterance.speaker), None)
    return answer is not None and any(move.act.move in ASKS for move in answer.moves)


def _details(text: str) -> frozenset[SlotValue]:
    return frozenset(value for span in guess_spans(text) for value in span.act.slots if value.label not in _EMPTY)
