"""Which slot values a text names in so many words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.encoders.byte_pairs import words
from dorothie_gym.ontology import LABELS

_PARTS: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|[a-z]+")


def label_words(label: str) -> tuple[str, ...]:
    """Returns the words of a label in small letters: "BurgerKing" is "burger", "king"."""
    return tuple(part.lower() for part in _PARTS.findall(label))


def mentions(texts: Sequence[str]) -> NDArray[np.bool_]:
    """Returns which slot values each text names (n, 69): all words of the label stand in it, one after another."""
    spelt = [" ".join(label_words(value.label)) for value in LABELS]
    table = np.zeros((len(texts), len(LABELS)), dtype=bool)
    for row, text in zip(table, texts, strict=True):
        said = f" {' '.join(words(text))} "
        row[:] = [f" {name} " in said or f" {name.replace(' ', '')} " in said for name in spelt]
    return table
