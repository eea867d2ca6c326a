"""Copies of sessions: values that copies share, lookups that copies repeat, and states kept in memory.

`copy.deepcopy` and `pickle` copy every environment exactly, because the classes inside follow two rules:

- An instance that never changes (a town, a path, an utterance) is `shared` by all copies.
- Cached look-ups (such as views on the arrays of a world) are dropped from a copy, which looks them up again
  (`CachedViews`).

A `State` holds the changing values of one object. It is cheaper than a copy, and any number of sessions can continue
from it.
"""

from __future__ import annotations

import enum
import hashlib
import io
import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from types import FunctionType, NotImplementedType
from typing import ClassVar, Final, Generic, TypeVar

import numpy as np

from dorothie_gym.errors import StateError, short_repr

T = TypeVar("T")

_SHARED: set[type] = set()
"""Classes whose instances never change."""

_CONSTANTS: Final = enum.Enum, type, FunctionType, np.dtype
"""Kinds of values that are the same in a whole process."""


def shared(kind: type[T]) -> type[T]:
    """Marks a class whose instances never change: copies and states refer to the same instance."""
    _SHARED.add(kind)
    kind.__deepcopy__ = _itself  # type: ignore[attr-defined]  # the protocol of the module `copy`
    return kind


def _itself(value: T, memo: dict[int, object]) -> T:
    return value


