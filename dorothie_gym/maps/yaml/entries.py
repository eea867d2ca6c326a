"""Typed access to YAML nodes; errors name the file, the line, the key and the remedy."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import yaml

from dorothie_gym.errors import InputFileError, TownError
from dorothie_gym.support.input_files import MAX_TOWN_YAML, read_file

_NULL, _BOOL, _MERGE = (f"tag:yaml.org,2002:{kind}" for kind in ("null", "bool", "merge"))
_PLAIN_NUMBER = re.compile(r"[-+]?(?:(?:0|[1-9][0-9]*)(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
"""Accepted numbers: YAML 1.1 would also read 017 as 15, 12:30 as 750 and 1_0 as 10, which is never intended."""
_LISTED, _LONGEST = 12, 60
"""Number of known names in a message, and of characters of a value."""


@dataclass(frozen=True)
class YamlEntry:
    """Position in a YAML file.

    Attributes:
        source: file name for messages.
        element: name of the position in messages ("street 'High Street'").
        node: YAML node.
    """

    source: str
    element: str
    node: yaml.Node

    @property
    def line(self) -> int:
        """Line number, starting at 1."""
        return int(self.node.start_mark.line) + 1

    def fail(self, reason: str) -> NoReturn:
        """Raises a `TownError` for this position."""
        raise TownError(self.source, f"line {self.line}, {self.element}", reason)

    def named(self, element: str) -> YamlEntry:
        """Returns the same position with another name."""
        return YamlEntry(self.source, element, self.node)

    def _child(self, node: yaml.Node, element: str) -> YamlEntry:
        return YamlEntry(self.source, element, node)

    @property
    def is_mapping(self) -> bool:
        """Whether the node is a mapping."""
        return isinstance(self.node, yaml.MappingNode)

    @property
    def is_sequence(self) -> bool:
        """Whether the node is a list."""
        return isinstance(self.node, yaml.SequenceNode)

    def items(self, expected: str) -> list[tuple[YamlEntry, YamlEntry]]:
        """Returns keys and values in the order of the file; `expected` describes the expected content in messages."""
        if not isinstance(self.node, yaml.MappingNode):
            self.fail(f"this must be {expected}, not {self.shown()}")
        pairs, seen = [], dict[str, int]()
        for key_node, value in self.node.value:
            key = self._child(key_node, self.element)
            if key_node.tag == _MERGE:
                key.fail("merge keys (<<) are not read; write the keys out")
            name = key.text("a name before the colon")
            if name in seen:
                key.fail(f"{name!r} is there twice (first in line {seen[name]}); rename or remove one")
            seen[name] = key.line
            pairs.append((key, self._child(value, f"{self.element}, {name}")))
        return pairs

    def fields(self, allowed: Collection[str], required: Collection[str]) -> dict[str, YamlEntry]:
        """Returns the values of a mapping with known keys."""
        found = {}
        for key, value in self.items(f"keys and values ({', '.join(allowed)})"):
            name = key.text("a name")
            if name not in allowed:
                guess = closest(name, allowed)
                advice = f"did you mean {guess!r}?" if guess else "remove it"
                key.fail(f"unknown key {name!r}; known keys are {', '.join(allowed)}; {advice}")
            found[name] = value
        for name in required:
            if name not in found:
                self.fail(f"the key {name!r} is missing; add it")
        return found

    def elements(self, expected: str) -> list[YamlEntry]:
        """Returns the elements of a list; `expected` describes the expected content in messages."""
        if not isinstance(self.node, yaml.SequenceNode):
            self.fail(f"this must be {expected}, not {self.shown()}")
        return [self._child(node, self.element) for node in self.node.value]

    def names(self, expected: str) -> list[YamlEntry]:
        """Returns the elements of a list of names; a single name gets advice about brackets."""
        if isinstance(self.node, yaml.ScalarNode) and self.node.value.strip():
            self.fail(f"this must be {expected}, not {self.shown()}; put it into brackets: [{self.node.value}]")
        return self.elements(expected)

    def pair(self, expected: str) -> tuple[YamlEntry, YamlEntry]:
        """Returns the elements of a list of two."""
        elements = self.elements(expected)
        if len(elements) != 2:
            self.fail(f"this must be {expected}, not a list of {len(elements)}")
        return elements[0], elements[1]

    def text(self, expected: str) -> str:
        """Returns a text of one line as written, without surrounding spaces: `No` or `12` are valid names."""
        node = self.node
        if not isinstance(node, yaml.ScalarNode):
            self.fail(f"this must be {expected}, not {self.shown()}")
        value = str(node.value).strip()
        if not value:
            self.fail(f"this must be {expected}, not {self.shown()}; write one")
        if node.tag == _NULL:
            self.fail(f"this must be {expected}; {value} is YAML's word for nothing: put it into quotes, '{value}'")
        if not value.isprintable():
            self.fail(f"this must be {expected} on a single line of plain characters, not {self.shown()}")
        return value

    def choice(self, known: Collection[str], what: str, expected: str) -> str:
        """Returns one of the known names; `what` is the kind of name in messages (junction, street)."""
        name = self.text(expected)
        if name not in known:
            guess = closest(name, known)
            advice = f"; did you mean {guess!r}?" if guess else ""
            self.fail(f"unknown {what} {name!r}; known are {listed(known)}{advice}")
        return name

    def number(self, low: float, high: float, unit: str) -> float:
        """Returns a number from `low` to `high` in plain decimal digits."""
        expected = f"a number of {unit} from {low:g} to {high:g}"
        node = self.node
        if not isinstance(node, yaml.ScalarNode) or not str(node.value).strip():
            self.fail(f"this must be {expected}, not {self.shown()}")
        value = str(node.value)
        if not _PLAIN_NUMBER.fullmatch(value):
            digits = "; write it in plain decimal digits (12.5)" if value[:1] in set("+-.0123456789") else ""
            self.fail(f"this must be {expected}, not {self.shown()}{digits}")
        if node.style:  # None or '' (libyaml) where it is plain
            self.fail(f"this must be {expected}, not a text; remove the quotes around {value}")
        if not low <= float(value) <= high:
            self.fail(f"this must be {expected}, not {self.shown()}")
        return float(value) + 0.0  # -0.0 is 0.0

    def whole(self, low: int, high: int, what: str) -> int:
        """Returns an integer from `low` to `high`."""
        value = self.number(low, high, what)
        if not value.is_integer():
            self.fail(f"this must be a whole number of {what} from {low} to {high}, not {self.shown()}")
        return int(value)

    def boolean(self) -> bool:
        """Returns a boolean in any spelling of YAML."""
        node = self.node
        if not isinstance(node, yaml.ScalarNode) or node.tag != _BOOL:
            self.fail(f"this must be true or false, not {self.shown()}")
        return str(node.value).lower() in ("true", "yes", "on")

    def shown(self) -> str:
        """Returns a description of the node for messages."""
        if self.is_mapping:
            return "keys and values"
        if self.is_sequence:
            return f"a list of {len(self.node.value)}"
        value = str(self.node.value)
        if self.node.tag == _NULL or not value.strip():
            return "nothing"
        return repr(value if len(value) <= _LONGEST else f"{value[:_LONGEST]}...")


def closest(name: str, known: Iterable[str]) -> str | None:
    """Returns the most similar known name regardless of case, or None."""
    by_folded = {other.casefold(): other for other in known}
    found = difflib.get_close_matches(name.casefold(), list(by_folded), n=1)
    return by_folded[found[0]] if found else None


def listed(names: Collection[str]) -> str:
    """Returns a list of names for messages, limited to the first dozen."""
    if not names:
        return "none"
    rest = len(names) - _LISTED
    return ", ".join(list(names)[:_LISTED]) + (f" and {rest} more" if rest > 0 else "")


# --- Files -----------------------------------------------------------------------------------------------------------

DEEPEST = 20
"""Largest nesting depth; the town language needs 7. libyaml overflows the process stack on deep nesting."""
_UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]")
"""Characters that YAML does not allow (YAML 1.1, section 4.1.1), and byte order marks inside a file."""
_LOADER: type[yaml.CSafeLoader | yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml if PyYAML has it: identical line marks, 15 times faster (16 ms instead of 300 ms for 60 kB)."""


