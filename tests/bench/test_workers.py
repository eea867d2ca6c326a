from __future__ import annotations

import pytest

from dorothie_gym.bench.workers import Worker, WorkerError


def test_a_worker_that_cannot_begin_says_why() -> None:
    with Worker("nothing_of_the_kind") as worker, pytest.raises(WorkerError, match="No module named .*nothing_of"):
        worker.wait()
