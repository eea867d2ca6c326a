"""Servers of studies that are killed while people take part: nothing acknowledged is lost, nothing erased is left."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from tests.lab.studies.killing import kill_again_and_again

SLOW = pytest.mark.slow, pytest.mark.timeout(3000)


@pytest.mark.parametrize("times", [pytest.param(2, marks=pytest.mark.long), pytest.param(60, marks=SLOW)])
def test_a_server_that_is_killed_at_random_moments_keeps_its_word(
    tmp_path: Path, request: pytest.FixtureRequest, times: int
) -> None:
    found = kill_again_and_again(tmp_path, times=times, seed=request.config.getoption("--malformed-seed"))
    assert found["kills"] == times and found["answers"] > 0 and found["withdrawn"] > 0, found
