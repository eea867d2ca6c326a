"""Threads of a pool, and the gates at which they wait."""

from __future__ import annotations

import gc
import threading
import time
from collections.abc import Callable

import pytest

from dorothie_gym.sim.batch.threads import Gate, ThreadPool

LONGER_THAN_LOOKED = 0.02
"""Seconds after which a thread sleeps that waits since."""


def names() -> set[str]:
    return {thread.name for thread in threading.enumerate() if thread.name.startswith("pool-")}


def eventually(holds: Callable[[], bool]) -> bool:
    end = time.monotonic() + 10.0
    while not holds() and time.monotonic() < end:
        time.sleep(0.01)
    return holds()


@pytest.mark.parametrize("others", [0, 1, 3])
def test_every_thread_does_its_part_of_every_job(others: int) -> None:
    pool, done = ThreadPool(others), []
    for job in range(300):
        pool.do(lambda job, part: done.append((job, part)), lambda part, job=job: (job, part))
        if job % 100 == 0:
            time.sleep(LONGER_THAN_LOOKED)
    assert sorted(done) == [(job, part) for job in range(300) for part in range(others + 1)]
    assert [job for job, _ in done] == sorted(job for job, _ in done)
    pool.close()


def test_parts_are_done_at_the_same_time() -> None:
    pool, together = ThreadPool(2), threading.Barrier(3)
    pool.do(lambda part: together.wait(10.0), lambda part: (part,))
    pool.close()


@pytest.mark.parametrize("bad", [0, 1, 2])
def test_errors_are_raised_after_all_parts_and_the_pool_remains_usable(bad: int) -> None:
    pool, done = ThreadPool(2), []

    def work(part: int) -> None:
        if part == bad:
            raise OSError(f"part {part}")
        time.sleep(LONGER_THAN_LOOKED)
        done.append(part)

    with pytest.raises(OSError, match=f"part {bad}"):
        pool.do(work, lambda part: (part,))
    assert sorted(done) == sorted({0, 1, 2} - {bad})
    pool.do(lambda part: done.append(part), lambda part: (part,))
    assert len(done) == 5
    pool.close()


def test_threads_end_when_the_pool_is_closed_or_garbage_collected() -> None:
    before = len(names())
    pool = ThreadPool(2)
    pool.close()
    with pytest.raises(RuntimeError, match="pool is closed"):
        pool.do(print, lambda part: ())
    forgotten = ThreadPool(2)
    del forgotten
    gc.collect()
    assert eventually(lambda: len(names()) <= before)


@pytest.mark.parametrize("pause", [0.0, LONGER_THAN_LOOKED])
def test_a_gate_lets_one_thread_pass_per_opening(pause: float) -> None:
    there, back = Gate(), Gate()
    passed = []

    def walk() -> None:
        for _ in range(20):
            there.pass_through()
            passed.append(len(passed))
            back.open()

    walker = threading.Thread(target=walk)
    walker.start()
    for number in range(20):
        time.sleep(pause)
        assert len(passed) == number
        there.open()
        back.pass_through()
    walker.join(10.0)
    assert passed == list(range(20))
