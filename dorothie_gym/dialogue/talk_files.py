"""Reader of the files in data/talk: named phrases and sections of lines in the phrase language (`phrases`).

# a comment
<name> = one | another          a named phrase; lines that start with "|" continue it
== head words key=value         a section; each following line is one alternative
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import resources

from dorothie_gym.dialogue.phrases import Alternative, Phrase, choice, parse_alternatives
from dorothie_gym.errors import PhraseFileError

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
