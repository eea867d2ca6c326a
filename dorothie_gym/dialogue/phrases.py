"""A small language for phrases: what a speaker may say, with choices, gaps, options and marks of style.

- `(a|b)`: one of several; `b *3` is three times as likely, marks (below) stand in front of an alternative.
- `[a]`: said or left out, more often said by the chatty; may hold alternatives.
- `<name>`: a phrase defined elsewhere.
- `{name}`: a gap that the act or its particulars fill.

Marks: "~" slangy, "^" polite, "!" blunt, "%" indirect. Marked alternatives are for speakers of that kind, who also use
the unmarked ones; where all are marked, everybody may use them all.
"""

from __future__ import annotations

import enum
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from dorothie_gym.dialogue.lexicon import LexiconError

_TOKEN = re.compile(r"[()\[\]|]|<\w+>|{\w+}|[^()\[\]|<>{}]+|[<>{}]")
WEIGHT = re.compile(r"\s\*(\d+)\s*$")
"""A weight at the end of an alternative."""
_MARKS = "~^!%"
_ENDS = ("|", ")", "]")
_BRACKETS = (*_ENDS, "(", "[")
_FAVOUR = 3
"""How much likelier than an unmarked alternative one is that carries a mark of the speaker's style."""


class Register(enum.IntEnum):
    """How a speaker puts things."""

    PLAIN = 0
    SLANGY = 1
    POLITE = 2
    BLUNT = 3


_REGISTERS = {"~": Register.SLANGY, "^": Register.POLITE, "!": Register.BLUNT}


class PhraseSpeaker(Protocol):
    """What a phrase needs of its speaker to become words.

    Attributes:
        random: draws from [0, 1).
        manner: which alternatives are open: 2 * register, plus 1 for an indirect speaker.
        chattiness: share of options that are said.
        habit: share of choices that fall on the speaker's favourite.
        idiolect: number that settles the favourites.
    """

    random: Callable[[], float]
    manner: int
    chattiness: float
    habit: float
    idiolect: int

    def gap(self, name: str) -> str:
        """Returns the words for a gap."""
        ...


Words = str | Callable[[PhraseSpeaker], str]
"""Fixed words, or a function that finds them."""


@dataclass(frozen=True)
class Phrase:
    """A compiled phrase.

    Attributes:
        words: what is said.
        gaps: names of the gaps that are always filled.
        maybe: names of gaps that some of its alternatives fill.
    """

    words: Words
    gaps: frozenset[str]
    maybe: frozenset[str]

    def say(self, teller: PhraseSpeaker) -> str:
        """Returns words for it; spaces may be doubled."""
        return self.words if isinstance(self.words, str) else self.words(teller)


@dataclass(frozen=True)
class Alternative:
    """A phrase with what decides how often it is chosen.

    Attributes:
        phrase: what is said.
        registers: the registers it is marked for; empty for all.
        indirect: whether it is for the indirect.
        weight: how likely it is beside the others.
    """

    phrase: Phrase
    registers: frozenset[Register]
    indirect: bool
    weight: int


def manner_of(register: Register, indirect: bool) -> int:
    """Returns the number by which a teller's open alternatives are found."""
    return 2 * register + indirect


def parse_phrase(where: str, text: str, phrases: Mapping[str, Phrase]) -> Phrase:
    """Compiles one alternative (marks and weight in it are refused: see `parse_alternatives`).

    Args:
        where: file and line, for messages.
        text: in the language of this module, without "|" at the top level.
        phrases: those that may be named.

    Raises:
        LexiconError: naming `where`, if the text is not in the language or names an unknown phrase.
    """
    reader = _PhraseParser(where, text, phrases)
    phrase = reader.sequence()
    reader.expect_end()
    return phrase


def parse_alternatives(where: str, text: str, phrases: Mapping[str, Phrase]) -> list[Alternative]:
    """Compiles alternatives parted by "|"; arguments and errors as for `parse_phrase`."""
    reader = _PhraseParser(where, text, phrases)
    alternatives = reader.alternatives()
    reader.expect_end()
    return alternatives


def split_alternatives(text: str) -> list[str]:
    """Returns the alternatives of a line, parted by "|" outside brackets."""
    found, depth = [""], 0
    for letter in text:
        depth += (letter in "([") - (letter in ")]")
        if letter == "|" and depth == 0:
            found.append("")
        else:
            found[-1] += letter
    return found


def choice(name: str, alternatives: Sequence[Alternative]) -> Phrase:
    """Returns the phrase that is one of several.

    Args:
        name: settles, with the idiolect, which one is somebody's favourite.
        alternatives: at least one.
    """
    phrases = [alternative.phrase for alternative in alternatives]
    gaps = frozenset.intersection(*(phrase.gaps for phrase in phrases))
    maybe = frozenset().union(*(phrase.maybe for phrase in phrases))
    if len(phrases) == 1:
        return phrases[0]
    return Phrase(_choice_words(name, alternatives), gaps, maybe)


