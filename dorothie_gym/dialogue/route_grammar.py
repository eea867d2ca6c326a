"""Phrases of route talk: a matcher of the phrase lists in data/route_talk.yaml over tokens."""

from __future__ import annotations

import functools
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias

from dorothie_gym.dialogue.lexicon import YamlMapping, read_data, strings, word_set
from dorothie_gym.errors import PhraseFileError

FILE: Final = "route_talk.yaml"

_Element: TypeAlias = tuple[frozenset[str], tuple[tuple[str, ...], ...], bool]
"""Alternatives of an element of a phrase, of one word and of several, and whether it may be left out."""

_ELEMENT: Final = re.compile(r"\([^()]*\)|\S+")

_ADVERBS: Final = {"right": "#ok", "left": "#left"}
"""In phrases "right" and "left" are no directions; `directions.mask_directions` masks them as these tokens."""


class Match(NamedTuple):
    """Phrase that has been found in a sequence of tokens.

    Attributes:
        group: top-level list of the data file ("actions", "relations", ...).
        kind: list within the group ("stop", "until", ...).
        length: number of tokens.
    """

    group: str
    kind: str
    length: int


class _Phrase(NamedTuple):
    group: str
    kind: str
    elements: tuple[_Element, ...]
    most: int
    """Number of words of its longest form."""


class PhraseIndex:
    """Phrases by their first word."""

    def __init__(self, phrases: Sequence[tuple[str, str, str]], *, adverbs: bool = True) -> None:
        """Compiles phrases.

        Args:
            phrases: (group, kind, text) of each phrase; of phrases of equal length the earlier one is preferred.
            adverbs: whether "left" and "right" in the phrases are no directions.
        """
        found: dict[str, list[_Phrase]] = defaultdict(list)
        for group, kind, text in phrases:
            elements = tuple(_element(word, adverbs) for word in _ELEMENT.findall(text))
            for first in _first_words(text, elements):
                found[first].append(_Phrase(group, kind, elements, _most_words(elements)))
        self._phrases: Mapping[str, Sequence[_Phrase]] = found

    def longest(self, words: Sequence[str], place: int, stop: int | None = None) -> Match | None:
        """Returns the longest phrase that begins at a place of `words` and ends before `stop`; None without any."""
        best: Match | None = None
        end = len(words) if stop is None else stop
        for phrase in self._phrases.get(words[place], ()):
            if best is not None and phrase.most <= best.length:
                continue
            length = _longest(phrase.elements, words, place, 0, end) - place
            if length > 0 and (best is None or length > best.length):
                best = Match(phrase.group, phrase.kind, length)
        return best


def _longest(elements: Sequence[_Element], words: Sequence[str], place: int, number: int, end: int) -> int:
    """Returns the place behind the longest match of the elements from `number` on; -1 without a match."""
    if number == len(elements):
        return place
    options, sequences, optional = elements[number]
    found = -1
    if place < end and words[place] in options:
        found = _longest(elements, words, place + 1, number + 1, end)
    for sequence in sequences:
        if place + len(sequence) <= end and tuple(words[place : place + len(sequence)]) == sequence:
            found = max(found, _longest(elements, words, place + len(sequence), number + 1, end))
    if optional:
        found = max(found, _longest(elements, words, place, number + 1, end))
    return found


def _element(text: str, adverbs: bool) -> _Element:
    optional = text.startswith("(") and text.endswith(")")
    options = [
        tuple(_ADVERBS.get(word, word) if adverbs else word for word in option.split("_"))
        for option in text.strip("()").replace(" ", "_").split("|")
    ]
    if text.startswith("(") is not text.endswith(")") or any(
        "" in option or any("(" in word or ")" in word for word in option) for option in options
    ):
        raise PhraseFileError(f"{FILE}: {text!r} is no element of a phrase; write it as a|b_c or (a|b_c)")
    single = frozenset(option[0] for option in options if len(option) == 1)
    return single, tuple(option for option in options if len(option) > 1), optional


def _most_words(elements: Sequence[_Element]) -> int:
    return sum(max([1, *(len(sequence) for sequence in sequences)]) for _, sequences, _ in elements)


def _first_words(text: str, elements: Sequence[_Element]) -> Iterator[str]:
    """Yields the words with which a phrase may begin."""
    seen: set[str] = set()
    for single, sequences, optional in elements:
        words = single | {sequence[0] for sequence in sequences}
        yield from sorted(words - seen)
        seen |= words
        if not optional:
            return
    raise PhraseFileError(f"{FILE}: {text!r} may be left out altogether; put one word outside the brackets")