def read_nodes(path: Path) -> YamlEntry:
    """Returns the root of a YAML file.

    Raises:
        TownError: the file cannot be read, is not text, is empty or is not YAML.
    """
    source = str(path)
    return parse_nodes(_text(path, source), source)


def parse_nodes(text: str, source: str) -> YamlEntry:
    """Returns the root of a YAML text; `source` is its name in messages.

    Raises:
        TownError: the text is empty or is not YAML.
    """
    found = _UNPRINTABLE.search(text)
    if found:
        _fail(source, text.count("\n", 0, found.start()), f"is not YAML: character {found[0]!r} is in it; remove it")
    try:
        _check_events(text, source)
        node = yaml.compose(text, Loader=_LOADER)
    except yaml.MarkedYAMLError as error:
        _explain(error, text, source)
    if node is None or (isinstance(node, yaml.ScalarNode) and not node.value):
        raise TownError(source, "file", "is empty; give it junctions and streets")
    return YamlEntry(source, "town", node)


def _fail(source: str, line: int, reason: str) -> NoReturn:
    """Raises the error of a line, numbered from 0 as in YAML marks."""
    raise TownError(source, f"line {line + 1}", reason)


def _text(path: Path, source: str) -> str:
    try:
        data = read_file(path, MAX_TOWN_YAML)
    except InputFileError as error:
        raise TownError(source, "file", error.reason) from None
    except OSError as error:
        raise TownError(source, "file", f"cannot be read ({error.strerror}); check the path") from error
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start)
        _fail(source, line, f"is not UTF-8 text (byte {error.start} of the file); save the file as UTF-8")


