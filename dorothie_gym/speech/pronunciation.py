"""Pronunciations of words for the recogniser, by CMU's dictionary and by the synthesiser."""

from __future__ import annotations

import functools
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

_VARIANT: Final = re.compile(r"\(\d+\)$")

_ARPABET: Final[Mapping[str, str]] = {
    "əɹ": "ER", "ɜɹ": "ER", "A": "EY", "I": "AY", "O": "OW", "Q": "OW", "W": "AW", "Y": "OY", "i": "IY", "u": "UW",
    "ɑ": "AA", "ɒ": "AA", "a": "AA", "æ": "AE", "ɔ": "AO", "ə": "AH", "ᵊ": "AH", "ɐ": "AH", "ɛ": "EH", "e": "EY",
    "ɜ": "ER", "ɪ": "IH", "ᵻ": "IH", "ʊ": "UH", "ʌ": "AH", "o": "OW", "b": "B", "d": "D", "f": "F", "ɡ": "G", "h": "HH",
    "j": "Y", "k": "K", "l": "L", "m": "M", "n": "N", "p": "P", "s": "S", "t": "T", "v": "V", "w": "W", "z": "Z",
    "ŋ": "NG", "ɹ": "R", "ɾ": "T", "T": "T", "ʃ": "SH", "ʒ": "ZH", "θ": "TH", "ð": "DH", "ʤ": "JH", "ʧ": "CH",
}  # fmt: skip
"""Phonemes of the dictionary (ARPAbet without stress) by the phonemes of the synthesiser."""

_SYMBOL: Final = re.compile("|".join(sorted(map(re.escape, _ARPABET), key=len, reverse=True)))


def to_arpabet(phonemes: str) -> str:
    """Returns phonemes of the synthesiser in ARPAbet, separated by spaces; marks of stress and length are left out."""
    return " ".join(_ARPABET[found] for found in _SYMBOL.findall(phonemes))


@functools.cache
def read_dictionary(path: Path) -> Mapping[str, tuple[str, ...]]:
    """Returns the pronunciations of a dictionary in CMU's format, "word PH ON EM ES" per line, by word."""
    found: dict[str, list[str]] = defaultdict(list)
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            word, _, phonemes = line.strip().partition(" ")
            found[_VARIANT.sub("", word)].append(phonemes)
    return {word: tuple(listed) for word, listed in found.items()}


def pronunciations(
    words: Iterable[str], dictionary: Mapping[str, Sequence[str]], phonemes: Callable[[str], str]
) -> dict[str, tuple[str, ...]]:
    """Returns the pronunciations of words in ARPAbet: those of a dictionary, and that of the synthesiser.

    Both are needed: the dictionary has variants of common words ("to", "the"), and the synthesiser knows names.

    Args:
        words: spoken words in lower case.
        dictionary: pronunciations by word.
        phonemes: phonemes of a text, as in `HibariSynthesizer.phonemes`.
    """
    found = {}
    for word in words:
        own = to_arpabet(phonemes(word.upper() if len(word) == 1 else word))
        listed = dict.fromkeys((*dictionary.get(word, ()), *([own] if own else [])))
        if listed:
            found[word] = tuple(listed)
    return found


def dictionary_text(words: Mapping[str, Sequence[str]]) -> str:
    """Returns pronunciations in the format of the recogniser: the variants of a word are numbered 2, 3, and so on."""
    lines = []
    for word in sorted(words):
        for number, phonemes in enumerate(words[word], start=1):
            lines.append(f"{word}{f'({number})' if number > 1 else ''} {phonemes}")
    return "\n".join(lines) + "\n"
