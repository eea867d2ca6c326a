"""Pool of threads for work that is shorter than the time to wake a thread, and the queue that the threads share."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numba import types
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from dorothie_gym.support.compilation import WITHOUT_COUNTS, concurrent

if TYPE_CHECKING:
    from llvmlite.ir import IRBuilder, Value
    from numba.core.base import BaseContext
    from numba.core.typing.context import BaseContext as TypingContext
    from numba.core.typing.templates import Signature

    IntrinsicCode: TypeAlias = tuple[Signature, Callable[[BaseContext, IRBuilder, Signature, Sequence[Value]], Value]]

LOOKS: Final = 20_000
"""Number of polls of a gate before its thread sleeps: some 0.1 ms, as in OpenMP's libraries."""

_SHUT, _OPEN, _SLEPT_AT = 0, 1, 2

_lock = threading.Lock()


class Gate:
    """Gate at which one thread waits until another one opens it; it closes once a thread has passed.

    The waiting thread polls for a while, without Python's lock, and then sleeps: waking it again takes 0.05 to 0.1 ms.
    """

    def __init__(self) -> None:
        self._state = np.zeros(1, dtype=np.int64)
        self._semaphore = threading.Semaphore(0)

    def pass_through(self) -> None:
        """Returns when the gate is opened, or at once if it was opened since the last passage."""
        if not _find_open(self._state, LOOKS):
            self._semaphore.acquire()

    def open(self) -> None:
        """Lets one thread pass; the gate may be opened again after it has passed."""
        if _find_sleeper(self._state):
            self._semaphore.release()


class ThreadPool:
    """Threads that do the same work at the same time as the caller.

    They end when the pool is closed or no longer referenced.
    """

    def __init__(self, others: int) -> None:
        """Starts threads.

        Args:
            others: number of threads besides the caller's own.
        """
        self._workers = [_Worker() for _ in range(others)]
        for number, worker in enumerate(self._workers):
            threading.Thread(target=worker.work, name=f"pool-{number}", daemon=True).start()
        self._end = weakref.finalize(self, _stop_all, self._workers)

    def do(self, work: Callable[..., None], arguments: Callable[[int], tuple[object, ...]]) -> None:
        """Calls `work(*arguments(k))` in each thread, k = 0 in the caller's, and waits for all of them.

        Raises:
            RuntimeError: the pool was closed.
            Exception: the first that `work` raised, after all threads are done.
        """
        if not self._end.alive:
            raise RuntimeError("the thread pool is closed; make another one")
        for number, worker in enumerate(self._workers, start=1):
            worker.call(work, arguments(number))
        try:
            work(*arguments(0))
        finally:
            errors = [worker.wait() for worker in self._workers]
        for error in errors:
            if error is not None:
                raise error

    def close(self) -> None:
        """Ends the threads."""
        self._end()


class _Worker:
    """State shared by a thread and its caller."""

    def __init__(self) -> None:
        self._called, self._done = Gate(), Gate()
        self._job: tuple[Callable[..., None], tuple[object, ...]] | None = None
        self._error: BaseException | None = None

    def call(self, work: Callable[..., None], arguments: tuple[object, ...]) -> None:
        self._job = (work, arguments)
        self._called.open()

    def wait(self) -> BaseException | None:
        self._done.pass_through()
        error, self._error = self._error, None
        return error

    def stop(self) -> None:
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


def _stop_all(workers: list[_Worker]) -> None:
    for worker in workers:
        worker.stop()


def _change(state: NDArray[np.int64], expected: int, new: int) -> int:
    """Replaces the number if it is the expected one, atomically; returns the previous number."""
    with _lock:
        found = int(state[0])
        if found == expected:
            state[0] = new
        return found


@intrinsic
def _compare_and_swap(
    _context: TypingContext, state: types.Type, expected: types.Type, new: types.Type
) -> IntrinsicCode:
    """Emits a compare-and-swap instruction, which replaces the lock in compiled code."""

    def generate(context: BaseContext, builder: IRBuilder, signature: Signature, arguments: Sequence[Value]) -> Value:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        found = builder.cmpxchg(array.data, arguments[1], arguments[2], "seq_cst", "seq_cst")
        return builder.extract_value(found, 0)

    return types.int64(state, types.int64, types.int64), generate


@overload(_change, jit_options=WITHOUT_COUNTS)
def _compiled_change(state: types.Type, expected: types.Type, new: types.Type) -> Callable[..., int]:
    # numba requires the same annotations as above
    def change(state: types.Type, expected: types.Type, new: types.Type) -> int:
        found: int = _compare_and_swap(state, expected, new)
        return found

    return change


@concurrent
def _find_open(state: NDArray[np.int64], looks: int) -> bool:
    """Shuts a gate that is open or opens during the polls; else marks that a thread sleeps at it."""
    for _ in range(looks):
        if _change(state, _OPEN, _SHUT) == _OPEN:
            return True
    return _change(state, _SHUT, _SLEPT_AT) == _OPEN and _change(state, _OPEN, _SHUT) == _OPEN


@concurrent
def _find_sleeper(state: NDArray[np.int64]) -> bool:
    """Opens a gate; if a thread sleeps at it, the gate stays shut and the semaphore lets the thread pass."""
    return _change(state, _SHUT, _OPEN) == _SLEPT_AT and _change(state, _SLEPT_AT, _SHUT) == _SLEPT_AT


# --- Work queue -------------------------------------------------------------------------------------------------------

LINE = 8
"""Integers per cache line: counters in one line cannot be written at the same time (false sharing)."""


def turns_of(count: int, threads: int) -> NDArray[np.int64]:
    """Returns the numbers 0 to `count` - 1, all free, in as many blocks as there are threads.

    Returns:
        (threads, LINE): of each block the next number and the one after its last.
    """
    turns = np.zeros((threads, LINE), dtype=np.int64)
    borders = np.arange(threads + 1) * count // threads
    turns[:, 0], turns[:, 1] = borders[:-1], borders[1:]
    return turns


def take(turns: NDArray[np.int64], home: int) -> int:
    """Takes the next number of the thread's block, whose worlds are cached, and then those of other blocks.

    Args:
        turns: see `turns_of`.
        home: number of the thread's block.

    Returns:
        A number that no other thread receives, or -1 if none is left.
    """
    for k in range(len(turns)):
        block = turns[(home + k) % len(turns)]
        with _lock:
            if block[0] < block[1]:
                block[0] += 1
                return int(block[0]) - 1
    return -1


@intrinsic
def _fetch_and_add(_context: TypingContext, turns: types.Type) -> IntrinsicCode:
    """Emits an atomic addition, which replaces the lock in compiled code."""

    def generate(context: BaseContext, builder: IRBuilder, signature: Signature, arguments: Sequence[Value]) -> Value:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.atomic_rmw("add", array.data, context.get_constant(types.int64, 1), "monotonic")

    return types.int64(turns), generate


@overload(take, jit_options=WITHOUT_COUNTS)
def _compiled_take(turns: types.Type, home: types.Type) -> Callable[..., int]:
    # numba requires the same annotations as above
    def one(turns: types.Type, home: types.Type) -> int:
        for k in range(len(turns)):
            block = (home + k) % len(turns)
            if turns[block, 0] < turns[block, 1]:
                number: int = _fetch_and_add(turns[block])
                if number < turns[block, 1]:
                    return number
        return -1

    return one
