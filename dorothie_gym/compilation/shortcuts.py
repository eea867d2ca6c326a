"""Shorter ways through numba's compiler for functions that count no references: the same code in less time.

numba looks for the type of every operator among all its overloads, which fails dozens of times before it succeeds; and
it clears variables that are not used any more, so that nothing is freed twice.
"""

from __future__ import annotations

from functools import cache
from types import BuiltinFunctionType
from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.compiler import DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering, NopythonRewrites
from numba.core.typing import Context

if TYPE_CHECKING:
    from numba.core.typing.templates import Signature


class RememberingContext(Context):  # type: ignore[misc]  # numba has no type information
    """View on numba's typing context that remembers the signatures of operators and built-in functions."""

    def __new__(cls, context: Context) -> RememberingContext:
        """Shares all that the context knows, and will know."""
        view: RememberingContext = object.__new__(cls)
        view.__dict__ = context.__dict__
        return view

    def __init__(self, context: Context) -> None:
        """Leaves the shared context as it is."""

    def resolve_value_type(self, val: object) -> types.Type:
        """Returns the type of a constant or function."""
        kind: types.Type | None = self._get_global_type(val) if isinstance(val, BuiltinFunctionType) else None
        if kind is None:
            kind = super().resolve_value_type(val)
        return kind

    def resolve_function_type(
        self, func: types.Type, args: tuple[types.Type, ...], kws: dict[str, types.Type]
    ) -> Signature | None:
        """Returns the signature of a call."""
        if kws or not isinstance(func, types.Function) or not isinstance(func.typing_key, BuiltinFunctionType | type):
            return super().resolve_function_type(func, args, kws)
        call = (func, *args)
        identities = tuple(map(id, call))  # numba has one object for each type, and takes long to compare them
        if identities in _signatures:
            return _signatures[identities][1]
        signature: Signature | None = super().resolve_function_type(func, args, kws)
        if signature is not None:
            _signatures[identities] = call, signature
        return signature


_signatures: dict[tuple[int, ...], tuple[tuple[types.Type, ...], Signature]] = {}
"""Signatures of calls, by the identities of function and arguments, which are kept alive."""


@cache
def remembering(context: Context) -> RememberingContext:
    """Returns the view on a typing context that remembers."""
    return RememberingContext(context)


class _Lower(Lower):  # type: ignore[misc]  # numba has no type information
    def alloca_lltype(self, name: str, lltype: ir.Type, datamodel: object = None) -> ir.Instruction:
        """Makes room for a variable, without its size for debuggers, for which numba compiles a module each time."""
        return cgutils.alloca_once(self.builder, lltype, name=name)

    def delvar(self, name: str) -> None:
        """Keeps the value of a variable that is not used any more: there is nothing to free."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):  # type: ignore[misc]  # numba has no type information
    _name = "lowering_without_counts"

    @property
    def lowering_class(self) -> type[Lower]:
        return _Lower


def without_counts(state: Any) -> PassManager:
    """Returns numba's passes, without those that only functions with reference counts need."""
    passes = DefaultPassBuilder.define_nopython_pipeline(state)
    kept = [(each, name) for each, name in passes.passes if each is not NopythonRewrites]
    passes.passes = [(_Lowering if each is NativeLowering else each, name) for each, name in kept]
    passes.finalize()
    return passes
