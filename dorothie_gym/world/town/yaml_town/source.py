"""A town file as text: found, decoded and parsed, or refused with the line and what to do."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NoReturn

import yaml

from dorothie_gym.world.town.errors import TownError
from dorothie_gym.world.town.yaml_town.nodes import Entry

LARGEST_FILE = 1_000_000
"""A file with more bytes is no town: a city of 500 lanes takes 10 kB."""
DEEPEST = 20
"""Lists within lists; the town language needs 7. libyaml overflows the stack of the process where they are many."""
_UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]")
"""Characters that YAML does not allow (YAML 1.1, section 4.1.1), and byte order marks in the middle of a file."""
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml's where PyYAML has it: the same lines in the marks, 15 times faster (16 ms instead of 300 ms for 60 kB)."""


def read_nodes(path: Path) -> Entry:
    """The top of a YAML file.

    Raises:
        TownError: the file cannot be read, is no text, is empty or is not YAML.
    """
    source = str(path)
    text = _text(path, source)
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
    return Entry(source, "town", node)


def _fail(source: str, line: int, reason: str) -> NoReturn:
    """Raises the error of a line, which is counted from 0 as YAML's marks are."""
    raise TownError(source, f"line {line + 1}", reason)


def _text(path: Path, source: str) -> str:
    try:
        if path.exists() and not path.is_file():  # a pipe would wait for ever
            what = "a directory" if path.is_dir() else "no regular file"
            raise TownError(source, "file", f"cannot be read: it is {what}; name a town file (.yaml)")
        if path.stat().st_size > LARGEST_FILE:
            raise TownError(source, "file", f"is larger than {LARGEST_FILE // 1000} kB; name a town file (.yaml)")
        data = path.read_bytes()
    except OSError as error:
        raise TownError(source, "file", f"cannot be read ({error.strerror}); check the path") from error
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start)
        _fail(source, line, f"is not UTF-8 text (byte {error.start} of the file); save the file as UTF-8")


def _check_events(text: str, source: str) -> None:
    """Refuses what would hang or crash the composer, or hide a mistake: depth, aliases, further documents."""
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
    """Raises a parser's error in words of the file."""
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
