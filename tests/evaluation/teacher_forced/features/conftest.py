from __future__ import annotations

import pytest

from dorothie_gym.session.recording import Session
from tests.evaluation.teacher_forced.features.played import play


@pytest.fixture(scope="session")
def played(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """A session of the scripted roles in brookside, cut off after 50 s."""
    return play(tmp_path_factory.mktemp("played") / "session", seconds=50.0)
