"""Reads the fields of a template one by one, each checked for its type."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, NoReturn

from dorothie_gym.tasks.errors import StoryboardError

_NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class FieldReader:
    """One object of a template.

    Attributes:
        template: what the template is called in errors.
        path: where the object stands, such as "subgoals[1]"; empty at the top.
        values: the object.
    """

    template: str
    path: str
    values: dict[str, Any]

    def fail(self, field: str, reason: str) -> NoReturn:
        """Raises a `StoryboardError` about a field of this object."""
        raise StoryboardError(self.template, f"{self.path}.{field}" if self.path else field, reason)

    def check_known(self, known: Collection[str]) -> None:
        """Raises if the object has a field that is not in `known`."""
        for field in self.values:
            if field not in known:
                self.fail(field, f"unknown field; the fields are {', '.join(known)}")

    def text(self, field: str) -> str:
        """A text that must be there; line breaks and runs of blanks become one blank."""
        text = self.optional_text(field)
        if text is None:
            self.fail(field, "is missing or empty; give a text")
        return text

    def optional_text(self, field: str) -> str | None:
        """A text, or None where the field is absent or empty."""
        value = self.values.get(field, "")
        if not isinstance(value, str):
            self.fail(field, f"must be a text, not {_describe(value)}")
        return " ".join(value.split()) or None

    def flag(self, field: str) -> bool:
        """True or false; false where the field is absent."""
        value = self.values.get(field, False)
        if not isinstance(value, bool):
            self.fail(field, f"must be true or false, not {_describe(value)}")
        return value

    def items(self, field: str) -> list[Any]:
        """A list; empty where the field is absent."""
        value = self.values.get(field, [])
        if not isinstance(value, list):
            self.fail(field, f"must be a list, not {_describe(value)}")
        return value

    def indices(self, field: str) -> tuple[int, ...]:
        """A list of indices, each once, in ascending order."""
        items = self.items(field)
        for item in items:
            if isinstance(item, bool) or not isinstance(item, int):
                self.fail(field, f"must be a list of subgoal numbers (the first is 0), not of {_describe(item)}")
        return tuple(sorted(set(items)))

    def names(self, field: str) -> tuple[str, ...]:
        """A list of variables' names, with or without the dollar sign."""
        items = self.items(field)
        for item in items:
            if not isinstance(item, str):
                self.fail(field, f"must be a list of variables' names, not of {_describe(item)}")
        return tuple(item.removeprefix("$") for item in items)

    def pairs(self, field: str, second: str) -> tuple[tuple[str, str], ...]:
        """A list of [NAME, text]; `second` says in errors what the text is."""
        found: list[tuple[str, str]] = []
        for index, item in enumerate(self.items(field)):
            where = f"{field}[{index}]"
            if not (isinstance(item, list) and len(item) == 2 and all(isinstance(part, str) for part in item)):
                self.fail(where, f'must be ["NAME", "{second}"], not {_describe(item)}')
            name, text = item[0].removeprefix("$"), item[1].strip()
            if not _NAME.fullmatch(name):
                self.fail(where, f"{item[0]!r} is no name; use letters, digits and underscores")
            if not text:
                self.fail(where, f"{name} has an empty {second}; give one")
            found.append((name, text))
        return tuple(found)


def _describe(value: Any) -> str:
    if value is None:
        return "null"
    kinds = {
        dict: "an object",
        list: "a list",
        str: "a text",
        bool: "true or false",
        int: "a number",
        float: "a number",
    }
    shown = repr(value)
    return f"{kinds[type(value)]} ({shown if len(shown) <= 40 else shown[:37] + '...'})"
