"""Reader of action dicts that checks each field against its space.

The bounds of a space are looked up once (`ActionFieldTable`). Valid values pass with a few comparisons; every other
value goes through slower checks that produce the error message.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium import spaces

from dorothie_gym.errors import did_you_mean, short_repr
from dorothie_gym.support.action_values import as_array, whole_number

_ONE_BYTE = "bB?"
"""Codes of the one-byte dtypes, whose raw bytes are the values."""

_FLAGS = b"\0\1"

OPTIONAL_FIELDS = frozenset({"meaning", "onset", "pace"})
"""Fields that an action dict may leave out; texts are then empty, and numbers 0."""


class ActionFieldTable:
    """Bounds of the fields of an action space.

    Attributes:
        names: names of all fields, in the order of the space.
        known: the same names as a set.
        ranges: smallest and greatest value of each integer field.
        shapes: shape of each array field.
        tops: greatest value of each array entry, flattened.
        texts: greatest length and permitted characters of each text field.
        idle: values of fields that a dict may leave out.
    """

    def __init__(self, space: spaces.Dict, idle: Mapping[str, object] | None = None) -> None:
        """Looks up the bounds of a space.

        Args:
            space: the action space.
            idle: values of fields that a dict may leave out; None to require all but `OPTIONAL_FIELDS`.
        """
        self.names = tuple(space)
        self.known = frozenset(space)
        self.idle = {} if idle is None else idle
        self.ranges: dict[str, tuple[int, int]] = {}
        self.shapes: dict[str, tuple[int, ...]] = {}
        self.tops: dict[str, list[int]] = {}
        self.texts: dict[str, tuple[int, frozenset[str]]] = {}
        for name, field in space.spaces.items():
            if isinstance(field, spaces.Discrete):
                self.ranges[name] = int(field.start), int(field.start + field.n) - 1
            elif isinstance(field, spaces.MultiDiscrete):
                self.shapes[name], self.tops[name] = field.shape, (field.nvec - 1).ravel().tolist()
            elif isinstance(field, spaces.MultiBinary):
                self.shapes[name], self.tops[name] = field.shape, [1] * int(np.prod(field.shape))
            elif isinstance(field, spaces.Text):
                self.texts[name] = field.max_length, frozenset(field.character_set)


class ActionReader:
    """Reader of the fields of one action dict."""

    __slots__ = ("_action", "_table")

    def __init__(self, action: Mapping[str, object], table: ActionFieldTable) -> None:
        """Wraps an action dict; raises `ValueError` if a field is missing or unknown."""
        self._action, self._table = action, table
        if action.keys() != table.known:
            fields = ", ".join(table.names)
            unknown = [name for name in action if name not in table.known]
            if unknown:
                hint = did_you_mean(str(unknown[0]), table.names)
                raise ValueError(f"field {short_repr(unknown[0])} is unknown; {hint}the fields are {fields}")
            self._action = {**table.idle, **action}
            missing = [name for name in table.names if name not in self._action and name not in OPTIONAL_FIELDS]
            if missing:
                raise ValueError(f"field {missing[0]!r} is missing; the fields are {fields}")

    def integer(self, name: str) -> int:
        """Returns an integer field; raises `ValueError` if it is not an integer or is out of range."""
        low, high = self._table.ranges[name]
        value = self._action.get(name, 0) if name in OPTIONAL_FIELDS else self._action[name]
        if type(value) is int and low <= value <= high:
            return value
        if isinstance(value, np.ndarray) and value.ndim != 0:
            raise ValueError(f"field {name!r} is {short_repr(value)}; it must be a whole number in {low}..{high}")
        return whole_number(f"field {name!r}", value, low, high)

    def integers(self, names: Sequence[str]) -> list[int]:
        """Returns several integer fields; errors as in `integer`."""
        ranges, action = self._table.ranges, self._action
        found = []
        for name in names:
            low, high = ranges[name]
            value = action[name]
            found.append(value if type(value) is int and low <= value <= high else self.integer(name))
        return found

    def numbers(self, name: str) -> list[int]:
        """Returns the flattened entries of an integer array; raises `ValueError` for a wrong shape, dtype or value."""
        shape, tops = self._table.shapes[name], self._table.tops[name]
        value = as_array(f"field {name!r}", self._action[name])
        if value.shape != shape or value.dtype.kind not in "iub":
            raise ValueError(
                f"field {name!r} has shape {value.shape} and type {short_repr(value.dtype)}; "
                f"it must hold whole numbers in shape {shape}"
            )
        found: list[int] = value.ravel().tolist()
        if min(found) < 0 or (max(found) > min(tops) and any(map(operator.gt, found, tops))):
            raise ValueError(f"field {name!r} has a value outside 0..{max(tops)}")
        return found

    def flags(self, name: str) -> bytes:
        """Returns the flattened entries of an array of 0 and 1 as bytes; errors as in `numbers`."""
        value = self._action[name]
        if type(value) is np.ndarray and value.shape == self._table.shapes[name] and value.dtype.char in _ONE_BYTE:
            raw = value.tobytes()
            if not raw.translate(None, _FLAGS):
                return raw
        return bytes(self.numbers(name))

    def text(self, name: str) -> str:
        """Returns a text field; raises `ValueError` for another type, excess length or characters outside the space."""
        length, characters = self._table.texts[name]
        value = self._action.get(name, "") if name in OPTIONAL_FIELDS else self._action[name]
        if type(value) is str and not value:
            return value
        if not isinstance(value, str):
            raise ValueError(f"field {name!r} is a {short_repr(type(value).__name__)}; it must be a text")
        if len(value) > length:
            raise ValueError(f"field {name!r} has {len(value)} characters; at most {length} are taken")
        if not characters.issuperset(value):
            wrong = "".join(sorted(set(value) - characters))
            raise ValueError(f"field {name!r} has characters that the space does not: {short_repr(wrong)}")
        return value
