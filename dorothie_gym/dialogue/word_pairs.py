"""Pairs of neighbouring words in the talk files of the package, by which a mishearing stands out."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Sequence

from dorothie_gym.dialogue.entity_recognition import find_names
from dorothie_gym.dialogue.lexicon import split_words
from dorothie_gym.dialogue.phrases import read_talk_files

_MARKUP = re.compile(r"^==.*$|#.*$|^<[^>]*>\s*=|[{<][^}>]*[}>]", re.MULTILINE)
"""What is not spoken in a file of the grammar: titles of sections, comments, and names of phrases and gaps."""

_ALTERNATIVES = re.compile(r"[|\n]")


def words_of_grammar(text: str) -> str:
    """Returns a file of the grammar without its labels, which nobody says."""
    return _MARKUP.sub(" ", text)


def unusual_pairs(text: str) -> int:
    """Returns the number of pairs of neighbouring words of a text that no phrase of the talk files has."""
    words = _masked(text)
    known = _known_pairs()
    return sum(pair not in known for pair in itertools.pairwise(words))


@functools.cache
def _known_pairs() -> frozenset[tuple[str, str]]:
    texts = (words_of_grammar(text) for text in read_talk_files().values())
    phrases = {phrase.strip() for text in texts for phrase in _ALTERNATIVES.split(text)} - {""}
    return frozenset(pair for phrase in phrases for pair in itertools.pairwise(_masked(phrase)))


def _masked(text: str) -> Sequence[str]:
    """Returns the words with the edges of the text, without marks, and with names masked."""
    words = [word for word in split_words(text) if word not in (",", "?")]
    return ["", *find_names(words)[1], ""]
