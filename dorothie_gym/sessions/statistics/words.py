"""Words of a text, as statistics count them."""

from __future__ import annotations

import re

_WORD = re.compile(r"[^\W_]+(?:['’\-][^\W_]+)*")


def words_of(text: str) -> tuple[str, ...]:
    """Returns the words of a text, case folded and without punctuation; "7-Eleven" and "don't" are one word each."""
    return tuple(_WORD.findall(text.casefold().replace("’", "'")))


def plain(text: str) -> str:
    """Returns a text as its words alone: two that differ in case or punctuation only are the same."""
    return " ".join(words_of(text))
