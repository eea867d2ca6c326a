"""Compilation of the world's inner loops with numba.

With ``NUMBA_DISABLE_JIT=1`` all functions stay plain Python. Compiled ones keep IEEE arithmetic (no fastmath).
Functions that Python calls are compiled as a whole (`dispatcher`), with large tuples of arrays passed by address
(`by_reference`), and their machine code is kept in the user's cache folder under a hash of their content (`cache`).
Where the folder cannot be written, every process compiles again, and one ``RuntimeWarning`` explains how to avoid it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from typing import TypeVar, cast

import numpy as np
from numba.core import config
from numpy.typing import NDArray

from dorothie_gym.support.compilation.cache import ContentCache, compiled_folder
from dorothie_gym.support.compilation.dispatcher import WITHOUT_COUNTS, CompiledFunction, portable

__all__ = [
    "WITHOUT_COUNTS",
    "CompiledFunction",
    "allocating",
    "compiled",
    "compiled_folder",
    "concurrent",
    "direct",
    "fixed",
    "inlined",
    "portable",
]

F = TypeVar("F", bound=Callable[..., object])


def allocating(function: F) -> F:
    """Compiles a function that may create arrays, with numba's reference counting."""
    return _compile(function)


def compiled(function: F) -> F:
    """Compiles a function that creates no arrays, without reference counting.

    numba counts a reference for every array that is taken from a tuple or passed to another function. Loops that pass
    tuples of thirty arrays spent seven eighths of their time on it. Counting keeps memory alive; here the caller's
    arrays do so. For a function that creates arrays numba raises a `TypingError`.
    """
    return _compile(function, **WITHOUT_COUNTS)


def concurrent(function: F) -> F:
    """As `compiled`, without the global interpreter lock: other Python threads run at the same time."""
    return _compile(function, **WITHOUT_COUNTS, nogil=True)


def inlined(function: F) -> F:
    """As `compiled`, and inlined into its callers: for functions that run for every vehicle in every substep.

    A call passes a tuple of thirty arrays as two hundred numbers, which takes longer than many small functions.
    """
    return _compile(function, **WITHOUT_COUNTS, forceinline=True)


def direct(function: F) -> F:
    """Makes Python call a compiled function without a look at the types inside of its arguments.

    Before a call numba compares the types of all arrays in all tuples with those of earlier calls, which takes 7 us for
    a town and a world. Here the class of a tuple decides: all tuples of a class must hold arrays of the same types, as
    `WorldArrays` and `TownArrays` do. Arguments are given by position.
    """
    if not isinstance(function, CompiledFunction):
        return function
    entries: dict[tuple[object, ...], Callable[..., object]] = {}

    def call(*arguments: object) -> object:
        kinds = tuple([_kind(each) if isinstance(each, np.ndarray) else type(each) for each in arguments])
        entry = entries.get(kinds)
        if entry is None:
            entry = entries[kinds] = function.entry_for(*arguments)
        return entry(*arguments)

    return cast(F, update_wrapper(call, function.py_func))


def fixed(function: F) -> F:
    """As `direct`, without a look at the types of the arguments: all calls have those of the first call.

    Arrays that differ only in whether they may be written to count as one type.
    """
    if not isinstance(function, CompiledFunction):
        return function
    entry: Callable[..., object] | None = None

    def call(*arguments: object) -> object:
        nonlocal entry
        if entry is None:
            entry = function.entry_for(*arguments)
        return entry(*arguments)

    return cast(F, update_wrapper(call, function.py_func))


def _kind(array: NDArray[np.generic]) -> tuple[object, ...]:
    """Returns the properties that determine the type of an array."""
    return array.dtype, array.ndim, array.flags.num


def _compile(function: F, **options: bool) -> F:
    if config.DISABLE_JIT:
        return function
    dispatcher = CompiledFunction(function, targetoptions={"nopython": True, "fastmath": False, **options})
    dispatcher.keep_in(ContentCache(dispatcher))
    return cast(F, dispatcher)
