from __future__ import annotations

import pytest

from dorothie_gym.bench.workers import Worker
from dorothie_gym.errors import BenchmarkProcessError


def test_a_worker_that_cannot_begin_says_why() -> None:
    with (
        Worker("nothing_of_the_kind") as worker,
        pytest.raises(BenchmarkProcessError, match="No module named .*nothing_of"),
    ):
        worker.wait()
