"""Numbers that several threads take in turns, each of them once."""

from __future__ import annotations

import threading
from typing import Any

from numba import types
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from dorothie_gym.world.compiling import WITHOUT_COUNTS

_lock = threading.Lock()


def take(turns: NDArray[Any]) -> int:
    """The next number: 0, 1, 2, and so on.

    Args:
        turns: (1,) int64, the next number; 0 at first.
    """
    with _lock:
        number = int(turns[0])
        turns[0] += 1
    return number


@intrinsic
def _fetch_and_add(typing_context: Any, turns: Any) -> Any:
    """Compiled, an addition that nothing comes between takes the place of the lock."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.atomic_rmw("add", array.data, context.get_constant(types.int64, 1), "monotonic")

    return types.int64(turns), generate


@overload(take, jit_options=WITHOUT_COUNTS)
def _compiled_take(turns: Any) -> Any:
    def one(turns: Any) -> Any:
        return _fetch_and_add(turns)

    return one
