"""Which slot values a text names in so many words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.encoders.byte_pairs import words
from dorothie_gym.ontology import LABELS

_PARTS: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|[a-z]+")


_WAYS: Final = ({"left"}, {"right"}, {"straight", "ahead", "across", "forward"})


def label_words(label: str) -> tuple[str, ...]:
    """Returns the words of a label in small letters: "BurgerKing" is "burger", "king"."""
    return tuple(part.lower() for part in _PARTS.findall(label))


def mentions(texts: Sequence[str]) -> NDArray[np.bool_]:
    """Returns which slot values each text names (n, 69): all words of the label stand in it, one after another."""
    table = np.zeros((len(texts), len(LABELS)), dtype=bool)
    for row, text in zip(table, texts, strict=True):
        row[list(_named(text))] = True
    return table


def ways(texts: Sequence[str]) -> NDArray[np.bool_]:
    """Returns which ways each text names (n, 3): left, right, straight on."""
    table = np.zeros((len(texts), len(_WAYS)), dtype=bool)
    for row, text in zip(table, texts, strict=True):
        said = set(words(text))
        row[:] = [bool(said & names) for names in _WAYS]
    return table


@lru_cache(maxsize=16384)
def _named(text: str) -> tuple[int, ...]:
    said = f" {' '.join(words(text))} "
    return tuple(k for k, spellings in enumerate(_spellings()) if any(f" {name} " in said for name in spellings))


@cache
def _spellings() -> tuple[tuple[str, str], ...]:
    names = (" ".join(label_words(value.label)) for value in LABELS)
    return tuple((name, name.replace(" ", "")) for name in names)
