"""Reading named fields of a JSON object with one clear message for each that is wrong."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Mapping
from typing import Any, TypeVar

from dorothie_gym.sessions.errors import SessionError, shown

_T = TypeVar("_T")

_LARGEST = sys.float_info.max
"""A whole number of JSON may be larger, and is no float then."""


class Fields:
    """The fields of one JSON object.

    Each method returns a field in its type and raises `SessionError` where it is missing or of another type.

    Args:
        values: the object.
        where: file and line, the beginning of every message.
    """

    def __init__(self, values: Mapping[str, Any], where: str) -> None:
        self._values = values
        self.where = where

    def integer(self, name: str, minimum: int | None = None) -> int:
        """A whole number, at least `minimum`."""
        value = self.anything(name)
        if isinstance(value, bool) or not isinstance(value, int) or (minimum is not None and value < minimum):
            raise self.error(name, "a whole number" + ("" if minimum is None else f" of at least {minimum}"))
        return value

    def number(self, name: str) -> float:
        """A finite number."""
        value = self.anything(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
            raise self.error(name, "a finite number")
        return float(value)

    def text(self, name: str) -> str:
        """A text."""
        value = self.anything(name)
        if not isinstance(value, str):
            raise self.error(name, "a text")
        return value

    def flag(self, name: str) -> bool:
        """True or false."""
        value = self.anything(name)
        if not isinstance(value, bool):
            raise self.error(name, "true or false")
        return value

    def mapping(self, name: str) -> Mapping[str, Any]:
        """An object."""
        value = self.anything(name)
        if not isinstance(value, Mapping):
            raise self.error(name, "an object")
        return value

    def texts(self, name: str) -> tuple[str, ...]:
        """A list of texts."""
        value = self.anything(name)
        if not isinstance(value, list | tuple) or not all(isinstance(item, str) for item in value):
            raise self.error(name, "a list of texts")
        return tuple(value)

    def integers(self, name: str) -> tuple[int, ...]:
        """A list of whole numbers."""
        value = self.anything(name)
        if not isinstance(value, list | tuple) or not all(type(item) is int for item in value):
            raise self.error(name, "a list of whole numbers")
        return tuple(value)

    def objects(self, name: str) -> tuple[Fields, ...]:
        """A list of objects."""
        value = self.anything(name)
        if not isinstance(value, list | tuple) or not all(isinstance(item, Mapping) for item in value):
            raise self.error(name, "a list of objects")
        return tuple(Fields(item, f"{self.where}, {name}[{index}]") for index, item in enumerate(value))

    def optional(self, name: str, read: Callable[[str], _T]) -> _T | None:
        """None where the field is null, else what `read` (one of the methods above) makes of it."""
        return None if self.anything(name) is None else read(name)

    def error(self, name: str, expected: str) -> SessionError:
        """The error for a field that is not what is expected."""
        return SessionError(f"{self.where}: field {name!r} is {shown(self._values[name])}; it must be {expected}")

    def if_given(self, name: str, read: Callable[[str], _T]) -> _T | None:
        """None where the field is missing or null, else what `read` makes of it."""
        return read(name) if self._values.get(name) is not None else None

    def others(self, known: Collection[str]) -> dict[str, Any]:
        """The fields whose names are not known."""
        return {name: value for name, value in self._values.items() if name not in known}

    def anything(self, name: str) -> Any:
        """Whatever the field holds."""
        if name not in self._values:
            raise SessionError(f"{self.where}: field {name!r} is missing")
        return self._values[name]
