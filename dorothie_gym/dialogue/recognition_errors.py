"""Measured profile of recognition errors: dependence of their rate on speaker, noise in the car and class of word."""

from __future__ import annotations

import enum
import functools
import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from types import MappingProxyType
from typing import Final, Self

from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.phrases import read_talk_files
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import Slot
from dorothie_gym.support.copying import shared

PROFILE_FILE: Final = "recognition_errors.json"
"""Data file of the measured profile, written by `benchmarks/recognition_errors.py`."""

RARE: Final = 5
"""Words that occur at most this often in the phrases of the grammar are rare."""

MODERATE_BELOW: Final = 20.0
LOUD_BELOW: Final = 16.0
"""Ratios of speech to noise that divide the classes of noise [dB]: about 20 km/h and 45 km/h on a dry road."""


class Loudness(enum.StrEnum):
    """Class of noise in the car, by the ratio of speech to noise."""

    QUIET = "quiet"
    MODERATE = "moderate"
    LOUD = "loud"

    @classmethod
    def of(cls, ratio: float) -> Self:
        """Returns the class of a ratio of speech to noise [dB]."""
        return cls("loud" if ratio < LOUD_BELOW else "moderate" if ratio < MODERATE_BELOW else "quiet")


class WordClass(enum.StrEnum):
    """Class of a spoken word."""

    COMMON = "common"
    """Word that occurs more than `RARE` times in the phrases of the grammar, or a single letter."""
    RARE = "rare"
    """Other word that is not a name."""
    NAME = "name"
    """Word of the name of a landmark or street."""


@shared
@dataclass(frozen=True, kw_only=True)
class ErrorProfile:
    """Measured errors of a recogniser.

    Attributes:
        rate: word error rate over all words.
        substitutions: share of substitutions among the errors.
        deletions: share of deletions among the errors; the rest are insertions.
        speakers: error rates by speaker relative to `rate`; 1 for speakers that are not listed.
        noises: the same by noise in the car.
        word_classes: the same by class of word.
    """

    rate: float
    substitutions: float
    deletions: float
    speakers: Mapping[Role, float]
    noises: Mapping[Loudness, float]
    word_classes: Mapping[WordClass, float]

    def circumstances(self, speaker: Role, noise: Loudness) -> float:
        """Returns the error rate of a speaker in a noise relative to `rate`; assumes independent factors."""
        return self.speakers.get(speaker, 1.0) * self.noises.get(noise, 1.0)


@functools.cache
def measured_errors() -> ErrorProfile:
    """Returns the profile that the package ships."""
    text = resources.files("dorothie_gym.dialogue").joinpath("data", PROFILE_FILE).read_text(encoding="utf-8")
    data = json.loads(text)
    return ErrorProfile(
        rate=data["word_error_rate"],
        substitutions=data["substitutions"],
        deletions=data["deletions"],
        speakers=MappingProxyType({Role(name): relative for name, relative in data["speakers"].items()}),
        noises=MappingProxyType({Loudness(name): relative for name, relative in data["noises"].items()}),
        word_classes=MappingProxyType({WordClass(name): relative for name, relative in data["word_classes"].items()}),
    )


@functools.lru_cache(maxsize=8192)
def word_class(word: str) -> WordClass:
    """Returns the class of a word, which may carry punctuation."""
    parts = re.findall(r"[a-z']+", word.lower())
    if any(part in proper_words() for part in parts):
        return WordClass.NAME
    common = parts and all(part in _common_words() or len(part) == 1 for part in parts)
    return WordClass.COMMON if common else WordClass.RARE


@functools.cache
def proper_words() -> Mapping[str, str]:
    """Returns the words of proper names: lower case -> spelling."""
    return {
        word.lower(): word
        for value, forms in load_lexicon().phrases.items()
        if value.slot in (Slot.LANDMARK, Slot.STREET)
        for phrase in forms["say"]
        for word in phrase.split()
        if word[0].isupper() and len(word) > 2
    }


@functools.cache
def _common_words() -> frozenset[str]:
    """Returns the words that occur often in the phrases of the grammar, without names."""
    counts = Counter(re.findall(r"\b[a-z][a-z']+\b", " ".join(read_talk_files().values()).lower()))
    return frozenset(word for word, count in counts.items() if count > RARE) - set(proper_words())
