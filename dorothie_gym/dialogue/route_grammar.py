"""Phrases of route talk: a matcher of the phrase lists in data/route_talk.yaml over tokens."""

from __future__ import annotations

import functools
import itertools
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


class _Position(NamedTuple):
    """Place within a phrase that has been reached: an element, and the words read of one of its sequences."""

    phrase: int
    element: int
    sequence: int = -1
    read: int = 0


class _Node:
    """State of the matcher: the positions that the words so far can have reached.

    Attributes:
        positions: the positions.
        ended: group and kind of the first phrase that may end here; None without any.
        after: states behind words of the vocabulary, as far as they have been met; None where no phrase goes on.
    """

    __slots__ = ("after", "ended", "positions")

    def __init__(self, positions: frozenset[_Position], ended: tuple[str, str] | None) -> None:
        self.positions = positions
        self.ended = ended
        self.after: dict[str, _Node | None] = {}


class PhraseIndex:
    """Matcher of phrases: a finite automaton whose states are built when they are first reached."""

    def __init__(self, phrases: Sequence[tuple[str, str, str]], *, adverbs: bool = True) -> None:
        """Compiles phrases.

        Args:
            phrases: (group, kind, text) of each phrase; of phrases of equal length the earlier one is preferred.
            adverbs: whether "left" and "right" in the phrases are no directions.
        """
        self._phrases = [
            _Phrase(group, kind, tuple(_element(word, adverbs) for word in _ELEMENT.findall(text)))
            for group, kind, text in phrases
        ]
        self._beginning: Mapping[str, set[int]] = defaultdict(set)
        for number, (phrase, (_, _, text)) in enumerate(zip(self._phrases, phrases, strict=True)):
            for first in _first_words(text, phrase.elements):
                self._beginning[first].add(number)
        self._words = frozenset(word for phrase in self._phrases for word in _words(phrase.elements))
        self._nodes: dict[frozenset[_Position], _Node] = {}
        self._start = _Node(frozenset(), None)

    def may_begin(self, word: str) -> bool:
        """Returns whether a phrase may begin with a word."""
        return word in self._beginning

    def longest(self, words: Sequence[str], place: int, stop: int | None = None) -> Match | None:
        """Returns the longest phrase that begins at a place of `words` and ends before `stop`; None without any."""
        if place >= len(words) or words[place] not in self._beginning:
            return None
        node, ended, length, known = self._start, None, 0, self._words
        for number in range(place, len(words) if stop is None else stop):
            word = words[number]
            if word not in known:
                break
            behind = node.after[word] if word in node.after else self._advance(node, word)
            if behind is None:
                break
            node = behind
            if node.ended is not None:
                ended, length = node.ended, number + 1 - place
        return None if ended is None else Match(*ended, length)

    def _advance(self, node: _Node, word: str) -> _Node | None:
        """Returns the state behind a word of the vocabulary, and keeps it."""
        if node is self._start:
            before = frozenset(_Position(number, 0) for number in self._beginning.get(word, ()))
        else:
            before = node.positions
        positions = frozenset(behind for position in before for behind in self._behind(position, word))
        node.after[word] = found = self._node(positions) if positions else None
        return found

    def _node(self, positions: frozenset[_Position]) -> _Node:
        if positions not in self._nodes:
            ends = [position.phrase for position in positions if self._may_end(position)]
            phrase = self._phrases[min(ends)] if ends else None
            self._nodes[positions] = _Node(positions, None if phrase is None else (phrase.group, phrase.kind))
        return self._nodes[positions]

    def _behind(self, position: _Position, word: str) -> Iterator[_Position]:
        """Yields the positions behind a word."""
        elements = self._phrases[position.phrase].elements
        if position.sequence >= 0:
            sequence = elements[position.element][1][position.sequence]
            if sequence[position.read] == word:
                yield _stepped(position, len(sequence))
            return
        for number in range(position.element, len(elements)):
            single, sequences, optional = elements[number]
            if word in single:
                yield _Position(position.phrase, number + 1)
            for which, sequence in enumerate(sequences):
                if sequence[0] == word:
                    yield _stepped(_Position(position.phrase, number, which), len(sequence))
            if not optional:
                return

    def _may_end(self, position: _Position) -> bool:
        rest = self._phrases[position.phrase].elements[position.element :]
        return position.sequence < 0 and all(optional for _, _, optional in rest)


def _stepped(position: _Position, length: int) -> _Position:
    """Returns the position behind the next word of a sequence."""
    if position.read + 1 == length:
        return _Position(position.phrase, position.element + 1)
    return position._replace(read=position.read + 1)


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


def _words(elements: Sequence[_Element]) -> Iterator[str]:
    """Yields the words of a phrase."""
    for single, sequences, _ in elements:
        yield from single
        yield from itertools.chain.from_iterable(sequences)


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
