"""Names that a map has for its streets, in the place of those of the vocabulary.

The vocabulary of streets is closed (`StreetName`). In a town whose map names its streets, each name of the vocabulary
stands for one of the map: sessions, models and labels go on to use "Beal", and people read, hear and type "Rue de
l'Église". Texts pass through `shown` on the way to people, and through `heard` on the way back.
"""

from __future__ import annotations

import functools
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import Final

from dorothie_gym.dialogue.lexicon import load_lexicon
from dorothie_gym.ontology.slots import StreetName
from dorothie_gym.support.copying import shared

_KINDS: Final = (
    ("street", "st", "saint", "str", "straße", "strasse"), ("avenue", "ave", "av"), ("road", "rd"), ("drive", "dr"),
    ("boulevard", "blvd"), ("lane", "ln"), ("court", "ct"), ("place", "pl"), ("square", "sq"), ("highway", "hwy"),
    ("parkway", "pkwy"), ("terrace", "ter"), ("circle", "cir"), ("north", "n"), ("south", "s"), ("east", "e"),
    ("west", "w"), ("junior", "jr"), ("mount", "mt"), ("fort", "ft"),
)  # fmt: skip
"""Words of names of streets, each with the other ways to write it."""

_SPELLINGS: Final = {word: group for group in _KINDS for word in group}
_LEFT_OUT: Final = {"street", "st", "avenue", "ave", "road", "rd", "drive", "dr", "boulevard", "blvd", "lane", "ln"}
"""Kinds of streets that people leave out: "turn onto Main"."""

_TOO_COMMON: Final = frozenset((
    "back", "bridge", "bus", "car", "center", "centre", "city", "corner", "country", "east", "fast", "fifth",
    "first", "fourth", "front", "high", "house", "left", "lights", "long", "main", "market", "new", "next",
    "north", "old", "park", "parking", "right", "school", "second", "seventh", "side", "sixth", "slow", "south",
    "speed", "station", "stop", "the", "third", "town", "turn", "university", "upper", "west",
))  # fmt: skip
"""Words that mean something else behind a preposition."""

_BEFORE: Final = "".join(
    rf"|(?<=\b{word} )"
    for word in ("on", "onto", "into", "to", "down", "up", "along", "off", "via", "take", "follow", "at", "of", "is")
)[1:]
"""Words behind which a name may lack its kind."""

_KIND_BEHIND: Final = r"(?:\s+(?:street|avenue|road|boulevard|drive)\b)?"
"""Kind of street behind a name of the vocabulary."""

_SHORT: Final = 7
"""Length up to which a title of one word may be an ordinary word: "Loop", "Park" [characters]."""

_LETTERS: Final = {
    "ß": "(?:ß|ss)", "ø": "[øo]", "ł": "[łl]", "æ": "(?:æ|ae)", "œ": "(?:œ|oe)", "đ": "[đd]", "ı": "[ıi]",
    "ä": "(?:ä|ae?)", "ö": "(?:ö|oe?)", "ü": "(?:ü|ue?)",
}  # fmt: skip
"""Letters for which people type others than their base."""

_MARKS: Final = "'\u2019\u2018`\u00b4"
_GAP: Final = r"[\s\-\u2013/]+"


