from __future__ import annotations

import pytest

from benchmarks.vector import environment_speeds, measure


def test_worlds_are_stepped_with_one_and_several_threads() -> None:
    found = measure("brookside", worlds=4, vehicles=3, pedestrians=1, repeats=3, calls=2, environments=0)
    assert found["threads"] == 2 and found["worlds"] == 4
    assert found["scaling"] > 0.0 and found["spread"] >= 0.0 and 0.0 < found["processors"] < 2.5
    assert min(found["substeps_per_second"], found["substeps_per_second_one_thread"]) > 1000
    assert 0.0 < found["locked"] < 1.0


@pytest.mark.slow
def test_environments_are_stepped_in_all_vector_modes_of_gymnasium() -> None:
    found = environment_speeds(2, 20, repeats=1)
    assert list(found) == ["vector_steps_per_second", "sync_steps_per_second", "async_steps_per_second"]
    assert found["vector_steps_per_second"] > 2 * found["sync_steps_per_second"]
