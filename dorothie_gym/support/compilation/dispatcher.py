"""Compiled functions: one optimisation for each function that Python calls, not one for each function.

numba makes machine code of every function for every combination of argument types that it meets, each time with all the
functions that it calls linked in and optimised again, and with wrappers for calls from Python. In a simulation whose
step calls 250 functions up to nine deep, most of that work is thrown away. Here a function that is called from compiled
code only becomes unoptimised LLVM code, a part; optimisation and machine code follow once, for the whole that Python
calls.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from operator import getitem
from types import BuiltinFunctionType
from typing import TYPE_CHECKING, Any, TypeVar, cast

from llvmlite import binding, ir
from numba import typeof, types
from numba.core import cgutils, config, event, typing
from numba.core.codegen import CodeLibrary
from numba.core.compiler import DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
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
    Compiler,
    Context,
    CPUDispatcher,
    Flags,
    FunctionCompiler,
    GenericRewrites,
    JITCodeLibrary,
    Lower,
    NativeLowering,
    PassManager,
    PreLowerStripPhis,
    ReconstructSSA,
)

if TYPE_CHECKING:
    from numba.core.compiler import CompileResult
    from numba.core.compiler_machinery import CompilerPass
    from numba.core.typing.templates import Signature

    from dorothie_gym.support.compilation.cache import ContentCache


F = TypeVar("F", bound=Callable[..., object])

WITHOUT_COUNTS: dict[str, bool] = {"_nrt": False}
"""numba's option that turns reference counting off."""


# --- Shortcuts through the compiler -----------------------------------------------------------------------------------
# Shortcuts through numba's compiler for functions that count no references: the same code in less time.
#
# numba looks for the type of every operator among all its overloads, which fails dozens of times before it succeeds;
# after each pass it computes where variables are used for the last time, to clear them there, so that nothing is
# freed twice; and it looks for closures, lists, contexts and loops over tuples, which these functions do not have.


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


# --- Parts and wholes -------------------------------------------------------------------------------------------------


class _Library(JITCodeLibrary):
    """Code of a function and of all that it calls, optimised once."""

    _linking_libraries: list[CodeLibrary]

    def _optimize_functions(self, ll_module: binding.ModuleRef) -> None:
        """Leaves all to the optimisation of the whole."""
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Optimises once: numba's first, cheaper run prepares the removal of reference counts."""
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def finalize(self) -> None:
        """Links all parts, optimises, and makes machine code."""
        for part in _parts_of(self):
            self._reload_init.update(part._reload_init)
            self._final_module.link_in(part.own_module(), preserve=True)
        self._linking_libraries = _others_of(self)
        super().finalize()


class _Part(_Library):
    """Code of a function that only compiled functions call: neither linked nor optimised on its own."""

    def finalize(self) -> None:
        """Leaves linking and optimisation to the whole."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Returns 0: there is no machine code."""
        return 0

    def own_module(self) -> binding.ModuleRef:
        """Returns the code of this function alone, to be linked."""
        return super()._get_module_for_linking()

    def _get_module_for_linking(self) -> binding.ModuleRef:
        """Returns the code with all that it calls, for functions that numba's own decorators compile."""
        module = self.own_module().clone()
        for part in _parts_of(self):
            module.link_in(part.own_module(), preserve=True)
        for library in _others_of(self):
            module.link_in(library._get_module_for_linking(), preserve=True)
        return module


def _parts_of(library: _Library) -> list[_Part]:
    """Returns the parts that a function calls, directly or not."""
    found: dict[_Part, None] = {}
    queue: list[_Library] = [library]
    while queue:
        for called in queue.pop()._linking_libraries:
            if isinstance(called, _Part) and called is not library and called not in found:
                found[called] = None
                queue.append(called)
    return list(found)


def _others_of(library: _Library) -> list[CodeLibrary]:
    """Returns the libraries of numba's own that a function or its parts call."""
    callers = [library, *_parts_of(library)]
    called = dict.fromkeys(each for caller in callers for each in caller._linking_libraries)
    return [each for each in called if not isinstance(each, _Part)]


class _Compiler(Compiler):
    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *others: Any) -> None:
        super().__init__(typingctx, targetctx, library, *others)
        if not self.state.flags.nrt:
            self.state.typingctx = remembering(typingctx)

    def define_pipelines(self) -> list[PassManager]:
        return super().define_pipelines() if self.state.flags.nrt else [without_counts(self.state)]


class _WholeCompiler(_Compiler):
    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *others: Any) -> None:
        super().__init__(typingctx, targetctx, library, *others)
        self.state.library = _Library(self.state.targetctx.codegen(), "whole")
        self.state.library.enable_object_caching()


class _PartCompiler(_Compiler):
    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *others: Any) -> None:
        super().__init__(typingctx, targetctx, library, *others)
        self.state.library = _Part(self.state.targetctx.codegen(), "part")
        self.state.flags.no_compile = True


