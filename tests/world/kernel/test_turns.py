"""Threads that take numbers in turns."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.world.compiling import concurrent
from dorothie_gym.world.kernel.turns import take

NUMBERS = 20_000


def in_python(turns: NDArray[np.int64], marks: NDArray[np.int64]) -> None:
    """Marks the numbers that it gets."""
    number = take(turns)
    while number < len(marks):
        marks[number] += 1
        number = take(turns)


@pytest.mark.parametrize("work", [in_python, concurrent(in_python)], ids=["plain", "compiled"])
def test_every_number_is_taken_once(work: Callable[[NDArray[np.int64], NDArray[np.int64]], None]) -> None:
    turns, marks = np.zeros(1, dtype=np.int64), np.zeros(NUMBERS, dtype=np.int64)
    with ThreadPoolExecutor(4) as threads:
        for done in [threads.submit(work, turns, marks) for _ in range(4)]:
            done.result()
    assert (marks == 1).all()
    assert turns[0] == NUMBERS + 4  # and every thread was told once that there is none left