@shared
class StreetTitles:
    """Names of a map for the streets of a session; without any, texts stay as they are."""

    def __init__(self, names: Iterable[StreetName] = (), titles: Sequence[str] = ()) -> None:
        """Gives names of the vocabulary the titles of their streets.

        Args:
            names: name of each street in the session; streets beyond the vocabulary are `StreetName.UNKNOWN`.
            titles: name of each street in the map; empty where it has none.
        """
        named = zip(names, titles, strict=False)
        self._titles = tuple(titles)
        self._of: dict[StreetName, str] = {
            name: title for name, title in named if title and name is not StreetName.UNKNOWN
        }

    def __bool__(self) -> bool:
        """Returns whether a name of the vocabulary stands for another one."""
        return bool(self._of)

    def labels(self, names: Sequence[str]) -> list[str]:
        """Returns what maps and boards call each street of the town: its title, or else its name in the session.

        Args:
            names: labels of the names of all streets of the town, in its order.
        """
        return [title or name for title, name in zip_longest(self._titles[: len(names)], names, fillvalue="")]

    def shown(self, text: str) -> str:
        """Returns a text as people read it: with titles instead of names of the vocabulary."""
        if not self._of or not text:
            return text
        pattern, of_form = self._names_said
        return pattern.sub(lambda match: self._of[of_form[match[1].lower()]], text)

    def heard(self, text: str) -> str:
        """Returns a text of people as sessions read it: with names of the vocabulary instead of titles.

        Titles are found without regard to case, accents and usual abbreviations.
        """
        if not self._of or not text:
            return text
        pattern, names = self._titles_typed
        return pattern.sub(lambda match: names[(match.lastindex or 1) - 1].label, text)

    # made when a text first needs them

    @functools.cached_property
    def _names_said(self) -> tuple[re.Pattern[str], dict[str, StreetName]]:
        """Pattern of the names of the vocabulary that stand for titles, and the name of each spelling."""
        of_form: dict[str, StreetName] = {form: name for name in self._of for form in _forms(name)}
        forms = "|".join(re.escape(form) for form in sorted(of_form, key=len, reverse=True))
        return re.compile(rf"(?<![\w'])({forms})(?!\w){_KIND_BEHIND}", re.IGNORECASE), of_form

    @functools.cached_property
    def _titles_typed(self) -> tuple[re.Pattern[str], list[StreetName]]:
        """Pattern with a group for each title, and the names of the groups; whole titles come before shortened ones."""
        ordered = sorted(self._of.items(), key=lambda item: len(item[1]), reverse=True)
        groups = [(_whole(title), name) for name, title in ordered]
        short = {name: _without_kind(title) for name, title in ordered}
        alone = Counter(text.lower() for text in short.values())
        groups += [
            (f"(?:{_BEFORE}){_pattern(text)}", name)
            for name, text in short.items()
            if text and alone[text.lower()] == 1
        ]
        found = "|".join(rf"(?<!\w)({pattern})(?!\w)" for pattern, _ in groups)
        return re.compile(found, re.IGNORECASE), [name for _, name in groups]


NO_TITLES: Final = StreetTitles()
"""Titles of towns whose streets have none."""


@functools.lru_cache(maxsize=64)
def _forms(name: StreetName) -> tuple[str, ...]:
    """Returns the spellings of a name of the vocabulary, in lower case."""
    phrases = load_lexicon().phrases[name]
    return tuple(dict.fromkeys(form.lower() for form in (name.label, *phrases["say"], *phrases.get("hear", ()))))


def _without_kind(title: str) -> str:
    """Returns a title without its kind of street; empty if what is left may mean something else."""
    first, _, kind = title.rpartition(" ")
    rest = first if kind.lower().strip(".") in _LEFT_OUT else ""
    is_clear = len(rest) > 2 and rest.lower() not in _TOO_COMMON and not any(char.isdigit() for char in rest)
    return rest if is_clear else ""


def _whole(title: str) -> str:
    """Returns the pattern of a whole title; a short word counts behind a preposition, or in the letters of the map."""
    if len(title) > _SHORT or re.search(r"\s", title):
        return _pattern(title)
    behind = f"(?:{_BEFORE}){_pattern(title)}"
    return behind if title.lower() in _TOO_COMMON else f"(?:{behind}|(?-i:{re.escape(title)}))"


def _pattern(title: str) -> str:
    """Returns the pattern of a title, in the spellings that people use."""
    return _GAP.join(_word(word) for word in re.split(_GAP, title) if word)


def _word(word: str) -> str:
    spellings = _SPELLINGS.get(word.lower().strip("."))
    return rf"(?:{'|'.join(spellings)})\b\.?" if spellings else "".join(_letter(letter) for letter in word)


def _letter(letter: str) -> str:
    if letter in _MARKS:
        return f"[{_MARKS}]?"
    if letter in ".,":
        return rf"{re.escape(letter)}?"
    if (typed := _LETTERS.get(letter.lower())) is not None:
        return typed
    base = unicodedata.normalize("NFKD", letter)[0]
    return re.escape(letter) if base == letter else f"[{re.escape(letter + base)}]"
