"""Faults in the servers for people, at random moments: nothing acknowledged is lost, and nothing erased is left."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from tests.faults import count_faults, spoil_erasures, sweep

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits the files of another process")


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_the_servers_for_people_keep_their_word_through_300_faults(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    found = sweep(tmp_path, times=300, seed=request.config.getoption("--malformed-seed"))
    assert sum(map(count_faults, found.values())) >= 300
    assert found["annotation"]["edits"] > 0 and found["console"]["heard"] > 0, found
    assert found["studies"]["answers"] > 0 and found["studies"]["withdrawn"] > 0, found


def test_faults_at_random_writes_of_erasures_leave_nothing(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    found = spoil_erasures(tmp_path, times=12, seed=request.config.getoption("--malformed-seed"))
    assert sum(found.values()) == 12
