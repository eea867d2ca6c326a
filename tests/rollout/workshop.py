"""Work for the processes of the tests, which find it by its module."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable


def squares() -> Callable[[int], int]:
    return lambda number: number**2


def refusing() -> Callable[[int], int]:
    def work(number: int) -> int:
        if number == 3:
            raise ValueError("three is too much")
        return number

    return work


def dying() -> Callable[[int], int]:
    def work(number: int) -> int:
        os.kill(os.getpid(), signal.SIGKILL)
        return number

    return work
