"""Classes and functions of numba that the compiler derives from or decorates with.

numba has no type information; the parts in use are declared in the stub beside this file.
"""

from numba.core import types
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import PassManager
from numba.core.datamodel.models import PrimitiveModel
from numba.core.dispatcher import _FunctionCompiler as FunctionCompiler
from numba.core.imputils import lower_builtin, lower_getattr_generic
from numba.core.lowering import Lower
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering, PreLowerStripPhis
from numba.core.typing import Context
from numba.core.typing.templates import AttributeTemplate
from numba.core.untyped_passes import GenericRewrites, ReconstructSSA
from numba.extending import type_callable, typeof_impl, unbox

Type = types.Type

__all__ = [
    "AttributeTemplate",
    "CPUDispatcher",
    "CompileResultCacheImpl",
    "Compiler",
    "Context",
    "Flags",
    "FunctionCache",
    "FunctionCompiler",
    "GenericRewrites",
    "JITCodeLibrary",
    "Lower",
    "NativeLowering",
    "PassManager",
    "PreLowerStripPhis",
    "PrimitiveModel",
    "ReconstructSSA",
    "Type",
    "lower_builtin",
    "lower_getattr_generic",
    "type_callable",
    "typeof_impl",
    "unbox",
]
