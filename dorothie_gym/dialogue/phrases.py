"""Phrase language: a small template language with choices, gaps, options and style marks, compiled to closures.

- `(a|b)`: a choice; `b *3` is three times as likely, style marks (below) precede an alternative.
- `[a]`: an option, with the probability of the chattiness of the speaker; may contain alternatives.
- `<name>`: a named phrase.
- `{name}`: a gap, filled from the act or the wording.

Marks: "~" slangy, "^" polite, "!" blunt, "%" indirect. Marked alternatives are open to speakers of that style, together
with unmarked ones; a choice with marked alternatives only is open to all speakers.
"""

from __future__ import annotations

import enum
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Protocol

from dorothie_gym.errors import PhraseFileError

_TOKEN = re.compile(r"[()\[\]|]|<\w+>|{\w+}|[^()\[\]|<>{}]+|[<>{}]")
WEIGHT = re.compile(r"\s\*(\d+)\s*$")
"""Weight at the end of an alternative."""
_MARKS = "~^!%"
_ENDS = ("|", ")", "]")
_BRACKETS = (*_ENDS, "(", "[")
_FAVOUR = 3
"""Weight factor of alternatives with a mark of the style of the speaker."""


class Register(enum.IntEnum):
    """Register of a speaker."""

    PLAIN = 0
    SLANGY = 1
    POLITE = 2
    BLUNT = 3


_REGISTERS = {"~": Register.SLANGY, "^": Register.POLITE, "!": Register.BLUNT}


