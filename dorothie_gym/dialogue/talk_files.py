"""The files of data/talk: named phrases and sections of lines, in the language of `phrases`.

# a comment
<name> = one | another          a phrase; lines that begin with "|" go on with it
== head words key=value         a section; each line behind it is one alternative
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import resources

from dorothie_gym.dialogue.lexicon import LexiconError
from dorothie_gym.dialogue.phrases import Alternative, Phrase, choice, parse_alternatives

_DEFINITION = re.compile(r"<(\w+)>\s*=\s*(.*)")


@dataclass(frozen=True)
class TalkLine:
    """A line of a section.

    Attributes:
        where: file and line, for messages.
        text: as written.
    """

    where: str
    text: str


@dataclass(frozen=True)
class TalkSection:
    """A section of a talk file.

    Attributes:
        where: file and line of its head, for messages.
        words: of the head, in order, without "key=value".
        keys: the "key=value" of the head.
        lines: its alternatives.
    """

    where: str
    words: tuple[str, ...]
    keys: dict[str, str]
    lines: tuple[TalkLine, ...]


@dataclass(frozen=True)
class TalkFiles:
    """What the files say.

    Attributes:
        phrases: named phrases.
        sections: all sections, in order.
    """

    phrases: dict[str, Phrase]
    sections: tuple[TalkSection, ...]


def read_talk_files() -> dict[str, str]:
    """Returns the texts of the package's talk files by name, those whose names sort first in front."""
    folder = resources.files(__package__).joinpath("data", "talk")
    files = sorted((item for item in folder.iterdir() if item.name.endswith(".talk")), key=lambda item: item.name)
    return {item.name: item.read_text(encoding="utf-8") for item in files}


def parse_talk_files(texts: dict[str, str]) -> TalkFiles:
    """Returns what talk files say; a phrase must be defined before it is named, in this file or an earlier one.

    Raises:
        LexiconError: naming file and line.
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
                raise LexiconError(f"{line.where}: {line.text!r} stands before the first section (== ...)")
            else:
                lines.append(line)
        sections += _closed(head, lines)
    return TalkFiles(phrases, tuple(sections))


def alternatives_of(section: TalkSection, phrases: dict[str, Phrase]) -> list[Alternative]:
    """Compiles the lines of a section; each may hold several alternatives parted by "|"."""
    return [item for line in section.lines for item in parse_alternatives(line.where, line.text, phrases)]


def _logical_lines(name: str, text: str) -> Iterator[TalkLine]:
    pending: TalkLine | None = None
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("#")[0].strip()
        if not line:
            continue
        if line.startswith("|"):
            if pending is None:
                raise LexiconError(f"{name}:{number}: there is no line to go on with: {line!r}")
            pending = TalkLine(pending.where, f"{pending.text} {line}")
            continue
        if pending is not None:
            yield pending
        pending = TalkLine(f"{name}:{number}", line)
    if pending is not None:
        yield pending


def _define(where: str, name: str, text: str, phrases: dict[str, Phrase]) -> None:
    if name in phrases:
        raise LexiconError(f"{where}: the phrase <{name}> is defined twice")
    phrases[name] = choice(name, parse_alternatives(where, text, phrases))


def _head(line: TalkLine) -> TalkSection:
    words = line.text.removeprefix("==").split()
    if not words:
        raise LexiconError(f"{line.where}: a section needs a head, for instance: == Instruct participant")
    keys = dict(word.split("=", 1) for word in words if "=" in word)
    return TalkSection(line.where, tuple(word for word in words if "=" not in word), keys, ())


def _closed(head: TalkSection | None, lines: Sequence[TalkLine]) -> list[TalkSection]:
    if head is None:
        return []
    if not lines:
        raise LexiconError(f"{head.where}: the section has no lines")
    return [TalkSection(head.where, head.words, head.keys, tuple(lines))]
