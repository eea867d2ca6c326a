"""Field specifications, from which spaces and documentation are built; sizes of spaces, texts, buffers of arrays."""

from __future__ import annotations

import enum
import multiprocessing
import string
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from multiprocessing.sharedctypes import SynchronizedArray
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Self, SupportsIndex, TypeAlias

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import (
    batch_differing_spaces,
    create_shared_memory,
    read_from_shared_memory,
    write_to_shared_memory,
)
from numpy.typing import DTypeLike, NDArray

from dorothie_gym.errors import short_repr
from dorothie_gym.support.copying import CachedViews, shared
from dorothie_gym.tasks.storyboard import MESSAGE_LENGTH as MESSAGE_LENGTH

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

# --- Texts in shared memory -------------------------------------------------------------------------------------------
# Text space whose values reach `gymnasium.vector.AsyncVectorEnv` through shared memory.
#
# `AsyncVectorEnv` reads its shared memory once, when it is made. Arrays are views on the memory; the texts of
# `gymnasium.spaces.Text` are copies of its content at that time, and are never updated (Gymnasium 1.0 to 1.4). The
# functions that this module registers for its own class return a tuple that reads the memory whenever it is used.


class SharedText(spaces.Text):
    """`gymnasium.spaces.Text` with values that `AsyncVectorEnv` sees in shared memory; equal to a `Text` of its values.

    A row of the memory has the length of the text, then the code points of its characters.
    """


