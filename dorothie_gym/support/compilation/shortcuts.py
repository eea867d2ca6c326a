"""Shorter ways through numba's compiler for functions that count no references: the same code in less time.

numba looks for the type of every operator among all its overloads, which fails dozens of times before it succeeds;
after each pass it computes where variables are used for the last time, to clear them there, so that nothing is freed
twice; and it looks for closures, lists, contexts and loops over tuples, which these functions do not have.
"""

from __future__ import annotations

from functools import cache
from operator import getitem
from types import BuiltinFunctionType
from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.compiler import DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.ir_utils import build_definitions
from numba.core.rewrites import rewrite_registry
from numba.core.ssa import reconstruct_ssa
from numba.core.transforms import canonicalize_cfg
from numba.core.typed_passes import (
    AnnotateTypes,
    InlineOverloads,
    NoPythonBackend,
    NoPythonSupportedFeatureValidation,
    NopythonTypeInference,
)
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    RewriteDynamicRaises,
    RewriteSemanticConstants,
    TranslateByteCode,
)

from dorothie_gym.support.compilation.numba_classes import (
    Context,
    GenericRewrites,
    Lower,
    NativeLowering,
    PassManager,
    PreLowerStripPhis,
    ReconstructSSA,
)

if TYPE_CHECKING:
    from numba.core.compiler_machinery import CompilerPass
    from numba.core.typing.templates import Signature


class RememberingContext(Context):
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
        self, func: types.Type | BuiltinFunctionType, args: tuple[types.Type, ...], kws: dict[str, types.Type]
    ) -> Signature | None:
        """Returns the signature of a call."""
        called = func.typing_key if isinstance(func, types.Function) else func  # operators come without a type
        if kws or not isinstance(called, BuiltinFunctionType | type):
            return super().resolve_function_type(func, args, kws)
        if called is getitem and isinstance(args[0], types.Array):
            args = args[0], types.unliteral(args[1])  # numba makes new types of constants, which are all the same here
        call = (func, *args)
        identities = tuple(map(id, call))  # numba has one object for each type, and takes long to compare them
        if identities in _signatures:
            return _signatures[identities][1]
        signature: Signature | None = super().resolve_function_type(func, args, kws)
        if signature is not None:
            _signatures[identities] = call, signature
        return signature


_signatures: dict[tuple[int, ...], tuple[tuple[object, ...], Signature]] = {}
"""Signatures of calls, by the identities of function and arguments, which are kept alive."""


@cache
def remembering(context: Context) -> RememberingContext:
    """Returns the view on a typing context that remembers."""
    return RememberingContext(context)


class _Lower(Lower):
    def alloca_lltype(self, name: str, lltype: ir.Type, datamodel: object = None) -> ir.Instruction:
        """Makes room for a variable, without its size for debuggers, for which numba compiles a module each time."""
        return cgutils.alloca_once(self.builder, lltype, name=name)

    def delvar(self, name: str) -> None:
        """Keeps the value of a variable that is not used any more: there is nothing to free."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    _name = "lowering_without_counts"

    @property
    def lowering_class(self) -> type[Lower]:
        return _Lower


@register_pass(mutates_CFG=True, analysis_only=False)
class _Rewrites(GenericRewrites):
    _name = "rewrites_without_counts"

    def run_pass(self, state: Any) -> bool:
        """Applies numba's rewrites before types are inferred, without a look at the lifetimes of variables."""
        blocks = state.func_ir.blocks
        for kind in rewrite_registry.rewrites["before-inference"]:
            rewrite = kind(state)
            for key in list(blocks):
                while rewrite.match(state.func_ir, blocks[key], state.typemap, state.calltypes):
                    blocks[key] = rewrite.apply()
        return True


@register_pass(mutates_CFG=False, analysis_only=False)
class _ToSSA(ReconstructSSA):
    _name = "ssa_without_counts"

    def run_pass(self, state: Any) -> bool:
        """Gives every variable one assignment, without a look at lifetimes."""
        state.func_ir = reconstruct_ssa(state.func_ir)
        self._patch_locals(state)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=False, analysis_only=False)
class _FromSSA(PreLowerStripPhis):
    _name = "strip_phis_without_counts"

    def run_pass(self, state: Any) -> bool:
        """Makes assignments of phi nodes, without a look at lifetimes."""
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return True


class _Passes(PassManager):
    """Passes one after the other, without events, times and lifetimes of variables between them."""

    def _runPass(self, _index: int, each: CompilerPass, state: Any) -> None:  # noqa: N802  # numba's name
        each.analysis = self._analysis
        each.run_pass(state)
        if isinstance(each, TranslateByteCode):
            state.func_ir.blocks = canonicalize_cfg(state.func_ir.blocks)


_KEPT = (
    TranslateByteCode, FixupArgs, RewriteSemanticConstants, DeadBranchPrune, RewriteDynamicRaises,
    NopythonTypeInference, InlineOverloads, NoPythonSupportedFeatureValidation, AnnotateTypes, NoPythonBackend,
)  # fmt: skip
"""numba's passes that are kept as they are."""

_REPLACED: dict[type[CompilerPass], type[CompilerPass]] = {
    GenericRewrites: _Rewrites,
    ReconstructSSA: _ToSSA,
    PreLowerStripPhis: _FromSSA,
    NativeLowering: _Lowering,
}


def without_counts(state: Any) -> PassManager:
    """Returns numba's passes, without those that only functions with reference counts need."""
    passes = _Passes("nopython")
    for each, name in DefaultPassBuilder.define_nopython_pipeline(state).passes:
        if each in _KEPT or each in _REPLACED:
            passes.add_pass(_REPLACED.get(each, each), name)
    passes.finalize()
    return passes
