"""Phonetic keys: words that are easily confused acoustically share a key."""

from __future__ import annotations

import functools
import re

# Spelling to sound, in order: silent letters, letter groups with one sound. A strong simplification of Metaphone
# (L. Philips, Computer Language 7(12), 1990), sufficient for confusions between English words.
_RULES: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), sound)
    for pattern, sound in (
        (r"[^a-z]", ""),
        (r"^(kn|gn|pn)", "n"),
        (r"^wr", "r"),
        (r"^wh", "w"),
        (r"^x", "s"),
        (r"mb$", "m"),
        (r"tch", "C"),
        (r"ch", "C"),
        (r"sh|(ss|t|s)(?=ion)", "S"),
        (r"ph", "f"),
        (r"th", "T"),
        (r"ght", "t"),
        (r"gh", ""),
        (r"dge", "j"),
        (r"g(?=[eiy])", "j"),
        (r"c(?=[eiy])", "s"),
        (r"ck|c|q", "k"),
        (r"x", "ks"),
        (r"z", "s"),
        (r"(.)\1", r"\1"),
        (r"(?<=[aeiou])h(?![aeiou])", ""),
        (r"e$", ""),
    )
)
# Sounds that differ only in voicing or place are confused most often (Miller and Nicely, JASA 27, 1955).
_CLASSES = str.maketrans("bdgvjzTCS", "ptkfSsfSS")
_VOWELS = re.compile(r"[aeiouyw]+")


@functools.lru_cache(maxsize=16384)
def sound_of(word: str) -> str:
    """Returns the phonetic key of a lower-case word, with all vowels as "a"."""
    for pattern, sound in _RULES:
        word = pattern.sub(sound, word)
    first, rest = word[:1], word[1:]
    return (_VOWELS.sub("a", first) + _VOWELS.sub("a", rest)).translate(_CLASSES)


def skeleton_of(word: str) -> str:
    """Returns the consonants of the phonetic key of a lower-case word; equal for "bates" and "baits"."""
    sound = sound_of(word)
    return sound[:1] + sound[1:].replace("a", "")
