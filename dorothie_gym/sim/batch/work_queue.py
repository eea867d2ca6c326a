"""Work queue: numbers that several threads take, each of them once."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from dorothie_gym.compilation import WITHOUT_COUNTS

LINE = 8
"""Numbers in a line of a processor's cache: counters that lie closer are written to by turns, not at once."""

_lock = threading.Lock()


def turns_of(count: int, threads: int) -> NDArray[np.int64]:
    """Returns the numbers 0 to `count` - 1 in as many blocks as there are threads, none of them taken.

    Returns:
        (threads, LINE): of each block the next number and the one behind its last.
    """
    turns = np.zeros((threads, LINE), dtype=np.int64)
    borders = np.arange(threads + 1) * count // threads
    turns[:, 0], turns[:, 1] = borders[:-1], borders[1:]
    return turns


def take(turns: NDArray[Any], home: int) -> int:
    """Takes the next number of the own block, whose worlds are in the thread's cache; then those of others.

    Args:
        turns: see `turns_of`.
        home: number of the own block.

    Returns:
        A number that no other thread gets, or -1 when there is none left.
    """
    for k in range(len(turns)):
        block = turns[(home + k) % len(turns)]
        with _lock:
            if block[0] < block[1]:
                block[0] += 1
                return int(block[0]) - 1
    return -1


@intrinsic
def _fetch_and_add(typing_context: Any, turns: Any) -> Any:
    """Compiled, an addition that nothing comes between takes the place of the lock."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.atomic_rmw("add", array.data, context.get_constant(types.int64, 1), "monotonic")

    return types.int64(turns), generate


@overload(take, jit_options=WITHOUT_COUNTS)
def _compiled_take(turns: Any, home: Any) -> Any:
    def one(turns: Any, home: Any) -> Any:
        for k in range(len(turns)):
            block = (home + k) % len(turns)
            if turns[block, 0] < turns[block, 1]:
                number = _fetch_and_add(turns[block])
                if number < turns[block, 1]:
                    return number
        return -1

    return one
