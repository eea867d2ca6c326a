from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.wrappers.record_session import RecordSession
from tests.envs.sessions_played import digest, play_at_random, play_by_script

ROOT = Path(__file__).parents[2]

CODE = """
import sys
from pathlib import Path
from tests.envs.test_determinism import recorded

print(*recorded(Path(sys.argv[1])))
"""


def recorded(folder: Path) -> list[str]:
    """Records two sessions; returns digests of all that is observed and done."""
    env = RecordSession(DuoWizardEnv("brookside", max_cycles=40), folder)
    return [
        digest(moment)
        for k, play in enumerate((play_at_random, play_by_script))
        for moment in play(env, seed=11 + k, decisions=40)
    ]


def recorded_in_a_process(folder: Path) -> list[str]:
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "1"}
    done = subprocess.run(
        [sys.executable, "-c", CODE, str(folder)], env=variables, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


@pytest.mark.long
def test_two_processes_observe_and_record_the_same(tmp_path: Path) -> None:
    one = recorded(tmp_path / "one")
    other = recorded_in_a_process(tmp_path / "other")
    assert len(one) == 2 * 41
    assert one == other
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file())
    assert len(files) >= 2 * 3
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes(), str(file)


@pytest.mark.parametrize("play", [play_at_random, play_by_script])
def test_used_environment_plays_equal_session(play: Any) -> None:
    used = DuoWizardEnv("brookside")
    list(play(used, seed=5, decisions=12))
    fresh = [digest(moment) for moment in play(DuoWizardEnv("brookside"), seed=6, decisions=12)]
    assert [digest(moment) for moment in play(used, seed=6, decisions=12)] == fresh


def test_returned_objects_are_not_changed() -> None:
    env = DuoWizardEnv("brookside")
    kept = list(play_at_random(env, seed=3, decisions=8))
    seen = [digest(moment) for moment in play_at_random(DuoWizardEnv("brookside"), seed=3, decisions=8)]
    assert [digest(moment) for moment in kept] == seen


def test_resets_without_seed_continue_the_series() -> None:
    env, other = DuoWizardEnv("brookside"), DuoWizardEnv("brookside")
    for each in (env, other):
        each.reset(seed=8)
    first, second = (digest(env.reset()) for _ in range(2))
    assert first != second
    assert [digest(other.reset()) for _ in range(2)] == [first, second]


def test_different_seeds_give_different_sessions() -> None:
    env = DuoWizardEnv("brookside")
    assert not np.array_equal(env.reset(seed=1)[0]["ad_wizard"]["pose"], env.reset(seed=2)[0]["ad_wizard"]["pose"])
