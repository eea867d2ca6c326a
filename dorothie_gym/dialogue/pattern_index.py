"""Index of regular expressions by what must occur in a text that they match.

Lists of cues have dozens of patterns, of which a sentence matches one or none. Most need a certain word or a part of
one, such as "limit" in ``speed limit|what is the limit``. The index knows these parts, and names the few patterns that
a sentence can match at all; the others need not be tried.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, TypeAlias

_Parts: TypeAlias = "frozenset[str] | None"
"""Parts of words of which a match contains one; None if that is unknown."""

_TOKEN: Final = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]])*\]|\(\?(?:[:=!]|<[=!])|\{\d*,?\d*\}|.", re.DOTALL)
"""Tokens of a pattern: escapes, character classes, openings of groups, and repetitions beside single characters."""

_SPECIAL: Final = re.compile(r"\(\?(?![:=!]|<[=!])")
"""Openings of named groups, conditions and flags, which are not read."""

_LETTER: Final = re.compile(r"[a-z0-9#']")
_LEAST: Final = 2
"""Shortest part of a word that is looked for."""


class PatternIndex:
    """Index of patterns over texts of lower-case words between spaces."""

    def __init__(self, patterns: Sequence[re.Pattern[str] | None]) -> None:
        """Begins with the patterns, without flags; None stands for one that matches nothing."""
        parts = [frozenset[str]() if pattern is None else required_parts(pattern.pattern) for pattern in patterns]
        self._always = sum(1 << number for number, each in enumerate(parts) if each is None)
        self._with_part: dict[str, int] = {}
        for number, each in enumerate(parts):
            for part in each or ():
                self._with_part[part] = self._with_part.get(part, 0) | 1 << number
        self._longest = max(map(len, self._with_part), default=0)
        self._of_word = functools.lru_cache(maxsize=8192)(self._patterns_of)

    def possible(self, words: Iterable[str]) -> int:
        """Returns the patterns that a text can match, as the sum of 2 to the power of their numbers.

        Args:
            words: words of the text, without the spaces between them.
        """
        found = self._always
        for word in words:
            found |= self._of_word(word)
        return found

    def _patterns_of(self, word: str) -> int:
        found, end = 0, len(word)
        for begin in range(end - _LEAST + 1):
            for behind in range(begin + _LEAST, min(begin + self._longest, end) + 1):
                found |= self._with_part.get(word[begin:behind], 0)
        return found


def bits(number: int) -> Iterator[int]:
    """Yields the numbers of the bits of a number that are set, in ascending order."""
    while number:
        lowest = number & -number
        yield lowest.bit_length() - 1
        number ^= lowest


def required_parts(pattern: str) -> _Parts:
    """Returns parts of words of which every match of a pattern contains one; None if none were found.

    Args:
        pattern: regular expression without flags.
    """
    if _SPECIAL.search(pattern):
        return None
    tokens = _TOKEN.findall(pattern)
    found, end = _alternatives(tokens, 0)
    return found if end == len(tokens) else None


def _alternatives(tokens: Sequence[str], place: int) -> tuple[_Parts, int]:
    """Returns the parts of alternatives that begin at a token, and the token behind them: ")" or the end."""
    union: _Parts = frozenset()
    while True:
        found, place = _sequence(tokens, place)
        union = None if union is None or found is None else union | found
        if place == len(tokens) or tokens[place] == ")":
            return union, place
        place += 1


def _sequence(tokens: Sequence[str], place: int) -> tuple[_Parts, int]:
    """Returns the parts of a sequence, and the token behind it: "|", ")" or the end."""
    found: list[frozenset[str]] = []
    run = ""
    while place < len(tokens) and tokens[place] not in ("|", ")"):
        token = tokens[place]
        group: _Parts = None
        if token.startswith("("):
            group, place = _alternatives(tokens, place + 1)
            group = None if token not in ("(", "(?:", "(?=") else group
        place += 1
        optional = place < len(tokens) and (tokens[place] in ("?", "*") or tokens[place].startswith("{"))
        letter = _LETTER.fullmatch(token) is not None
        if letter and not optional:
            run += token
        if not letter or optional or tokens[place : place + 1] == ["+"]:
            found.append(frozenset({run}))
            run = ""
        if group is not None and not optional:
            found.append(group)
        if optional or tokens[place : place + 1] == ["+"]:
            place += 1
            place += tokens[place : place + 1] == ["?"]
    found.append(frozenset({run}))
    return max((parts for parts in found if _is_useful(parts)), key=_selectivity, default=None), place


def _is_useful(parts: frozenset[str]) -> bool:
    return bool(parts) and min(map(len, parts)) >= _LEAST


def _selectivity(parts: frozenset[str]) -> tuple[int, int]:
    """Returns how much parts exclude: long parts first, then few."""
    return min(map(len, parts)), -len(parts)
