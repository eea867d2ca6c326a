"""Field specifications, from which spaces and documentation are built, and buffers for the arrays of a space."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import DTypeLike, NDArray

from dorothie_gym.session.spaces.limits import TEXT_CHARACTERS, UNBOUNDED
from dorothie_gym.session.spaces.shared_text import SharedText
from dorothie_gym.support.copying import CachedViews

AnySpace: TypeAlias = spaces.Space[Any]
"""Space whose kind of values is not known statically."""


class FieldKind(enum.StrEnum):
    """Kind of the values of a field, by the Gymnasium space that holds them."""

    REAL = "Box"
    CHOICE = "Discrete"
    CHOICES = "MultiDiscrete"
    FLAGS = "MultiBinary"
    TEXT = "Text"


class Column(enum.IntEnum):
    """Column of a table field; members are written `NAME = index, unit, meaning`.

    Attributes:
        unit: unit of the values; "1" for dimensionless values and ids.
        meaning: content of the column.
    """

    unit: str
    meaning: str

    # No member uses the defaults: they let type checkers accept the look-up by number, `Enum(3)`.
    def __new__(cls, value: int, unit: str = "", meaning: str = "") -> Self:
        """Creates a member from its index, unit and meaning."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.unit = unit
        member.meaning = meaning
        return member


@dataclass(frozen=True, kw_only=True)
class FieldSpec:
    """Specification of one field of a `Dict` space.

    Create specifications with `real`, `choice`, `choices`, `flags` and `text`.

    Attributes:
        name: key of the field.
        kind: kind of the values.
        meaning: content of the field, for documentation.
        shape: shape of the values; () for a choice and for text.
        low: lower bound of the values; shortest length of a text [characters].
        high: upper bound of the values, inclusive; greatest length of a text [characters].
        unit: unit of the values; "1" for dimensionless values and ids.
        columns: enum of the columns of a table (the last axis), or None.
    """

    name: str
    kind: FieldKind
    meaning: str
    shape: tuple[int, ...] = ()
    low: float
    high: float
    unit: str = "1"
    columns: type[Column] | None = None

    @property
    def dtype(self) -> str:
        """Name of the numpy dtype of the values; "str" for text."""
        if self.kind is FieldKind.TEXT:
            return "str"
        return {FieldKind.REAL: "float64", FieldKind.FLAGS: "int8"}.get(self.kind, "int64")

    @property
    def range(self) -> str:
        """Permitted values for documentation, e.g. "[0, 15]"."""
        if self.kind is FieldKind.TEXT:
            return f"up to {self.high:g} characters"
        return f"[{self.low:g}, {self.high:g}]"

    def space(self) -> AnySpace:
        """Builds the Gymnasium space of the field."""
        low, high = int(self.low), int(self.high)
        match self.kind:
            case FieldKind.REAL:
                return spaces.Box(self.low, self.high, self.shape, dtype=np.float64)
            case FieldKind.CHOICE:
                return spaces.Discrete(high - low + 1, start=low)
            case FieldKind.CHOICES:
                return spaces.MultiDiscrete([high + 1] * self.shape[0])
            case FieldKind.FLAGS:
                return spaces.MultiBinary(self.shape[0] if len(self.shape) == 1 else self.shape)
            case FieldKind.TEXT:
                return SharedText(high, min_length=low, charset=TEXT_CHARACTERS)


def real(
    name: str,
    *shape: int,
    meaning: str,
    unit: str = "1",
    low: float = -UNBOUNDED,
    high: float = UNBOUNDED,
    columns: type[Column] | None = None,
) -> FieldSpec:
    """Returns the specification of a float64 array; the number of columns is appended to the shape of a table."""
    full = (*shape, len(columns)) if columns is not None else shape
    return FieldSpec(
        name=name, kind=FieldKind.REAL, shape=full, low=low, high=high, unit=unit, meaning=meaning, columns=columns
    )


def signal(name: str, size: int, *, meaning: str, unit: str = "1", low: float = -1.0) -> FieldSpec:
    """Returns the specification of a part of a vector with values in [low, 1]; `unit` is the scale of the values."""
    return real(name, size, meaning=meaning, unit=unit, low=low, high=1.0)


