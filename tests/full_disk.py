"""Disk on which files can be written up to a size only: the system itself refuses the rest, within a write, too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

resource = pytest.importorskip("resource", reason="limits the size of files, which Windows cannot")


@contextmanager
def full_disk(size: int = 0, process: int = 0) -> Iterator[None]:
    """Lets writes beyond a size of the file fail while the block lasts.

    Args:
        size: the size [bytes].
        process: number of the process, which needs Linux; 0 for this one.
    """
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    set_limit(process, (size, before[1]))
    try:
        yield
    finally:
        set_limit(process, before)


def set_limit(process: int, limits: tuple[int, int]) -> None:
    if process:
        resource.prlimit(process, resource.RLIMIT_FSIZE, limits)
    else:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def wait_for(reached: Callable[[], object], seconds: float = 15.0) -> None:
    """Waits until something is true, at most for a time [s]."""
    end = time.monotonic() + seconds
    while not reached() and time.monotonic() < end:
        time.sleep(0.02)
