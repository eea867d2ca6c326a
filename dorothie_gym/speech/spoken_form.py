"""Spoken and written form of words: "KFC, 25 km/h" is spoken "k f c twenty five kilometers an hour"."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from typing import Final

from dorothie_gym.dialogue.conversation import INAUDIBLE
from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.dialogue.numerals import cardinal, read_ordinal
from dorothie_gym.dialogue.numerals import ordinal as ordinal_word
from dorothie_gym.ontology.slots import Slot

_TOKEN: Final = re.compile(r"[A-Za-z][A-Za-z']*|\d+(?:st|nd|rd|th)\b|\d+|[.,?!;:\u2026]")
_MARKS: Final = {"!": ".", ";": ",", ":": ",", "\u2026": "."}
_TYPOGRAPHY: Final = str.maketrans({"\u2019": "'", "\u2018": "'"})
_VOWELS: Final = re.compile(r"[aeiouy]", re.IGNORECASE)
_ABBREVIATED: Final = re.compile(r"\b(Mr|Mrs|Ms|Dr|St)\.")
_UNITS: Final = re.compile(r"\b(\d+) ?(km/h|kmh|kph|mph|km|m)\b")
_ABBREVIATIONS: Final[Mapping[str, str]] = {
    "Mr": "mister", "Mrs": "missus", "Ms": "miss", "Dr": "doctor", "St": "saint",
    "km/h": "kilometers an hour", "kmh": "kilometers an hour", "kph": "kilometers an hour", "mph": "miles an hour",
    "km": "kilometers", "m": "meters",
}  # fmt: skip

PUNCTUATION: Final = frozenset(".,?")
"""Punctuation marks that a reading of recognised words distinguishes."""


def spoken_words(text: str) -> list[str]:
    """Returns the words of a text as they are spoken, in lower case: numbers in words, initials as single letters."""
    return [token for token in spoken_tokens(text) if token not in PUNCTUATION]


def spoken_tokens(text: str) -> list[str]:
    """Returns the spoken words of a text with its punctuation marks, reduced to ".", "," and "?", as own tokens."""
    text = text.translate(_TYPOGRAPHY)
    text = _ABBREVIATED.sub(lambda found: _ABBREVIATIONS[found[1]], text)
    text = _UNITS.sub(lambda found: f"{found[1]} {_ABBREVIATIONS[found[2]]}", text)
    tokens: list[str] = []
    for token in _TOKEN.findall(text):
        if token[0].isdigit():
            tokens += _number_words(token)
        elif token[0].isalpha():
            tokens += _word(token)
        else:
            mark = _MARKS.get(token, token)
            if tokens and tokens[-1] not in PUNCTUATION:
                tokens.append(mark)
    return tokens


def _word(token: str) -> list[str]:
    word = token.strip("'") if token.lower() not in _CLIPPED else token
    if 1 < len(word) < 6 and word.isupper() and not _VOWELS.search(word):
        return list(word.lower())  # KFC, GPS
    return [word.lower()] if word else []


_CLIPPED: Final = frozenset({"'em", "'cause"})


def _number_words(token: str) -> list[str]:
    if not token.isdecimal():
        number = read_ordinal(token)
        return [ordinal_word(number)] if number is not None else []
    number = int(token) if len(token) < 4 else None
    words = cardinal(number) if number is not None else " ".join(cardinal(int(digit)) for digit in token)
    return words.replace("-", " ").split()


def written_form(tokens: Sequence[str]) -> str:
    """Returns spoken tokens as a text: names in their written form, "I" as a capital, marks after their words."""
    forms, longest = _written_names()
    parts: list[str] = []
    place = 0
    while place < len(tokens):
        token = tokens[place]
        if token in PUNCTUATION:
            if parts and (parts[-1] != INAUDIBLE or token == "?"):
                parts[-1] += token
            place += 1
            continue
        for length in range(min(longest, len(tokens) - place), 0, -1):
            written = forms.get(tuple(tokens[place : place + length]))
            if written is not None:
                parts.append(written)
                place += length
                break
        else:
            parts.append("I" + token[1:] if token == "i" or token.startswith("i'") else token)
            place += 1
    return " ".join(parts)


@functools.cache
def _written_names() -> tuple[Mapping[tuple[str, ...], str], int]:
    """Returns the written form of names by their spoken words, and the maximum number of words of a name."""
    found: dict[tuple[str, ...], str] = {}
    for value, forms in load_lexicon().phrases.items():
        if value.slot not in (Slot.LANDMARK, Slot.STREET):
            continue
        for phrase in (*forms["say"], *forms.get("also", ())):
            name = " ".join(word for word in phrase.split() if not word[0].islower())
            words = tuple(spoken_words(name))
            if words:
                found.setdefault(words, name)
    return found, max(map(len, found))
