"""Compilation of the world's inner loops with numba.

With ``NUMBA_DISABLE_JIT=1`` all functions stay plain Python. Compiled ones keep IEEE arithmetic (no fastmath), and
their machine code is cached on disk. Where numba finds no folder to cache in, they are compiled anew in every process,
and one ``RuntimeWarning`` says how to avoid it.

numba recompiles a function when its own file changes, not when a compiled function that it calls does: after an edit of
one delete the ``*.nbi`` files beside its callers (an installation renews all files at once).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])

WITHOUT_COUNTS: dict[str, bool] = {"_nrt": False}
"""Numba's option that leaves out the counting of references."""

_warned = False


def allocating(function: F) -> F:
    """Compile a function that may make arrays: numba counts references to all of them."""
    return _compile(function)


def compiled(function: F) -> F:
    """Compile a function that makes no arrays, works on those that it is given, and counts no references.

    numba counts a reference for every array that is taken from a tuple or handed to another function. Loops that hand
    on tuples of thirty arrays spent seven eighths of their time with it. Counting keeps memory alive; here the caller's
    arrays do so. A function that makes arrays is refused by numba with a `TypingError`.
    """
    return _compile(function, **WITHOUT_COUNTS)


def concurrent(function: F) -> F:
    """As `compiled`, and other threads of Python go on meanwhile (the function holds no global interpreter lock)."""
    return _compile(function, **WITHOUT_COUNTS, nogil=True)


def inlined(function: F) -> F:
    """As `compiled`, and woven into its callers: for what is called for every vehicle in every substep.

    A call hands on a tuple of thirty arrays as two hundred numbers, which takes longer than many a function.
    """
    return _compile(function, **WITHOUT_COUNTS, forceinline=True)


def _compile(function: F, **options: bool) -> F:
    try:
        return numba.njit(cache=True, fastmath=False, **options)(function)  # type: ignore[no-any-return]
    except RuntimeError as error:
        if "no locator available" not in str(error):
            raise
    _warn_once()
    return numba.njit(cache=False, fastmath=False, **options)(function)  # type: ignore[no-any-return]


def _warn_once() -> None:
    global _warned
    if not _warned:
        _warned = True
        warnings.warn(
            "numba can write its cache neither beside the installed package nor in the home folder: the world is "
            "compiled anew in every process. Set NUMBA_CACHE_DIR to a writable folder.",
            RuntimeWarning,
            stacklevel=4,
        )
