"""Compilation of the world's inner loops with numba.

With ``NUMBA_DISABLE_JIT=1`` all functions stay plain Python. Compiled ones keep IEEE arithmetic (no fastmath), and
their machine code is cached on disk. Where numba finds no folder to cache in, every process compiles them again,
and one ``RuntimeWarning`` explains how to avoid it.

numba recompiles a function when its own file changes, not when a compiled function that it calls does: after an edit of
one delete the ``*.nbi`` files beside its callers (an installation renews all files at once).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TypeVar

import numba

F = TypeVar("F", bound=Callable[..., object])

WITHOUT_COUNTS: dict[str, bool] = {"_nrt": False}
"""numba's option that turns reference counting off."""

_warned = False


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
    """As `compiled`, without the global interpreter lock: other Python threads run meanwhile."""
    return _compile(function, **WITHOUT_COUNTS, nogil=True)


def inlined(function: F) -> F:
    """As `compiled`, and inlined into its callers: for functions that run for every vehicle in every substep.

    A call passes a tuple of thirty arrays as two hundred numbers, which takes longer than many small functions.
    """
    return _compile(function, **WITHOUT_COUNTS, forceinline=True)


def _compile(function: F, **options: bool) -> F:
    # numba's stubs know only some of the options
    try:
        cached: F = numba.njit(cache=True, fastmath=False, **options)(function)  # pyright: ignore[reportCallIssue, reportArgumentType]
        return cached
    except RuntimeError as error:
        if "no locator available" not in str(error):
            raise
    _warn_once()
    uncached: F = numba.njit(cache=False, fastmath=False, **options)(function)  # pyright: ignore[reportCallIssue, reportArgumentType]
    return uncached


def _warn_once() -> None:
    global _warned
    if not _warned:
        _warned = True
        warnings.warn(
            "numba can write its cache neither beside the installed package nor in the home folder: the world is "
            "compiled again in every process. Set NUMBA_CACHE_DIR to a writable folder.",
            RuntimeWarning,
            stacklevel=4,
        )
