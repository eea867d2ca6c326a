"""Pool of threads for work that is shorter than the time to wake a thread."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numba import types
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from dorothie_gym.compilation import WITHOUT_COUNTS, concurrent

LOOKS: Final = 20_000
"""Number of polls of a gate before its thread sleeps: some 0.1 ms, as in OpenMP's libraries."""

_SHUT, _OPEN, _SLEPT_AT = 0, 1, 2

_lock = threading.Lock()


class Gate:
    """Gate at which one thread waits until another one opens it; it shuts behind the thread that passes.

    The waiting thread polls for a while, without Python's lock, and then sleeps: waking it again takes 0.05 to 0.1 ms.
    """

    def __init__(self) -> None:
        self._state = np.zeros(1, dtype=np.int64)
        self._bell = threading.Semaphore(0)

    def pass_through(self) -> None:
        """Returns when the gate is opened, or has been since one passed it last."""
        if not _find_open(self._state, LOOKS):
            self._bell.acquire()

    def open(self) -> None:
        """Lets one pass; it must have passed before the gate is opened again."""
        if _find_sleeper(self._state):
            self._bell.release()


class Crew:
    """Threads that do the same work at the same time as the caller.

    They end when the crew is closed or no longer referenced.
    """

    def __init__(self, others: int) -> None:
        """Start threads.

        Args:
            others: how many beside the caller's own.
        """
        self._hands = [_Hand() for _ in range(others)]
        for number, hand in enumerate(self._hands):
            threading.Thread(target=hand.work, name=f"crew-{number}", daemon=True).start()
        self._end = weakref.finalize(self, _send_home, self._hands)

    def do(self, work: Callable[..., None], arguments: Callable[[int], tuple[Any, ...]]) -> None:
        """Calls `work(*arguments(k))` in each thread, k = 0 in the caller's, and waits for all of them.

        Raises:
            RuntimeError: the crew was closed.
            Exception: the first that `work` raised, after all threads are done.
        """
        if not self._end.alive:
            raise RuntimeError("the threads were let go: nothing can be done any more")
        for number, hand in enumerate(self._hands, start=1):
            hand.call(work, arguments(number))
        try:
            work(*arguments(0))
        finally:
            errors = [hand.wait() for hand in self._hands]
        for error in errors:
            if error is not None:
                raise error

    def close(self) -> None:
        """Lets the threads go."""
        self._end()


class _Hand:
    """State shared by a thread and its caller."""

    def __init__(self) -> None:
        self._called, self._done = Gate(), Gate()
        self._job: tuple[Callable[..., None], tuple[Any, ...]] | None = None
        self._error: BaseException | None = None

    def call(self, work: Callable[..., None], arguments: tuple[Any, ...]) -> None:
        self._job = (work, arguments)
        self._called.open()

    def wait(self) -> BaseException | None:
        self._done.pass_through()
        error, self._error = self._error, None
        return error

    def go(self) -> None:
        self._job = None
        self._called.open()

    def work(self) -> None:
        while True:
            self._called.pass_through()
            if self._job is None:
                return
            work, arguments = self._job
            try:
                work(*arguments)
            except BaseException as error:  # the caller raises it
                self._error = error
            del work, arguments
            self._job = None
            self._done.open()


def _send_home(hands: list[_Hand]) -> None:
    for hand in hands:
        hand.go()


def _change(state: NDArray[np.int64], expected: int, new: int) -> int:
    """Writes a number where the one stands that is expected; returns what stood there. Nothing comes between."""
    with _lock:
        found = int(state[0])
        if found == expected:
            state[0] = new
        return found


@intrinsic
def _compare_and_swap(typing_context: Any, state: Any, expected: Any, new: Any) -> Any:
    """Compiled, the processor's own instruction takes the place of the lock."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        found = builder.cmpxchg(array.data, arguments[1], arguments[2], "seq_cst", "seq_cst")
        return builder.extract_value(found, 0)

    return types.int64(state, types.int64, types.int64), generate


@overload(_change, jit_options=WITHOUT_COUNTS)
def _compiled_change(state: Any, expected: Any, new: Any) -> Any:
    def change(state: Any, expected: Any, new: Any) -> Any:
        return _compare_and_swap(state, expected, new)

    return change


@concurrent
def _find_open(state: NDArray[np.int64], looks: int) -> bool:
    """Shuts a gate that is open, or opens while it is looked at; else leaves word that it is slept at."""
    for _ in range(looks):
        if _change(state, _OPEN, _SHUT) == _OPEN:
            return True
    return _change(state, _SHUT, _SLEPT_AT) == _OPEN and _change(state, _OPEN, _SHUT) == _OPEN


@concurrent
def _find_sleeper(state: NDArray[np.int64]) -> bool:
    """Opens a gate; if a thread sleeps at it, leaves it shut, since the semaphore lets the thread pass."""
    return _change(state, _SHUT, _OPEN) == _SLEPT_AT and _change(state, _SLEPT_AT, _SHUT) == _SLEPT_AT
