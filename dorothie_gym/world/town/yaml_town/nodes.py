"""YAML read with its line numbers: typed access to nodes, where every mistake names the file, the line and the key."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import yaml

from dorothie_gym.world.town.model import TownError

_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
_NULL = "tag:yaml.org,2002:null"


@dataclass(frozen=True)
class Entry:
    """A place in a YAML file.

    Attributes:
        source: the file, for messages.
        element: what the place is called in messages ("street 'High Street'").
        node: what stands there.
    """

    source: str
    element: str
    node: yaml.Node

    @property
    def line(self) -> int:
        """Line in the file, counted from 1."""
        return int(self.node.start_mark.line) + 1

    def fail(self, reason: str) -> NoReturn:
        """Raises the `TownError` of this place."""
        raise TownError(self.source, f"line {self.line}, {self.element}", reason)

    def named(self, element: str) -> Entry:
        """The same place under another name."""
        return Entry(self.source, element, self.node)

    def _child(self, node: yaml.Node, element: str) -> Entry:
        return Entry(self.source, element, node)

    @property
    def is_mapping(self) -> bool:
        """Whether keys and values stand here."""
        return isinstance(self.node, yaml.MappingNode)

    @property
    def is_sequence(self) -> bool:
        """Whether a list stands here."""
        return isinstance(self.node, yaml.SequenceNode)

    def items(self, expected: str) -> list[tuple[Entry, Entry]]:
        """Keys and values, in the order of the file; `expected` says in messages what should stand here."""
        if not isinstance(self.node, yaml.MappingNode):
            self.fail(f"this must be {expected}, not {self._shown()}")
        pairs, seen = [], dict[str, int]()
        for key_node, value in self.node.value:
            key = self._child(key_node, self.element)
            name = key.text("a name")
            if name in seen:
                key.fail(f"{name!r} is there twice (first in line {seen[name]}); rename or remove one")
            seen[name] = key.line
            pairs.append((key, self._child(value, f"{self.element}, {name}")))
        return pairs

    def fields(self, allowed: Collection[str], required: Collection[str]) -> dict[str, Entry]:
        """Values of a mapping with known keys."""
        found = {}
        for key, value in self.items(f"keys and values ({', '.join(allowed)})"):
            name = key.text("a name")
            if name not in allowed:
                key.fail(f"unknown key {name!r}; known keys are {', '.join(allowed)}")
            found[name] = value
        for name in required:
            if name not in found:
                self.fail(f"the key {name!r} is missing; add it")
        return found

    def elements(self, expected: str) -> list[Entry]:
        """Elements of a list."""
        if not isinstance(self.node, yaml.SequenceNode):
            self.fail(f"this must be {expected}, not {self._shown()}")
        return [self._child(node, self.element) for node in self.node.value]

    def text(self, expected: str) -> str:
        """A text as it is written: `no` or `12` are fine as names."""
        if not isinstance(self.node, yaml.ScalarNode) or self.node.tag == _NULL or not self.node.value.strip():
            self.fail(f"this must be {expected}, not {self._shown()}")
        return str(self.node.value).strip()

    def number(self, low: float, high: float, unit: str) -> float:
        """A number in [low, high]."""
        value = math.nan
        if isinstance(self.node, yaml.ScalarNode) and self.node.tag in _NUMBERS:
            try:
                value = float(yaml.SafeLoader("").construct_object(self.node))
            except (ValueError, OverflowError):
                self.fail(f"{self._shown()} is not a number that can be read; write it in plain digits")
        if not low <= value <= high:
            self.fail(f"this must be a number of {unit} from {low:g} to {high:g}, not {self._shown()}")
        return value

    def _shown(self) -> str:
        if self.is_mapping:
            return "keys and values"
        if self.is_sequence:
            return "a list"
        return "nothing" if self.node.tag == _NULL else repr(self.node.value)


def read_nodes(path: Path) -> Entry:
    """The top of a YAML file.

    Raises:
        TownError: the file cannot be read, is empty or is not YAML.
    """
    source = str(path)
    try:
        node = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except OSError as error:
        raise TownError(source, "file", f"cannot be read ({error.strerror}); check the path") from error
    except UnicodeDecodeError as error:
        raise TownError(source, "file", f"is not UTF-8 text (byte {error.start}); save it as UTF-8") from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}" if mark else "file"
        raise TownError(source, where, f"is not YAML ({error.problem}); check brackets, colons, indents") from error
    except yaml.YAMLError as error:
        raise TownError(source, "file", f"is not YAML ({error}); check for stray characters") from error
    if node is None:
        raise TownError(source, "file", "is empty; give it junctions and streets")
    return Entry(source, "town", node)