class CachedViews:
    """Base class of objects that keep looked up values, such as views on arrays that another object owns.

    A copied view would show other memory than the copied array. So copies begin without.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ()
    """Attributes that hold looked up values; without them, the next use looks the values up."""

    def __getstate__(self) -> dict[str, object]:
        values = self.__dict__.copy()
        for name in self.CACHED_VIEWS:
            values.pop(name, None)
        return values


class State:
    """Changing values of an environment, an engine or a world at one moment: an opaque, immutable value.

    It refers to immutable objects, such as the town.

    Attributes:
        nbytes: memory of the values, without shared objects [bytes].
    """

    __slots__ = ("_fits", "_shared", "_values")

    def __init__(self, owner: object, values: dict[str, object], fits: Mapping[str, object]) -> None:
        """Keeps values.

        Args:
            owner: object that the values belong to; references to it lead to the one that takes them up again.
            values: stored values.
            fits: name and value of each property that must be equal in the object that restores the values.
        """
        self._fits = dict(fits)
        self._values, self._shared = _pack(owner, values)

    @property
    def nbytes(self) -> int:
        """Memory of the values, without shared objects [bytes]."""
        return len(self._values)

    def values(self, owner: object, fits: Mapping[str, object]) -> dict[str, object]:
        """Returns a new copy of the values for an object; `fits` as above.

        Raises:
            StateError: the state belongs to another town, or to other settings.
        """
        for name, wanted in fits.items():
            found = self._fits.get(name)
            if found is not wanted and found != wanted:
                raise StateError(
                    f"the state is one of {_difference(name, found, wanted)}: "
                    "restore it in an environment that was made with the same arguments"
                )
        values: dict[str, object] = _Unpickler(self._values, [owner, *self._shared]).load()
        return values

    def __repr__(self) -> str:
        return f"<State of {self.nbytes} bytes>"


def taken(values: dict[str, object], name: str, kind: type[T]) -> T:
    """Removes one of the values that `mutable_values` has returned, and returns it.

    Raises:
        StateError: it is of another type: the values are of another class.
    """
    value = values.pop(name)
    if not isinstance(value, kind):
        raise StateError(
            f"{name} is {short_repr(value)}, not of the type {kind.__name__}: the state is of another class"
        )
    return value


def _difference(name: str, found: object, wanted: object) -> str:
    """Returns the actual and the expected value, with the first field, key or item in which they differ."""
    for part, one, other in _parts(found, wanted):
        if one is not other and one != other:
            return _difference(f"{name}, {part}" if "," not in name else f"{name}.{part}", one, other)
    return f"{name} {short_repr(found)}, not {short_repr(wanted)}"


def _parts(found: object, wanted: object) -> Iterator[tuple[str, object, object]]:
    """Yields the parts that two values have in common, by name; none of values that are of different kinds."""
    if type(found) is not type(wanted):
        return
    if is_dataclass(found):
        for field in fields(found):
            yield field.name, getattr(found, field.name), getattr(wanted, field.name)
    elif isinstance(found, Mapping) and isinstance(wanted, Mapping):
        for key in [key for key in found if key in wanted]:
            yield str(key), found[key], wanted[key]
    elif isinstance(found, list | tuple) and isinstance(wanted, list | tuple):
        for number, (one, other) in enumerate(zip(found, wanted, strict=False)):
            yield f"item {number}", one, other


def digest_of(value: object) -> str:
    """Returns a digest of the content of nested dataclasses, mappings, sequences, arrays and plain values, in hex."""
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest: hashlib._Hash, value: object) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        digest.update(f"{{{len(value)}".encode())
        for name in sorted(value):
            _feed(digest, [name, value[name]])
    elif isinstance(value, list | tuple):
        digest.update(f"[{len(value)}".encode())
        for item in value:
            _feed(digest, item)
    elif is_dataclass(value):
        digest.update(f"({type(value).__name__}".encode())
        for field in fields(value):
            _feed(digest, getattr(value, field.name))
    else:
        digest.update(f"{value!r};".encode())


@shared
@dataclass(frozen=True)
class Unchanged(Generic[T]):
    """A value inside a state that is kept as it is, such as the state of a policy, which no policy modifies."""

    value: T


class Restorable:
    """Base class of objects that can be restored to a state, also of another object made with the same arguments."""

    MUTABLE_ATTRIBUTES: ClassVar[Sequence[str]] = ()
    """Attributes that hold changing values."""

    def clone_state(self) -> State:
        """Returns the current state, for `restore_state`: an opaque value that later steps do not change.

        The states of generators are part of it; those of the spaces (`sample()`) and rendered pictures are not.
        """
        return State(self, self.mutable_values(), self.compatibility())

    def restore_state(self, state: State) -> None:
        """Restores a state, any number of times; the state does not change.

        Args:
            state: state of this object, or of another one that was made with the same arguments.

        Raises:
            StateError: the state is of another town or other settings, or not a state.
        """
        if not isinstance(state, State):
            raise StateError(f"state is {short_repr(state)}; it must be a value that clone_state() has returned")
        values = state.values(self, self.compatibility())
        self.apply_values(values)

    def mutable_values(self) -> dict[str, object]:
        """Returns the changing values by name."""
        return {name: getattr(self, name) for name in self.MUTABLE_ATTRIBUTES}

    def apply_values(self, values: dict[str, object]) -> None:
        """Applies the values that `mutable_values` has returned."""
        self.__dict__.update(values)

    def compatibility(self) -> dict[str, object]:
        """Returns names and values that must be equal to restore a state."""
        return {"a": type(self).__name__}


# --- Bytes in memory: made here, read here, never from a file ---------------------------------------------------------

_OWNER: Final = 0


def _pack(owner: object, values: object) -> tuple[bytes, list[object]]:
    """Returns values as bytes, and the shared objects that they refer to by number."""
    buffer = io.BytesIO()
    pickler = _Pickler(buffer, owner)
    pickler.dump(values)
    return buffer.getvalue(), pickler.shared


def _by_number(number: int) -> object:
    raise StateError("a reference of a state was read outside of it")


class _Pickler(pickle.Pickler):
    def __init__(self, buffer: io.BytesIO, owner: object) -> None:
        super().__init__(buffer, pickle.HIGHEST_PROTOCOL)
        self._owner = owner
        self.shared: list[object] = []

    def reducer_override(self, value: object) -> tuple[Callable[[int], object], tuple[int]] | NotImplementedType:
        if value is self._owner:
            return _by_number, (_OWNER,)
        if value is _by_number or not (type(value) in _SHARED or isinstance(value, _CONSTANTS)):
            return NotImplemented  # type: ignore[no-any-return]  # typeshed has no type for it
        self.shared.append(value)
        return _by_number, (len(self.shared),)


class _Unpickler(pickle.Unpickler):
    def __init__(self, values: bytes, objects: list[object]) -> None:
        super().__init__(io.BytesIO(values))
        self._objects = objects

    def find_class(self, module: str, name: str) -> object:
        if name == "_by_number" and module == __name__:
            return self._objects.__getitem__
        return super().find_class(module, name)
