"""Threads that take numbers in turns."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.sim.batch.threads import take, turns_of
from dorothie_gym.support.compilation import concurrent

NUMBERS = 20_000


def in_python(turns: NDArray[np.int64], home: int, marks: NDArray[np.int64]) -> None:
    """Marks the numbers that it gets."""
    number = take(turns, home)
    while number >= 0:
        marks[number] += 1
        number = take(turns, home)


@pytest.mark.parametrize("work", [in_python, concurrent(in_python)], ids=["plain", "compiled"])
def test_every_number_is_taken_once(work: Callable[[NDArray[np.int64], int, NDArray[np.int64]], None]) -> None:
    turns, marks = turns_of(NUMBERS, 4), np.zeros(NUMBERS, dtype=np.int64)
    with ThreadPoolExecutor(4) as threads:
        for done in [threads.submit(work, turns, home, marks) for home in (0, 1, 2, 2)]:
            done.result()
    assert (marks == 1).all()


@pytest.mark.parametrize(("count", "threads"), [(7, 3), (2, 2), (5, 1)])
def test_own_block_is_taken_before_the_others(count: int, threads: int) -> None:
    turns = turns_of(count, threads)
    own = turns[threads - 1, :2].tolist()
    taken = [take(turns, threads - 1) for _ in range(count + 1)]
    assert taken[: own[1] - own[0]] == list(range(*own))
    assert sorted(taken) == [-1, *range(count)]