def open_to(alternatives: Sequence[Alternative], manner: int) -> tuple[int, ...]:
    """Returns the places of the alternatives that a manner may choose from, each as often as its weight."""
    register, indirect = Register(manner // 2), bool(manner % 2)
    places: list[int] = []
    for place, item in enumerate(alternatives):
        fits = not item.registers or register in item.registers
        if fits and (indirect or not item.indirect):
            favoured = (register in item.registers) + item.indirect
            places += [place] * item.weight * (_FAVOUR if favoured else 1)
    return tuple(places) or tuple(range(len(alternatives)))


def _choice_words(name: str, alternatives: Sequence[Alternative]) -> Words:
    manners = [open_to(alternatives, manner) for manner in range(2 * len(Register))]
    options = tuple(tuple(alternatives[place].phrase.words for place in places) for places in manners)
    number = zlib.crc32(name.encode()) | 1

    def say(teller: PhraseSpeaker) -> str:
        mine = options[teller.manner]
        drawn, habit = teller.random(), teller.habit
        if drawn < habit:
            words = mine[((teller.idiolect * number) >> 13) % len(mine)]
        else:
            words = mine[int((drawn - habit) / (1.0 - habit) * len(mine))]
        return words if isinstance(words, str) else words(teller)

    return say


class _PhraseParser:
    """Reads one line by recursive descent."""

    def __init__(self, where: str, text: str, phrases: Mapping[str, Phrase]) -> None:
        self._where = where
        self._text = text
        self._phrases = phrases
        self._tokens = _TOKEN.findall(text)
        self._place = 0

    def expect_end(self) -> None:
        if self._place < len(self._tokens):
            raise self._error(f"unexpected {self._tokens[self._place]!r}")

    def alternatives(self) -> list[Alternative]:
        found = [self._alternative()]
        while self._peek() == "|":
            self._place += 1
            found.append(self._alternative())
        return found

    def sequence(self) -> Phrase:
        parts = list(self._parts())
        gaps = frozenset().union(*(part.gaps for part in parts))
        maybe = frozenset().union(*(part.maybe for part in parts))
        return Phrase(_joined([part.words for part in parts]), gaps, maybe)

    def _alternative(self) -> Alternative:
        registers: set[Register] = set()
        indirect, weight = False, 1
        first = self._peek()
        if first is not None and first not in _BRACKETS:
            marks = first.lstrip()
            bare = marks.lstrip(_MARKS)
            for mark in marks[: len(marks) - len(bare)]:
                indirect |= mark == "%"
                registers |= {_REGISTERS[mark]} if mark in _REGISTERS else set()
            self._tokens[self._place] = bare.lstrip()
        phrase, weight = self._weighted()
        return Alternative(phrase, frozenset(registers), indirect, weight)

    def _weighted(self) -> tuple[Phrase, int]:
        weight = 1
        depth, place = 0, self._place
        while place < len(self._tokens) and not (depth == 0 and self._tokens[place] in _ENDS):
            depth += (self._tokens[place] in ("(", "[")) - (self._tokens[place] in (")", "]"))
            place += 1
        if place > self._place:
            found = WEIGHT.search(self._tokens[place - 1])
            if found is not None:
                weight = int(found[1])
                self._tokens[place - 1] = self._tokens[place - 1][: found.start()]
            # Spaces around "|" are for the eye.
            self._tokens[place - 1] = self._tokens[place - 1].rstrip()
        return self.sequence(), weight

    def _parts(self) -> Iterator[Phrase]:
        while (token := self._peek()) is not None and token not in _ENDS:
            self._place += 1
            if token in ("(", "["):
                yield self._bracket(token)
            elif not token:
                continue
            elif token[0] == "<" and len(token) > 1:
                yield self._named(token[1:-1])
            elif token[0] == "{" and len(token) > 1:
                yield _gap(token[1:-1])
            elif token in "<>{}":
                raise self._error(f"stray {token!r}")
            else:
                yield Phrase(token, frozenset(), frozenset())

    def _bracket(self, token: str) -> Phrase:
        inner = choice(f"{self._text}@{self._place}", self.alternatives())
        closing = ")" if token == "(" else "]"
        if self._peek() != closing:
            raise self._error(f"{closing!r} is missing")
        self._place += 1
        return inner if token == "(" else Phrase(_optional(inner.words), frozenset(), inner.maybe)

    def _named(self, name: str) -> Phrase:
        if name not in self._phrases:
            raise self._error(f"no phrase <{name}> is defined before this line")
        return self._phrases[name]

    def _peek(self) -> str | None:
        return self._tokens[self._place] if self._place < len(self._tokens) else None

    def _error(self, reason: str) -> LexiconError:
        return LexiconError(f"{self._where}: {reason} in {self._text!r}")


def _gap(name: str) -> Phrase:
    return Phrase(lambda teller: teller.gap(name), frozenset({name}), frozenset({name}))


def _optional(inner: Words) -> Words:
    def say(teller: PhraseSpeaker) -> str:
        if teller.random() >= teller.chattiness:
            return ""
        return inner if isinstance(inner, str) else inner(teller)

    return say


def _joined(parts: Sequence[Words]) -> Words:
    if all(isinstance(part, str) for part in parts):
        return "".join(part for part in parts if isinstance(part, str))
    if len(parts) == 1:
        return parts[0]
    fixed = tuple(parts)

    def say(teller: PhraseSpeaker) -> str:
        return "".join([part if isinstance(part, str) else part(teller) for part in fixed])

    return say
