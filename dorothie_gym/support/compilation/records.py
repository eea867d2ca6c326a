"""Records that compiled functions work on, field by field, and named tuples of arrays that they pass by address.

A record is read and written by attribute (`vehicle.speed`), compiled and in plain Python alike. Its class names the
fields for mypy and makes the dtype of the arrays; at runtime records are NumPy's own.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Protocol, TypeAlias, TypeVar, cast, get_type_hints, overload

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.models import DataModel
from numba.core.typing.templates import infer_getattr
from numba.extending import NativeValue, register_model
from numba.np.numpy_support import as_dtype
from numpy.typing import NDArray

from dorothie_gym.support.compilation.numba_classes import (
    AttributeTemplate,
    PrimitiveModel,
    Type,
    lower_builtin,
    lower_getattr_generic,
    type_callable,
    typeof_impl,
    unbox,
)

if TYPE_CHECKING:
    from llvmlite.ir import IRBuilder, Value
    from numba.core.base import BaseContext
    from numba.core.typing.templates import Signature

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
    """Returns an array of records with given fields; a single record of zeros if there are none."""
    if not rows:
        return empty_records(kind, 1)
    return cast("RecordArray[Record]", np.array(list(rows), dtype=record_dtype(kind)).view(np.recarray))


def argument(records: RecordArray[Record]) -> RecordArray[Record]:
    """Returns the same records as an array that Python passes to compiled functions several times faster."""
    return cast("RecordArray[Record]", np.ndarray.view(cast("NDArray[np.void]", records), np.ndarray))


def plain(records: RecordArray[Record]) -> NDArray[np.void]:
    """Returns the same records with access by name only, which is several times faster in Python."""
    array = cast("NDArray[np.void]", records)
    return array.view(np.dtype((np.void, array.dtype)), np.ndarray)


def fields(records: RecordArray[Record], *names: str) -> NDArray[np.void]:
    """Returns fields of the first record as an array without axes, which Python can read or write at once.

    ``fields(...).item()`` is a tuple of plain numbers, and ``fields(...)[()] = numbers`` takes one, either in about the
    time that a single field of `plain` takes.
    """
    return cast("NDArray[np.void]", records).view(np.ndarray)[list(names)][:1].reshape(())


# --- Named tuples by address ------------------------------------------------------------------------------------------
# Named tuples of arrays that compiled functions pass by address.
#
# numba passes a named tuple by value, item by item: a tuple of thirty arrays is two hundred arguments of every
# function that takes it, and most of the compiler's work. A class with the decorator `by_reference` is one pointer
# instead, to a table with the address and the shape of each array. Reading an item loads them from the table, which
# never changes during a call, so that LLVM may keep loaded values.
#
# The table is on the stack of the call from Python (or of `gives_row`), whose arguments keep the arrays alive.
# Compiled code reads items; it cannot create such tuples, unpack them, or return them or their arrays to Python.

F = TypeVar("F", bound=Callable[..., object])
T = TypeVar("T", bound=type)

WORD = 8
"""Size of an entry of the table [bytes]: an address, a length, or a number."""


class Reference(Type):
    """numba's type of a named tuple that is passed by address.

    Attributes:
        members: name and type of each item, in order.
        offsets: place of each item in the table [bytes].
        size: size of the table [bytes].
    """

    def __init__(self, name: str, members: tuple[tuple[str, types.Type], ...]) -> None:
        self.members = members
        self.offsets: dict[str, int] = {}
        self.size = 0
        for item, kind in members:
            self.offsets[item] = self.size
            self.size += WORD * (1 + (kind.ndim if isinstance(kind, types.Array) else 0))
        # a short name: it is part of the name of every function that takes the type
        digest = hashlib.sha256("".join(f"{item}:{kind};" for item, kind in members).encode()).hexdigest()
        super().__init__(name=f"{name}.{digest[:16]}")

    @property
    def key(self) -> tuple[str, tuple[tuple[str, types.Type], ...]]:
        """Key by which numba compares types."""
        return self.name, self.members

    def member(self, item: str) -> types.Type | None:
        """Returns the type of an item, None if there is no such item."""
        return dict(self.members).get(item)


@register_model(Reference)
class _Model(PrimitiveModel):
    def __init__(self, dmm: DataModel, fe_type: Reference) -> None:
        super().__init__(dmm, fe_type, ir.IntType(8).as_pointer())


def by_reference(cls: T) -> T:
    """Makes compiled functions take the named tuples of a class by address.

    Raises:
        TypeError: (when a function is called) an item is neither a contiguous array, nor a bool or a number.
    """

    @typeof_impl.register(cls)
    def type_of(value: tuple[object, ...], context: object) -> Reference:
        names: tuple[str, ...] = vars(cls)["_fields"]
        members = tuple(
            (name, _accepted(typeof_impl(item, context), f"{cls.__name__}.{name}"))
            for name, item in zip(names, value, strict=True)
        )
        return Reference(cls.__name__, members)

    return cls


def _accepted(kind: types.Type | None, name: str) -> types.Type:
    if (isinstance(kind, types.Array) and kind.layout == "C") or isinstance(kind, types.Boolean | types.Number):
        return kind
    raise TypeError(f"{name} must be a contiguous array, a bool or a number, not {kind}")


# --- Items ------------------------------------------------------------------------------------------------------------


@infer_getattr
class _Items(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Reference, item: str) -> types.Type | None:
        return kind.member(item)


@lower_getattr_generic(Reference)
def _read(context: BaseContext, builder: IRBuilder, kind: Reference, table: Value, item: str) -> Value:
    member, offset = kind.member(item), kind.offsets[item]
    if not isinstance(member, types.Array):
        value = _load(builder, table, offset, context.get_data_type(member))
        return context.data_model_manager[member].from_data(builder, value)
    model = context.data_model_manager[member]
    array, word = ir.Constant(model.get_value_type(), None), context.get_value_type(types.intp)
    shape = [_load(builder, table, offset + WORD * (1 + axis), word) for axis in range(member.ndim)]
    itemsize = ir.Constant(word, as_dtype(member.dtype).itemsize)
    strides = [itemsize]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    count = shape[0]
    for length in shape[1:]:
        count = builder.mul(count, length)
    pointer = model.get_type("data")
    data = _load(builder, table, offset, context.data_model_manager[pointer].get_value_type())
    fields = {
        "nitems": count,
        "itemsize": itemsize,
        "data": data,
        "shape": cgutils.pack_array(builder, shape),
        "strides": cgutils.pack_array(builder, strides),
    }
    for field, value in fields.items():
        array = builder.insert_value(array, value, model.get_field_position(field))
    return array


def _place(builder: IRBuilder, table: Value, offset: int, kind: ir.Type) -> Value:
    at = builder.gep(table, [ir.Constant(ir.IntType(64), offset)], inbounds=True)
    return builder.bitcast(at, kind.as_pointer())


def _load(builder: IRBuilder, table: Value, offset: int, kind: ir.Type) -> Value:
    value = builder.load(_place(builder, table, offset, kind))
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


# --- Tables -----------------------------------------------------------------------------------------------------------


def _new_table(builder: IRBuilder, kind: Reference) -> Value:
    byte = ir.IntType(8)
    room = cgutils.alloca_once(builder, ir.ArrayType(ir.IntType(64), kind.size // WORD))
    return builder.bitcast(room, byte.as_pointer())


def _finished(builder: IRBuilder, table: Value) -> Value:
    """Hides the origin of the table: LLVM must not move a read of it before its entries are written."""
    pointer = ir.IntType(8).as_pointer()
    return builder.asm(ir.FunctionType(pointer, [pointer]), "", "=r,0,~{memory}", [table], side_effect=True)


@unbox(Reference)
def _unbox(kind: Reference, value: Value, c: Any) -> NativeValue:
    """Writes the table of a tuple from Python."""
    builder, failed = c.builder, cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    table = _new_table(builder, kind)
    for number, (item, member) in enumerate(kind.members):
        part = c.pyapi.tuple_getitem(value, number)
        offset = kind.offsets[item]
        if isinstance(member, types.Array):
            struct = c.context.make_array(member)(c.context, builder)
            pointer = builder.bitcast(struct._getpointer(), c.pyapi.voidptr)
            function = c.pyapi._get_function(
                ir.FunctionType(ir.IntType(32), [c.pyapi.pyobj, c.pyapi.voidptr]), name="numba_adapt_ndarray"
            )
            wrong = cgutils.is_not_null(builder, builder.call(function, (part, pointer)))
            builder.store(struct.data, _place(builder, table, offset, struct.data.type))
            for axis, length in enumerate(cgutils.unpack_tuple(builder, struct.shape, member.ndim)):
                builder.store(length, _place(builder, table, offset + WORD * (1 + axis), length.type))
        else:
            native = c.unbox(member, part)
            wrong = native.is_error
            stored = c.context.data_model_manager[member].as_data(builder, native.value)
            builder.store(stored, _place(builder, table, offset, stored.type))
        builder.store(builder.or_(builder.load(failed), wrong), failed)
    return NativeValue(_finished(builder, table), is_error=builder.load(failed))


def gives_row(function: F) -> F:
    """Makes compiled functions compute a function (batch, number) on the spot: row `number` of each array of a tuple.

    The row is a tuple passed by address, whose table is on the stack of the calling function: it is valid until
    that function returns or reaches the call again.
    """

    @type_callable(function)
    def typing(_context: object) -> Callable[[types.Type, types.Type], Reference | None]:
        return lambda batch, number: _row_type(batch) if isinstance(batch, Reference) else None

    @lower_builtin(function, Reference, types.Integer)
    def generate(context: BaseContext, builder: IRBuilder, signature: Signature, arguments: Sequence[Value]) -> Value:
        batch, row = signature.args[0], signature.return_type
        stacked, at = arguments[0], context.cast(builder, arguments[1], signature.args[1], types.intp)
        table = _new_table(builder, row)
        for item, kind in batch.members:
            array = context.make_array(kind)(context, builder, _read(context, builder, batch, stacked, item))
            shape, strides = (cgutils.unpack_tuple(builder, part, kind.ndim) for part in (array.shape, array.strides))
            first = builder.bitcast(array.data, ir.IntType(8).as_pointer())
            data = builder.bitcast(builder.gep(first, [builder.mul(at, strides[0])]), array.data.type)
            offset = row.offsets[item]
            builder.store(data, _place(builder, table, offset, data.type))
            for axis, length in enumerate(shape[1:]):
                builder.store(length, _place(builder, table, offset + WORD * (1 + axis), length.type))
        return _finished(builder, table)

    return function


def _row_type(batch: Reference) -> Reference:
    members = tuple((item, kind.copy(ndim=kind.ndim - 1)) for item, kind in batch.members)
    return Reference(batch.name.split(".")[0], members)