def _check_events(text: str, source: str) -> None:
    """Rejects deep nesting, aliases and further documents, which would crash the composer or hide mistakes."""
    depth, documents = 0, 0
    for event in yaml.parse(text, Loader=_LOADER):
        line = event.start_mark.line if event.start_mark else 0
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > DEEPEST:
                _fail(source, line, f"lists are nested more than {DEEPEST} deep; check the brackets")
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        elif isinstance(event, yaml.AliasEvent):
            _fail(source, line, f"the alias *{event.anchor} stands for text elsewhere; write the text out instead")
        elif isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                _fail(source, line, "a second document starts here ('---'); keep one town in a file")


def _explain(error: yaml.MarkedYAMLError, text: str, source: str) -> NoReturn:
    """Raises a parser error with advice in terms of the file."""
    lines = text.splitlines() or [""]
    mark = error.problem_mark or error.context_mark
    line = min(mark.line if mark else 0, len(lines) - 1)
    context = str(error.context or "")
    if error.context_mark and ("flow" in context or "quoted" in context):
        what = "the quote" if "quoted" in context else "the bracket"
        comma = "" if "quoted" in context else ", or a comma is missing after it"
        reason = f"is not YAML: {what} that opens here is not closed before line {line + 1}{comma}"
        line = min(error.context_mark.line, len(lines) - 1)
    elif "\t" in lines[line][: len(lines[line]) - len(lines[line].lstrip())]:
        reason = "is not YAML: the line is indented with a tab; use spaces"
    else:
        reason = f"is not YAML ({error.problem}); check brackets, colons and indents here and in the line above"
    raise TownError(source, f"line {line + 1}", reason) from error
