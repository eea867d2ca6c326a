"""Typed turns as spans with dialogue acts: those of the classifier, or as the speaker has corrected them."""

from __future__ import annotations

import enum
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from msgspec import structs

from dorothie_gym.dialogue.dialogue_act_classifier import guess_act, guess_spans
from dorothie_gym.errors import OntologyError
from dorothie_gym.lab.console.messages import Incoming, MessageError, Parse, Say, TypedSpan
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.spellings import parse_act
from dorothie_gym.session.spaces.fields import UTTERANCE_LENGTH, plain_text

if TYPE_CHECKING:
    from dorothie_gym.dialogue.street_titles import StreetTitles


class ActSource(enum.StrEnum):
    """Source of the act of a typed span."""

    CLASSIFIER = "classifier"
    """The speaker left the act of the classifier as it was."""
    SPEAKER = "speaker"
    """The speaker chose another act."""


@dataclass(frozen=True, kw_only=True)
class TypedAct:
    """Typed span with its act.

    Attributes:
        text: the words, at most `UTTERANCE_LENGTH` characters.
        act: act that is spoken.
        guess: act of the classifier for these words.
        audio: name of the recording of its turn; None for a typed one.
    """

    text: str
    act: DialogueAct
    guess: DialogueAct
    audio: str | None = None

    @property
    def source(self) -> ActSource:
        """Source of the act."""
        return ActSource.CLASSIFIER if self.act == self.guess else ActSource.SPEAKER

    def to_json(self) -> dict[str, object]:
        """Returns text, act and guess in JSON types, for the log of the seats."""
        guess = {"move": self.guess.move.label, "slots": self.guess.slot_labels()}
        audio = {} if self.audio is None else {"audio": self.audio}
        return {"text": self.text, **act_json(self.act), "source": self.source.value, "guess": guess, **audio}


def act_json(act: DialogueAct) -> dict[str, object]:
    """Returns the labels of an act: move and slots."""
    return {"move": act.move.label, "slots": act.slot_labels()}


def read_act(move: str, slots: dict[str, list[str]]) -> DialogueAct:
    """Returns the act of labels; raises `MessageError` for unknown ones."""
    try:
        return parse_act(move, slots)
    except OntologyError as error:
        raise MessageError(str(error)) from None


def with_session_names(message: Incoming, titles: StreetTitles) -> Incoming:
    """Returns a message with the session's names of streets in what was typed, in the place of those of the map."""
    if not titles or not isinstance(message, Say | Parse):
        return message
    if isinstance(message, Parse) or message.spans is None:
        return structs.replace(message, text=titles.heard(message.text))
    spans = [structs.replace(span, text=titles.heard(span.text)) for span in message.spans]
    return structs.replace(message, text=titles.heard(message.text), spans=spans)


def read_typed(text: str, after: DialogueMove | None) -> tuple[TypedAct, ...]:
    """Returns the spans of typed text with the acts that the classifier finds.

    Args:
        text: typed text; characters that utterances cannot hold are replaced or left out.
        after: last move of the other speaker.
    """
    spans = guess_spans(plain_text(text, len(text)), after)
    return tuple(
        TypedAct(text=part, act=act, guess=act)
        for k, span in enumerate(spans)
        for part in _parts(span.text)
        for act in (span.act if part == span.text else guess_act(part, after if k == 0 else None),)
    )


def typed_acts(message: Say, after: DialogueMove | None) -> tuple[TypedAct, ...]:
    """Returns the spans of a typed turn, with the acts of the speaker where they are given.

    Raises:
        MessageError: a label is unknown, or the typed text cannot be spoken.
    """
    found = read_typed(message.text, after) if message.spans is None else _confirmed(message.spans, after)
    if not found:
        raise MessageError("nothing was typed that can be spoken")
    return found if message.audio is None else tuple(replace(each, audio=message.audio) for each in found)


def _confirmed(spans: Sequence[TypedSpan], after: DialogueMove | None) -> tuple[TypedAct, ...]:
    text = " ".join(span.text for span in spans)
    proposed = {typed.text: typed.act for typed in read_typed(text, after)}
    found = []
    for k, span in enumerate(spans):
        act = read_act(span.move, span.slots)
        for part in _parts(plain_text(span.text, len(span.text))):
            guess = proposed.get(part) or guess_act(part, after if k == 0 else None)
            found.append(TypedAct(text=part, act=act, guess=guess))
    return tuple(found)


def _parts(text: str) -> list[str]:
    """Returns the text in parts of at most `UTTERANCE_LENGTH` characters."""
    return textwrap.wrap(text, UTTERANCE_LENGTH)