class OwnFlags(Flags):
    """Options of a compilation, equal to those of numba, that are compared by the values that were set.

    numba's caches have options in their keys. Comparing the values of all options took a tenth of the compiler's time.
    """

    __slots__ = ()

    def __hash__(self) -> int:
        return _FLAGS_HASH

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Flags):
            return NotImplemented
        if self._values == other._values:
            return True
        return all(getattr(self, name) == getattr(other, name) for name in {*self._values, *other._values})


_FLAGS_HASH = hash(Flags())


class _OwnFunctionCompiler(FunctionCompiler):
    def _customize_flags(self, flags: Flags) -> Flags:
        return OwnFlags(flags)


@contextmanager
def _collector_paused() -> Iterator[None]:
    """Turns Python's garbage collector off, if it is on, and on again at the end.

    A compilation makes millions of objects that live until its end: looking through them took a sixth of its time.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _call(entry: Callable[..., object], left_out: tuple[None, ...], *arguments: object) -> object:
    return entry(*arguments, *left_out)


def _widest(kind: types.Type) -> types.Type:
    """Returns the type of an argument for the call, so that numba compiles a function once for all of them.

    Of a constant only its type counts, and every integer is passed as the widest one: fields of records have 32 bits.
    """
    return types.int64 if isinstance(kind, types.Integer) and kind.bitwidth < types.int64.bitwidth else kind


class CompiledFunction(CPUDispatcher):
    """A function that is compiled when it is called from Python, and a part of those that call it."""

    def __init__(self, py_func: Callable[..., object], locals: Any = None, targetoptions: Any = None) -> None:
        options = {**(targetoptions or {}), "no_cfunc_wrapper": True}
        super().__init__(py_func, locals or {}, options, pipeline_class=_WholeCompiler)
        self._compiler = _OwnFunctionCompiler(py_func, self.targetdescr, options, self.locals, _WholeCompiler)
        parts = {**options, "no_cpython_wrapper": True}
        self._part_compiler = _OwnFunctionCompiler(py_func, self.targetdescr, parts, self.locals, _PartCompiler)
        self._parts: dict[tuple[types.Type, ...], CompileResult] = {}
        self._kept_in: ContentCache | None = None

    def keep_in(self, cache: ContentCache) -> None:
        """Keeps machine code in a cache."""
        self._cache = self._kept_in = cache

    def compile(self, sig: Any) -> Any:
        """Returns the machine code for a signature, from memory, the cache or compiled now."""
        with global_compiler_lock, _collector_paused():
            return super().compile(sig)

    def compile_for(self, *examples: object) -> None:
        """Compiles the function for arguments of the types of examples, without a call."""
        kinds = [typeof(example) for example in examples]
        self.compile(tuple(self._compiler.fold_argument_types(kinds, {})[1]))

    def entry_for(self, *examples: object) -> Callable[..., object]:
        """Returns the machine code for arguments of the types of examples, which does not look at types again.

        Machine code takes all arguments, and ignores the values of those that are left out.
        """
        kinds = tuple(self._compiler.fold_argument_types([typeof(example) for example in examples], {})[1])
        entry: Callable[..., object] = self.compile(kinds)
        return partial(_call, entry, (None,) * (len(kinds) - len(examples))) if len(kinds) > len(examples) else entry

    def is_cached(self) -> bool:
        """Returns whether there is machine code of this version of the function on disk."""
        return self._kept_in is not None and not self._kept_in.is_empty()

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Returns the signature of the part that compiled code calls with arguments of the given types."""
        pysig, args = self._compiler.fold_argument_types(args, kws)
        args = tuple(_widest(types.unliteral(kind)) for kind in args)
        part = self._part(args)
        name = self.py_func.__name__
        return (
            typing.make_concrete_template(f"CallTemplate({name})", key=name, signatures=[part.signature]),
            pysig,
            args,
            {},
        )

    def get_overload(self, sig: Any) -> Any:
        """Returns the key under which the part was registered."""
        return self._part(tuple(sig)).fndesc

    def _part(self, args: tuple[types.Type, ...]) -> CompileResult:
        found = self._parts.get(args)
        if found is None:
            with global_compiler_lock:
                with event.trigger_event("numba:compile", data={"dispatcher": self, "args": args, "return_type": None}):
                    found = self._parts[args] = self._part_compiler.compile(args, None)
                self.targetctx.insert_user_function(found.fndesc, found.fndesc, [found.library])
        return found


class InlinedFunction(CompiledFunction):
    """A function of numbers that is a part of compiled functions, and Python when it is called from Python."""

    def __call__(self, *numbers: float) -> object:
        """Runs the function in Python, with numbers of Python's own type, whose arithmetic is the fastest."""
        return self.py_func(*[float(number) for number in numbers])


def portable(function: F) -> F:
    """Decorates like `inlined`; called from Python, the function runs as Python, with the same result.

    For short arithmetic that Python calls rarely: reading machine code at the start would take longer than it saves.
    Integers count as floating-point numbers.
    """
    if config.DISABLE_JIT:
        return function
    return cast("F", InlinedFunction(function, targetoptions={"nopython": True, **WITHOUT_COUNTS, "forceinline": True}))
