"""Work for the processes of the tests, which find it by its module."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path


def squares() -> Callable[[int], int]:
    return lambda number: number**2


def refusing() -> Callable[[int], int]:
    def work(number: int) -> int:
        if number == 3:
            raise ValueError("three is too much")
        return number

    return work


def counting_up() -> Callable[[int], Iterator[int]]:
    def work(number: int) -> Iterator[int]:
        yield from range(number)
        if number == 3:
            raise ValueError("three is too much")

    return work


def dying() -> Callable[[int], int]:
    def work(number: int) -> int:
        os.kill(os.getpid(), signal.SIGKILL)
        return number

    return work


def refusing_sessions() -> Callable[[object], object]:
    def refuse(task: object) -> object:
        raise ValueError("the town is closed")

    return refuse


def writing() -> Callable[[str], int]:
    return lambda path: Path(path).write_bytes(b"full")
