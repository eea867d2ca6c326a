"""Word errors of recognised utterances by speaker, noise in the car and class of word."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from rapidfuzz.distance import Levenshtein

from dorothie_gym.dialogue.recognition_errors import Loudness, WordClass, word_class
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.session.dialogue_channel import CabinState, signal_to_noise
from dorothie_gym.speech.spoken_form import spoken_words

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import MoveRecord
    from dorothie_gym.session.recording.session import Session

_Key = TypeVar("_Key", Role, Loudness, WordClass)


@dataclass
class WordErrors:
    """Errors in the words of utterances.

    Attributes:
        words: number of words that were spoken.
        substitutions: spoken words that the recogniser replaced by another one.
        deletions: spoken words that it left out.
        insertions: words that it added.
    """

    words: int = 0
    substitutions: int = 0
    deletions: int = 0
    insertions: int = 0

    @property
    def errors(self) -> int:
        """Number of errors."""
        return self.substitutions + self.deletions + self.insertions

    @property
    def rate(self) -> float:
        """Word error rate; NaN without words."""
        return self.errors / self.words if self.words else math.nan

    def __iadd__(self, other: WordErrors) -> WordErrors:
        self.words += other.words
        self.substitutions += other.substitutions
        self.deletions += other.deletions
        self.insertions += other.insertions
        return self

    def to_json(self) -> dict[str, object]:
        """Returns the counts and the rate in JSON types."""
        return {
            "words": self.words,
            "substitutions": self.substitutions,
            "deletions": self.deletions,
            "insertions": self.insertions,
            "word_error_rate": round(self.rate, 4) if self.words else None,
        }


def errors_of(said: str, heard: str) -> dict[WordClass, WordErrors]:
    """Returns the errors of a recognised text by the class of the spoken words, in their spoken forms.

    An inserted word counts for the class of the spoken word before it, or for that of the first one.

    Args:
        said: spoken text; a text without words has no errors that could be divided by classes.
        heard: transcript.
    """
    words, classes = _classified(said)
    found: dict[WordClass, WordErrors] = defaultdict(WordErrors)
    if not words:
        return found
    for each in classes:
        found[each].words += 1
    for edit in Levenshtein.editops(words, spoken_words(heard)):
        if edit.tag == "replace":
            found[classes[edit.src_pos]].substitutions += 1
        elif edit.tag == "delete":
            found[classes[edit.src_pos]].deletions += 1
        else:
            found[classes[max(edit.src_pos - 1, 0)]].insertions += 1
    return found


def _classified(text: str) -> tuple[list[str], list[WordClass]]:
    """Returns the spoken words of a text with their classes."""
    words: list[str] = []
    classes: list[WordClass] = []
    for written in text.split():
        spoken = spoken_words(written)
        words += spoken
        classes += [word_class(written)] * len(spoken)
    whole = spoken_words(text)
    return (words, classes) if words == whole else (whole, [word_class(word) for word in whole])


@dataclass
class WordErrorCounts:
    """Word errors of sessions.

    Attributes:
        speakers: errors by speaker.
        noises: errors by noise in the car.
        classes: errors by class of word.
    """

    speakers: dict[Role, WordErrors] = field(default_factory=lambda: defaultdict(WordErrors))
    noises: dict[Loudness, WordErrors] = field(default_factory=lambda: defaultdict(WordErrors))
    classes: dict[WordClass, WordErrors] = field(default_factory=lambda: defaultdict(WordErrors))

    @property
    def total(self) -> WordErrors:
        """All errors."""
        total = WordErrors()
        for errors in self.classes.values():
            total += errors
        return total

    def add(self, session: Session) -> None:
        """Counts the errors of a session's utterances of which a transcript was recorded."""
        for utterance in session.utterances():
            last = utterance.moves[-1]
            if last.recognised is None:
                continue
            for kind, errors in errors_of(utterance.text, last.recognised).items():
                self.classes[kind] += errors
                self.speakers[utterance.speaker] += errors
                self.noises[loudness_at(session, last)] += errors

    def to_json(self) -> dict[str, object]:
        """Returns the errors as JSON types: in total, and by speaker, noise and class of word."""
        return {
            **self.total.to_json(),
            "by_speaker": {role.value: errors.to_json() for role, errors in _sorted(self.speakers)},
            "by_noise": {noise.value: errors.to_json() for noise, errors in _sorted(self.noises)},
            "by_word_class": {kind.value: errors.to_json() for kind, errors in _sorted(self.classes)},
        }


def _sorted(rows: dict[_Key, WordErrors]) -> Iterator[tuple[_Key, WordErrors]]:
    return iter(sorted(rows.items(), key=lambda row: str(row[0])))


def loudness_at(session: Session, move: MoveRecord) -> Loudness:
    """Returns the noise in the car at the end of a move's utterance, from the recorded speed and weather."""
    return Loudness.of(signal_to_noise(cabin_at(session, move.frame)))


def cabin_at(session: Session, frame: int) -> CabinState:
    """Returns the noise sources in the car at a frame; unknown speed and weather make no noise."""
    rows = session.trajectory
    place = int(np.searchsorted(rows["frame"], frame, side="right")) - 1
    speed = abs(float(np.nan_to_num(rows["speed"][place]))) if place >= 0 else 0.0
    weather = session.scene.weather.at(frame)
    if weather is None or not len(weather):
        return CabinState(speed=speed)
    rain, wind = (
        min(max(float(np.nan_to_num(weather[str(name)][0])), 0.0), 100.0)
        for name in (WeatherParameter.PRECIPITATION, WeatherParameter.WIND_INTENSITY)
    )
    return CabinState(speed=min(speed, 199.0), rain=rain, wind=wind)