class PhraseSpeaker(Protocol):
    """Interface between a phrase and its speaker.

    Attributes:
        random: function that draws from [0, 1).
        manner: key of the open alternatives: 2 * register, plus 1 for an indirect speaker.
        chattiness: probability of options.
        habit: probability of the favourite alternative of the speaker.
        idiolect: number that determines the favourites.
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
"""Fixed words, or a function that generates them for a speaker."""


@dataclass(frozen=True)
class Phrase:
    """Compiled phrase.

    Attributes:
        words: fixed words or generating function.
        gaps: names of the gaps in all alternatives.
        maybe: names of the gaps in any alternative.
    """

    words: Words
    gaps: frozenset[str]
    maybe: frozenset[str]

    def say(self, speaker: PhraseSpeaker) -> str:
        """Returns the words of the phrase; spaces may be doubled."""
        return self.words if isinstance(self.words, str) else self.words(speaker)


@dataclass(frozen=True)
class Alternative:
    """Alternative of a choice.

    Attributes:
        phrase: compiled phrase.
        registers: marked registers; empty for all.
        indirect: whether the alternative is marked as indirect.
        weight: relative probability.
    """

    phrase: Phrase
    registers: frozenset[Register]
    indirect: bool
    weight: int


def manner_of(register: Register, indirect: bool) -> int:
    """Returns the key of the open alternatives of a speaker."""
    return 2 * register + indirect


def parse_phrase(where: str, text: str, phrases: Mapping[str, Phrase]) -> Phrase:
    """Compiles one alternative without marks and weight (see `parse_alternatives`).

    Args:
        where: file and line for error messages.
        text: text in the phrase language, without "|" at the top level.
        phrases: named phrases that the text may use.

    Raises:
        PhraseFileError: if the text is malformed or uses an undefined phrase; names `where`.
    """
    reader = _PhraseParser(where, text, phrases)
    phrase = reader.sequence()
    reader.expect_end()
    return phrase


def parse_alternatives(where: str, text: str, phrases: Mapping[str, Phrase]) -> list[Alternative]:
    """Compiles alternatives separated by "|"; arguments and errors as in `parse_phrase`."""
    reader = _PhraseParser(where, text, phrases)
    alternatives = reader.alternatives()
    reader.expect_end()
    return alternatives


def split_alternatives(text: str) -> list[str]:
    """Splits a line into alternatives at "|" outside brackets."""
    found, depth = [""], 0
    for letter in text:
        depth += (letter in "([") - (letter in ")]")
        if letter == "|" and depth == 0:
            found.append("")
        else:
            found[-1] += letter
    return found


def choice(name: str, alternatives: Sequence[Alternative]) -> Phrase:
    """Returns the phrase that chooses among alternatives.

    Args:
        name: key that determines, together with the idiolect, the favourite of a speaker.
        alternatives: at least one alternative.
    """
    phrases = [alternative.phrase for alternative in alternatives]
    gaps = frozenset.intersection(*(phrase.gaps for phrase in phrases))
    maybe = frozenset().union(*(phrase.maybe for phrase in phrases))
    if len(phrases) == 1:
        return phrases[0]
    return Phrase(_choice_words(name, alternatives), gaps, maybe)


def open_to(alternatives: Sequence[Alternative], manner: int) -> tuple[int, ...]:
    """Returns the indices of the alternatives open to a manner, each repeated according to its weight."""
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

    def say(speaker: PhraseSpeaker) -> str:
        mine = options[speaker.manner]
        drawn, habit = speaker.random(), speaker.habit
        if drawn < habit:
            words = mine[((speaker.idiolect * number) >> 13) % len(mine)]
        else:
            words = mine[int((drawn - habit) / (1.0 - habit) * len(mine))]
        return words if isinstance(words, str) else words(speaker)

    return say


class _PhraseParser:
    """Recursive descent parser of one line."""

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
            # Spaces around "|" are insignificant.
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

    def _error(self, reason: str) -> PhraseFileError:
        return PhraseFileError(f"{self._where}: {reason} in {self._text!r}")


def _gap(name: str) -> Phrase:
    return Phrase(lambda speaker: speaker.gap(name), frozenset({name}), frozenset({name}))


def _optional(inner: Words) -> Words:
    def say(speaker: PhraseSpeaker) -> str:
        if speaker.random() >= speaker.chattiness:
            return ""
        return inner if isinstance(inner, str) else inner(speaker)

    return say


def _joined(parts: Sequence[Words]) -> Words:
    if all(isinstance(part, str) for part in parts):
        return "".join(part for part in parts if isinstance(part, str))
    if len(parts) == 1:
        return parts[0]
    fixed = tuple(parts)

    def say(speaker: PhraseSpeaker) -> str:
        return "".join([part if isinstance(part, str) else part(speaker) for part in fixed])

    return say


# --- Files of phrases -------------------------------------------------------------------------------------------------
# Reader of the files in data/talk: named phrases and sections of lines in the phrase language (`phrases`).
#
# # a comment
# <name> = one | another          a named phrase; lines that start with "|" continue it
# == head words key=value         a section; each following line is one alternative

_DEFINITION = re.compile(r"<(\w+)>\s*=\s*(.*)")


@dataclass(frozen=True)
class TalkLine:
    """Line of a section.

    Attributes:
        where: file and line number for error messages.
        text: text of the line.
    """

    where: str
    text: str


@dataclass(frozen=True)
class TalkSection:
    """Section of a talk file.

    Attributes:
        where: file and line number of the head for error messages.
        words: words of the head, in order, without "key=value" pairs.
        keys: "key=value" pairs of the head.
        lines: alternatives of the section.
    """

    where: str
    words: tuple[str, ...]
    keys: dict[str, str]
    lines: tuple[TalkLine, ...]


@dataclass(frozen=True)
class TalkFiles:
    """Parsed talk files.

    Attributes:
        phrases: named phrases.
        sections: all sections, in order.
    """

    phrases: dict[str, Phrase]
    sections: tuple[TalkSection, ...]


def read_talk_files() -> dict[str, str]:
    """Returns the texts of the talk files of the package by name, sorted by name."""
    folder = resources.files("dorothie_gym.dialogue").joinpath("data", "talk")
    files = sorted((item for item in folder.iterdir() if item.name.endswith(".talk")), key=lambda item: item.name)
    return {item.name: item.read_text(encoding="utf-8") for item in files}


def parse_talk_files(texts: dict[str, str]) -> TalkFiles:
    """Parses talk files; a phrase must be defined before its first use, in the same file or an earlier one.

    Raises:
        PhraseFileError: if a line is malformed; names file and line.
    """
    phrases: dict[str, Phrase] = {}
    sections: list[TalkSection] = []
    for name, text in texts.items():
        head: TalkSection | None = None
        lines: list[TalkLine] = []
        for line in _logical_lines(name, text):
            found = _DEFINITION.match(line.text)
            if found is not None:
                _define(line.where, found[1], found[2], phrases)
            elif line.text.startswith("=="):
                sections += _closed(head, lines)
                head, lines = _head(line), []
            elif head is None:
                raise PhraseFileError(f"{line.where}: {line.text!r} precedes the first section (== ...)")
            else:
                lines.append(line)
        sections += _closed(head, lines)
    return TalkFiles(phrases, tuple(sections))


def alternatives_of(section: TalkSection, phrases: dict[str, Phrase]) -> list[Alternative]:
    """Compiles the lines of a section; a line may contain several alternatives separated by "|"."""
    return [item for line in section.lines for item in parse_alternatives(line.where, line.text, phrases)]


def _logical_lines(name: str, text: str) -> Iterator[TalkLine]:
    pending: TalkLine | None = None
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("#")[0].strip()
        if not line:
            continue
        if line.startswith("|"):
            if pending is None:
                raise PhraseFileError(f"{name}:{number}: there is no line to continue: {line!r}")
            pending = TalkLine(pending.where, f"{pending.text} {line}")
            continue
        if pending is not None:
            yield pending
        pending = TalkLine(f"{name}:{number}", line)
    if pending is not None:
        yield pending


def _define(where: str, name: str, text: str, phrases: dict[str, Phrase]) -> None:
    if name in phrases:
        raise PhraseFileError(f"{where}: the phrase <{name}> is defined twice")
    phrases[name] = choice(name, parse_alternatives(where, text, phrases))


def _head(line: TalkLine) -> TalkSection:
    words = line.text.removeprefix("==").split()
    if not words:
        raise PhraseFileError(f"{line.where}: a section needs a head, e.g. == Instruct participant")
    keys = dict(word.split("=", 1) for word in words if "=" in word)
    return TalkSection(line.where, tuple(word for word in words if "=" not in word), keys, ())


def _closed(head: TalkSection | None, lines: Sequence[TalkLine]) -> list[TalkSection]:
    if head is None:
        return []
    if not lines:
        raise PhraseFileError(f"{head.where}: the section has no lines")
    return [TalkSection(head.where, head.words, head.keys, tuple(lines))]