def share(name: str, size: int, *, meaning: str, unit: str = "1") -> FieldSpec:
    """Returns the specification of a part of a vector with values in [0, 1]; `unit` is the scale of the values."""
    return signal(name, size, meaning=meaning, unit=unit, low=0.0)


def choice(name: str, count: int, *, meaning: str, unit: str = "1", start: int = 0) -> FieldSpec:
    """Returns the specification of an integer in [start, start + count)."""
    return FieldSpec(name=name, kind=FieldKind.CHOICE, low=start, high=start + count - 1, unit=unit, meaning=meaning)


def choices(name: str, count: int, length: int, *, meaning: str) -> FieldSpec:
    """Returns the specification of an array of `length` integers in [0, count)."""
    return FieldSpec(name=name, kind=FieldKind.CHOICES, shape=(length,), low=0, high=count - 1, meaning=meaning)


def flags(name: str, *shape: int, meaning: str) -> FieldSpec:
    """Returns the specification of an array of 0 and 1."""
    return FieldSpec(name=name, kind=FieldKind.FLAGS, shape=shape, low=0, high=1, meaning=meaning)


def text(name: str, length: int, *, meaning: str) -> FieldSpec:
    """Returns the specification of a text of 0 to `length` characters from `TEXT_CHARACTERS`."""
    return FieldSpec(name=name, kind=FieldKind.TEXT, low=0, high=length, meaning=meaning)


def sizes(fields: Iterable[FieldSpec]) -> Mapping[str, int]:
    """Returns the sizes of the parts of a vector by name, in order."""
    return MappingProxyType({field.name: field.shape[0] for field in fields})


def dict_space(fields: Iterable[FieldSpec]) -> spaces.Dict:
    """Builds the `Dict` space of several fields."""
    return spaces.Dict({field.name: field.space() for field in fields})


# --- buffers ----------------------------------------------------------------------------------------------------------

Shape: TypeAlias = tuple[int, ...]
"""Shape of an array."""

Arrays: TypeAlias = dict[str, NDArray[Any]]
"""Arrays of several types, by name."""


class FieldBuffer(CachedViews):
    """Arrays of fixed types and shapes in one block of memory, with a leading axis of rows.

    A copy of the block costs as much as the copy of one array. The caller owns the copy; later changes of the buffer do
    not reach it.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("arrays",)

    def __init__(self, fields: Mapping[str, tuple[DTypeLike, Shape]], rows: int = 1) -> None:
        """Allocates arrays of zeros.

        Args:
            fields: type and shape of a row of each array, by name.
            rows: number of rows.
        """
        self._layout = np.dtype([(name, kind, (rows, *shape)) for name, (kind, shape) in fields.items()], align=True)
        # of a single row: the same places in memory, without the leading axis
        self._row = np.dtype([(name, *each) for name, each in fields.items()], align=True) if rows == 1 else None
        self._block: NDArray[np.uint8] = np.zeros(self._layout.itemsize, dtype=np.uint8)
        self._names = tuple(fields)

    @cached_property
    def arrays(self) -> Arrays:
        """The arrays (rows, ...), by name."""
        return self._arrays(self._block)

    @classmethod
    def of_space(cls, space: spaces.Dict, rows: int = 1) -> Self:
        """Returns a buffer for all fields of a space that are numbers."""
        numbers = {name: field for name, field in space.spaces.items() if not isinstance(field, spaces.Text)}
        return cls({name: (np.dtype(field.dtype), field.shape or ()) for name, field in numbers.items()}, rows)

    def copy(self) -> Arrays:
        """Returns a copy of all rows: arrays (rows, ...) by name."""
        return self._arrays(self._block.copy())

    def copy_row(self, row: int) -> Arrays:
        """Returns a copy of a row: arrays, and NumPy integers for fields without axes, by name."""
        if self._row is not None:
            record = np.ndarray(1, self._row, self._block.copy())[0]
            return {name: record[name] for name in self._names}
        return {name: array[row].copy() for name, array in self.arrays.items()}

    def clear(self, row: int) -> None:
        """Sets a row to zeros."""
        for array in self.arrays.values():
            array[row] = 0

    def _arrays(self, block: NDArray[np.uint8]) -> Arrays:
        record = np.ndarray((), self._layout, block)
        return {name: record[name] for name in self._names}
