"""Spoken numbers: cardinals below 1000 and ordinals up to ninth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

CAR_LENGTH: Final = 4.5
"""Length of a car, as a measure of short distances [m]."""

_ONES = [
    "zero",
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
    "eleven",
    "twelve",
    "thirteen",
    "fourteen",
    "fifteen",
    "sixteen",
    "seventeen",
    "eighteen",
    "nineteen",
]
_TENS = ["zero", "ten", "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"]
_ORDINALS = ["zeroth", "first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth"]
_DIGIT_ORDINALS = {"1st": 1, "2nd": 2, "3rd": 3, "4th": 4, "5th": 5, "6th": 6, "7th": 7, "8th": 8, "9th": 9}
_UNITS = {word: number for number, word in enumerate(_ONES)}
_ROUND = {word: 10 * number for number, word in enumerate(_TENS) if number > 1}

NUMBER_WORDS = frozenset((*_ONES, *_ROUND, "hundred"))
"""Words that form cardinals."""

_OTHER_UNITS: Final = frozenset(
    {"second", "seconds", "minute", "minutes", "hour", "hours", "percent", "o'clock", "oclock", "am", "pm"}
)


def cardinal(number: int) -> str:
    """Returns the words for a whole number, e.g. 25 -> "twenty-five"; digits for 1000 and above.

    Raises:
        ValueError: if `number` is negative.
    """
    if number < 0:
        raise ValueError(f"number must not be negative, not {number}")
    if number < 20:
        return _ONES[number]
    if number < 100:
        tens, ones = divmod(number, 10)
        return _TENS[tens] + (f"-{_ONES[ones]}" if ones else "")
    if number < 1000:
        hundreds, rest = divmod(number, 100)
        return f"{_ONES[hundreds]} hundred" + (f" {cardinal(rest)}" if rest else "")
    return str(number)


def duration(seconds: float) -> str:
    """Returns the words for a time as people round it, e.g. 100 s -> "a minute and a half"; at most 25 % off.

    Raises:
        ValueError: if `seconds` is negative or not finite.
    """
    if not 0.0 <= seconds < float("inf"):
        raise ValueError(f"seconds must not be negative, but finite, not {seconds}")
    if seconds < 105.0:
        return next(words for limit, words in _SHORT_TIMES if seconds < limit)
    minutes = round(seconds / 60.0)
    return f"{cardinal(minutes)} minutes"


_SHORT_TIMES = (
    (12.0, "ten seconds"),
    (17.0, "fifteen seconds"),
    (25.0, "twenty seconds"),
    (38.0, "half a minute"),
    (52.0, "forty-five seconds"),
    (75.0, "a minute"),
    (105.0, "a minute and a half"),
)
"""Words for times below a limit [s]."""


def ordinal(number: int) -> str:
    """Returns the ordinal word, e.g. 2 -> "second"; 1 to 9.

    Raises:
        ValueError: if `number` is not within 1 to 9.
    """
    if not 1 <= number < len(_ORDINALS):
        raise ValueError(f"ordinal must be 1 to 9, not {number}")
    return _ORDINALS[number]


def read_ordinal(word: str) -> int | None:
    """Returns the number of an ordinal word ("next", "first", "2nd"), or None."""
    if word == "next":
        return 1
    if word in _DIGIT_ORDINALS:
        return _DIGIT_ORDINALS[word]
    return _ORDINALS.index(word) if word in _ORDINALS[1:] else None


def read_cardinals(words: Sequence[str]) -> list[int]:
    """Returns the numbers in a sequence of lower-case words, in order ("twenty five" -> 25, "30" -> 30)."""
    found: list[int] = []
    current: int | None = None
    for word in (*words, ""):
        value = _UNITS.get(word, _ROUND.get(word))
        if word.isdecimal() and len(word) < 6:
            value = int(word)
        if value is not None and current is not None and current % 10 == 0 and 0 < value < (current % 100 or 100):
            current += value
        elif word == "hundred" and current is not None and 0 < current < 10:
            current *= 100
        else:
            if current is not None:
                found.append(current)
            current = value
    return found


def may_be_speed(before: str, after: str) -> bool:
    """Returns whether a number without a unit may be a speed, by the words around it: not "by six", "six minutes"."""
    return before != "by" and after not in _OTHER_UNITS
