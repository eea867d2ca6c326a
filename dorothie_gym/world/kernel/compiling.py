"""Compilation of loops over arrays that they are given and that outlive them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from dorothie_gym.world.network import compiled as with_counts

F = TypeVar("F", bound=Callable[..., Any])

WITHOUT_COUNTS = {"_nrt": False}
"""Numba's option that leaves out the counting of references."""


def compiled(function: F) -> F:
    """Compile a function that allocates no memory, as `network.compiled.compiled` does, without counting references.

    numba counts a reference for every array that is taken from a tuple or handed to another function. Loops that hand
    on tuples of thirty arrays spent seven eighths of their time with it. Counting keeps memory alive; here the caller's
    arrays do so. A function that allocates is refused by numba with a `TypingError`.
    """
    return _compile(function)


def concurrent(function: F) -> F:
    """As `compiled`, and other threads of Python go on meanwhile (the function holds no global interpreter lock)."""
    return _compile(function, nogil=True)


def inlined(function: F) -> F:
    """As `compiled`, and woven into its callers: for what is called for every vehicle in every substep.

    A call hands on a tuple of thirty arrays as two hundred numbers, which takes longer than many a function.
    """
    return _compile(function, forceinline=True)


def _compile(function: F, **options: bool) -> F:
    options = {"fastmath": False, **WITHOUT_COUNTS, **options}
    try:
        return numba.njit(cache=True, **options)(function)  # type: ignore[no-any-return]
    except RuntimeError:
        with_counts.compiled(function)  # raises again, or warns once that there is no cache
    return numba.njit(cache=False, **options)(function)  # type: ignore[no-any-return]
