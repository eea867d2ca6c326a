"""Records that compiled functions work on, field by field: arrays of a class that names the fields.

A record is read and written by attribute (`vehicle.speed`), compiled and in plain Python alike. Its class names the
fields for mypy and makes the dtype of the arrays; at runtime records are NumPy's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Annotated, Any, Protocol, TypeAlias, TypeVar, cast, get_type_hints, overload

import numpy as np
from numpy.typing import NDArray

Float: TypeAlias = Annotated[float, "f8"]
Int32: TypeAlias = Annotated[int, "i4"]
Int64: TypeAlias = Annotated[int, "i8"]
UInt64: TypeAlias = Annotated[int, "u8"]
Flag: TypeAlias = Annotated[bool, "b1"]

Record = TypeVar("Record")


class RecordArray(Protocol[Record]):
    """An array of records of one class, as NumPy's `recarray`; a name selects a column."""

    @property
    def dtype(self) -> np.dtype[np.void]:
        """Fields of the records."""
        ...

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of records along the axes."""
        ...

    @property
    def nbytes(self) -> int:
        """Memory of the array [bytes]."""
        ...

    def __len__(self) -> int: ...

    def __iter__(self) -> Iterator[Record]: ...

    @overload
    def __getitem__(self, key: int | np.integer) -> Record: ...

    @overload
    def __getitem__(self, key: str) -> NDArray[Any]: ...  # its dtype depends on the field

    @overload
    def __getitem__(self, key: slice | NDArray[np.generic]) -> RecordArray[Record]: ...

    def __setitem__(self, key: object, value: object) -> None: ...

    def tolist(self) -> list[tuple[Any, ...]]:
        """Returns the records as tuples of plain numbers."""
        ...

    def tobytes(self) -> bytes:
        """Returns the memory of the records."""
        ...


Row = TypeVar("Row", covariant=True)


class Rows(Protocol[Row]):
    """Sequence in Python, or array in compiled code, for functions that both call."""

    def __len__(self) -> int: ...

    def __getitem__(self, key: int, /) -> Row: ...


def record_dtype(kind: type) -> np.dtype[np.void]:
    """Returns the dtype of a record class, aligned as in C.

    Raises:
        TypeError: a field has the name of an attribute of NumPy's records, which would hide it in plain Python.
    """
    return _dtype_of(kind)


@cache
def _dtype_of(kind: type) -> np.dtype[np.void]:
    hints = get_type_hints(kind, include_extras=True)
    for name in hints:
        if hasattr(np.record, name):
            raise TypeError(f"{kind.__name__}.{name} has the name of an attribute of NumPy's records")
    fields = np.dtype([(name, *hint.__metadata__) for name, hint in hints.items()], align=True)
    # of the scalar type of `recarray`: otherwise each array of records would make a dtype of its own
    return np.dtype((np.record, fields))


def empty_records(kind: type[Record], count: int) -> RecordArray[Record]:
    """Returns an array of `count` records that are all zeros."""
    return cast("RecordArray[Record]", np.zeros(count, dtype=record_dtype(kind)).view(np.recarray))


def filled_records(kind: type[Record], rows: Sequence[tuple[object, ...]]) -> RecordArray[Record]:
    """Returns an array of records with given fields; a single record of zeros where there are none."""
    if not rows:
        return empty_records(kind, 1)
    return cast("RecordArray[Record]", np.array(list(rows), dtype=record_dtype(kind)).view(np.recarray))


def argument(records: RecordArray[Record]) -> RecordArray[Record]:
    """Returns the same records as an array that calls of compiled functions from Python pass several times faster."""
    return cast("RecordArray[Record]", np.ndarray.view(cast("NDArray[np.void]", records), np.ndarray))


def plain(records: RecordArray[Record]) -> NDArray[np.void]:
    """Returns the same records with access by name only, which is several times faster in Python."""
    array = cast("NDArray[np.void]", records)
    return array.view(np.dtype((np.void, array.dtype)), np.ndarray)


def fields(records: RecordArray[Record], *names: str) -> NDArray[np.void]:
    """Returns some fields of the first record as an array without axes, to be read or written at once in Python.

    ``fields(...).item()`` is a tuple of plain numbers, and ``fields(...)[()] = numbers`` takes one, either in about the
    time that a single field of `plain` takes.
    """
    return cast("NDArray[np.void]", records).view(np.ndarray)[list(names)][:1].reshape(())