class SharedTexts(tuple[str, ...]):
    """Texts of several environments in shared memory: a tuple of their current values.

    Like the arrays, it changes with the next step if `AsyncVectorEnv` was made with `copy=False`. Copies are
    plain tuples. The object itself is an empty tuple: code that ignored its methods would fail, not see old texts.
    """

    _rows: NDArray[np.int32]

    def __new__(cls, rows: NDArray[np.int32]) -> SharedTexts:
        """Returns a view on the rows of the memory (environments, 1 + greatest length)."""
        texts = super().__new__(cls)
        texts._rows = rows
        return texts

    def __iter__(self) -> Iterator[str]:
        return iter([_text_of(row) for row in self._rows])

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, place: SupportsIndex | slice) -> Any:
        return tuple(self)[place]

    def __contains__(self, text: object) -> bool:
        return text in tuple(self)

    def __repr__(self) -> str:
        return repr(tuple(self))

    def __eq__(self, other: object) -> bool:
        return tuple(self) == (tuple(other) if isinstance(other, tuple) else other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment]  # its value changes

    def __lt__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) < tuple(other)

    def __le__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) <= tuple(other)

    def __gt__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) > tuple(other)

    def __ge__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) >= tuple(other)

    def __add__(self, other: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(self) + tuple(other)

    def __radd__(self, other: tuple[Any, ...]) -> tuple[Any, ...]:
        return other + tuple(self)

    def __mul__(self, times: SupportsIndex) -> tuple[str, ...]:
        return tuple(self) * times

    __rmul__ = __mul__

    def index(self, text: object, *bounds: SupportsIndex) -> int:
        """Returns the place of a text, as `tuple.index`."""
        return tuple(self).index(text, *bounds)

    def count(self, text: object) -> int:
        """Returns the number of environments with a text."""
        return tuple(self).count(text)

    def __deepcopy__(self, memo: dict[int, object]) -> tuple[str, ...]:
        return tuple(self)

    def __reduce__(self) -> tuple[type, tuple[list[str]]]:
        return tuple, ([*self],)


def _text_of(row: NDArray[np.int32]) -> str:
    """Returns the text of a row of the memory."""
    return "".join(map(chr, row[1 : 1 + row[0]].tolist()))


def _rows_of(space: SharedText, memory: SynchronizedArray[int]) -> NDArray[np.int32]:
    """Returns the memory as rows (environments, 1 + greatest length)."""
    buffer: Any = memory.get_obj()  # typeshed does not know that ctypes arrays are buffers
    return np.frombuffer(buffer, dtype=np.int32).reshape(-1, 1 + space.max_length)


@create_shared_memory.register(SharedText)
def _create(space: SharedText, n: int = 1, ctx: ModuleType = multiprocessing) -> SynchronizedArray[int]:
    memory: SynchronizedArray[int] = ctx.Array(np.dtype(np.int32).char, n * (1 + space.max_length))
    return memory


@read_from_shared_memory.register(SharedText)
def _read(space: SharedText, shared_memory: SynchronizedArray[int], n: int = 1) -> SharedTexts:
    return SharedTexts(_rows_of(space, shared_memory))


@write_to_shared_memory.register(SharedText)
def _write(space: SharedText, index: int, value: str, shared_memory: SynchronizedArray[int]) -> None:
    if len(value) > space.max_length:
        raise ValueError(
            f"a text has {len(value)} characters, and its space at most {space.max_length}: {short_repr(value)}"
        )
    row = _rows_of(space, shared_memory)[index]
    row[1 : 1 + len(value)] = [*map(ord, value)]
    row[0] = len(value)


# looked up by the exact type of a space, not by its base classes
batch_differing_spaces.register(SharedText, batch_differing_spaces.dispatch(spaces.Text))


# --- Sizes of the spaces, and texts -----------------------------------------------------------------------------------
# Sizes of the observation and action spaces, equal for all towns by default, and text normalisation.

TEXT_CHARACTERS = string.ascii_letters + string.digits + string.punctuation + " \n"
"""Permitted characters of utterances, messages and stories."""

UTTERANCE_LENGTH = 160
"""Greatest length of one span of an utterance [characters]."""

MEANING_LENGTH = 640
"""Greatest length of the propositions of one span, as JSON [characters]."""

STORY_LENGTH = 2400
"""Greatest length of a story [characters]."""

LANE_METRES = 1024
"""Number of positions on a lane, in whole metres; no lane of a known town is longer [m]."""

UNBOUNDED = 1e6
"""Bound of quantities without a natural bound; far beyond all positions [m], speeds [m/s] and times [s]."""

PERCENT = 101
"""Number of steps of a share in percent, 0 to 100."""


@shared
@dataclass(frozen=True, kw_only=True)
class SpaceLimits:
    """Numbers of rows and ids in observation and action spaces.

    The defaults cover the four towns of the paper (at most 486 lanes, 33 junctions, 14 streets; appendix C) and ours:
    a policy trained in one town can act in another.

    Attributes:
        lanes: number of lane ids.
        junctions: number of junction indices.
        streets: number of street indices.
        landmarks: rows of `landmarks`.
        subgoals: rows of `subgoals`.
        objects: rows of `objects`.
        exits: rows of `exits`.
        waypoints: rows of `waypoints`.
        spans: spans of an utterance.
        plan: junctions of a plan, and lanes of a path.
        props: rows of `props`.

    Raises:
        ValueError: if a size is below 1; names the field.
    """

    lanes: int = 640
    junctions: int = 64
    streets: int = 32
    landmarks: int = 16
    subgoals: int = 8
    objects: int = 16
    exits: int = 8
    waypoints: int = 20
    spans: int = 4
    plan: int = 12
    props: int = 16

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value < 1:
                raise ValueError(f"SpaceLimits.{name} is {value}; it must be at least 1")

    @classmethod
    def for_town(cls, town: Town) -> SpaceLimits:
        """Returns the default sizes, enlarged where the town needs it."""
        return cls.for_towns((town,))

    @classmethod
    def for_towns(cls, towns: Iterable[Town]) -> SpaceLimits:
        """Returns the default sizes, enlarged where one of the towns needs it."""
        towns = tuple(towns)
        return cls(
            lanes=max(cls.lanes, *(len(town.lanes) for town in towns)),
            junctions=max(cls.junctions, *(len(town.junctions) for town in towns)),
            streets=max(cls.streets, *(len(town.streets) for town in towns)),
        )


_PLAIN = str.maketrans({"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "..."})
_KNOWN = frozenset(TEXT_CHARACTERS)


def plain_text(text: str, length: int) -> str:
    """Returns text in `TEXT_CHARACTERS`, truncated to `length`; accents are removed, typographic marks replaced."""
    if text.isascii() and text.isprintable():
        return text[:length]
    spelt = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    return "".join(c for c in spelt if c in _KNOWN)[:length]


# --- Fields -----------------------------------------------------------------------------------------------------------

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
