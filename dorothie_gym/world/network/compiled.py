"""Compilation of the world's inner loops with numba."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])

_warned = False


def compiled(function: F) -> F:
    """Compile a function for speed, keeping IEEE arithmetic (no fastmath) and caching the machine code on disk.

    With ``NUMBA_DISABLE_JIT=1`` the function stays plain Python. Where numba finds no folder to cache in, the function
    is compiled anew in every process, and one ``RuntimeWarning`` says how to avoid it.

    numba recompiles a function when its own file changes, not when a compiled function that it calls does: after an
    edit of `polyline.py` delete the ``*.nbi`` files beside its callers (an installation renews all files at once).
    """
    try:
        return numba.njit(cache=True, fastmath=False)(function)  # type: ignore[no-any-return]
    except RuntimeError as error:
        if "no locator available" not in str(error):
            raise
    _warn_once()
    return numba.njit(cache=False, fastmath=False)(function)  # type: ignore[no-any-return]


def _warn_once() -> None:
    global _warned
    if not _warned:
        _warned = True
        warnings.warn(
            "numba can write its cache neither beside the installed package nor in the home folder: the world is "
            "compiled anew in every process. Set NUMBA_CACHE_DIR to a writable folder.",
            RuntimeWarning,
            stacklevel=3,
        )
