"""Texts that fit the text spaces."""

from __future__ import annotations

import unicodedata

from dorothie_gym.spaces.limits import TEXT_CHARACTERS

_PLAIN = str.maketrans({"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "..."})
_KNOWN = frozenset(TEXT_CHARACTERS)


def plain_text(text: str, length: int) -> str:
    """The text in the characters of the text spaces, cut to a length: accents go, typographic marks become plain."""
    if text.isascii() and text.isprintable():
        return text[:length]
    spelt = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    return "".join(c for c in spelt if c in _KNOWN)[:length]