@dataclass(frozen=True)
class RouteGrammar:
    """Grammar of route talk, as data/route_talk.yaml defines it; that file explains each list.

    Attributes:
        terminals: actions, lights, verbs, relations, boundaries, repairs and negations.
        references: places by their role in the drive or the conversation.
        opportunities: nouns that count opportunities to turn.
        openers: openings of clauses, by what the clause does: soft, request, question, statement.
        lights: phrases about the lights of the car.
        contingencies: conditions of the world, and phrases that look like them and are politeness or places.
        leaving: what an object does that leaves.
        fillers: words that change nothing.
        modifiers: words that may stand before the noun of a place.
        determiners: articles and the like.
        junction_words: words behind which "lights" are traffic lights.
        subjects: subjects with their verb, which begin a clause.
        subordinators: words behind which they do not.
        people: people who can be fetched.
        finite: finite verbs that make a statement of the words before them.
        last_words: words behind an action that add nothing to it.
        metres: factors to metres, by unit.
        speeds: factors to km/h, by unit.
        hours: numbers per hour, by unit of time.
    """

    terminals: PhraseIndex
    references: PhraseIndex
    opportunities: PhraseIndex
    openers: PhraseIndex
    lights: PhraseIndex
    contingencies: PhraseIndex
    leaving: PhraseIndex
    fillers: PhraseIndex
    modifiers: frozenset[str]
    determiners: frozenset[str]
    junction_words: frozenset[str]
    subjects: frozenset[str]
    subordinators: frozenset[str]
    people: frozenset[str]
    finite: frozenset[str]
    last_words: frozenset[str]
    metres: Mapping[str, float]
    speeds: Mapping[str, float]
    hours: Mapping[str, float]


_TERMINALS: Final = ("boundaries", "repairs", "negations", "relations", "lights", "actions", "verbs")


@functools.cache
def route_grammar() -> RouteGrammar:
    """Returns the cached grammar.

    Raises:
        PhraseFileError: a list of the data file is missing or malformed.
    """
    data = read_data(FILE)
    return RouteGrammar(
        terminals=PhraseIndex([row for group in _TERMINALS for row in _phrases(FILE, data, group)]),
        references=phrase_index(FILE, data, "references"),
        opportunities=phrase_index(FILE, data, "opportunities"),
        openers=phrase_index(FILE, data, "openers", adverbs=False),
        fillers=phrase_index(FILE, data, "fillers", adverbs=False),
        lights=phrase_index(FILE, data, "lights"),
        leaving=phrase_index(FILE, data, "leaving"),
        contingencies=phrase_index(FILE, data, "contingencies", adverbs=False),
        modifiers=word_set(FILE, data, "modifiers"),
        determiners=word_set(FILE, data, "determiners"),
        junction_words=word_set(FILE, data, "junction_words"),
        subjects=word_set(FILE, data, "subjects"),
        subordinators=word_set(FILE, data, "subordinators"),
        people=word_set(FILE, data, "people"),
        finite=word_set(FILE, data, "finite"),
        last_words=word_set(FILE, data, "last_words"),
        metres=_factors(data, "metres"),
        speeds=_factors(data, "speeds"),
        hours=_factors(data, "hours"),
    )


def phrase_index(file: str, data: YamlMapping, group: str, *, adverbs: bool = True) -> PhraseIndex:
    """Returns the phrases of a group of a data file, which are a list, or lists by kind.

    Args:
        file: name of the file, for messages.
        data: content of the file.
        group: name of the group.
        adverbs: whether adverbs may stand inside the phrases.

    Raises:
        PhraseFileError: the group is missing or malformed.
    """
    return PhraseIndex(list(_phrases(file, data, group)), adverbs=adverbs)


def _phrases(file: str, data: YamlMapping, group: str) -> Iterator[tuple[str, str, str]]:
    listed = data.get(group)
    kinds = listed if isinstance(listed, dict) else {group: listed}
    for kind, phrases in kinds.items():
        for text in strings(f"{file}: {group}.{kind}", phrases):
            yield group, kind, text


def _factors(data: YamlMapping, name: str) -> Mapping[str, float]:
    listed = data.get(name)
    if not isinstance(listed, dict) or not all(isinstance(factor, int | float) for factor in listed.values()):
        raise PhraseFileError(f"{FILE}: {name}: expected a mapping from units to numbers")
    return {str(unit): float(factor) for unit, factor in listed.items()}
