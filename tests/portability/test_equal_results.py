"""Sessions of every kind have the frozen bits with the abilities of other processors, in fresh processes and caches."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

from dorothie_gym.support.compilation import compiled_folder
from dorothie_gym.support.user_cache import CACHE_VARIABLE
from tests.portability.digests import frozen
from tests.portability.parts import part_names
from tests.portability.processors import SETTINGS, TOGETHER

ROOT = Path(__file__).parents[2]

PARTS = (
    "towns/*", "imported_maps/*", "shared_maps/Town02", "sessions/* text 0", "sessions/brookside word-errors 0",
    "sessions/brookside speech 0", "sessions/brookside camera 0", "camera_observation/*", "console/*", "batches/*",
    "environments/*", "role_exports/*", "shipped_models/* 0",
)  # fmt: skip
"""Parts of every kind."""


def digests(cache: Path, **variables: str) -> dict[str, dict[str, str]]:
    """Plays all kinds of sessions in a new process with caches of its own, except that of the machine code."""
    environment = {**os.environ, **variables, CACHE_VARIABLE: str(cache), "PYTHONPATH": str(ROOT)}
    if (folder := compiled_folder()) is not None:
        environment["NUMBA_CACHE_DIR"] = str(folder)
    command = [sys.executable, "-m", "tests.portability.digests", *PARTS]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, dict[str, str]] = json.loads(done.stdout)
    return found


@pytest.mark.long
@pytest.mark.timeout(1800)  # machine code for any processor is compiled once
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the settings name abilities of x86-64")
@pytest.mark.parametrize(
    "name",
    [name if name in TOGETHER else pytest.param(name, marks=pytest.mark.slow) for name in SETTINGS],
)
def test_all_sessions_are_equal(name: str, tmp_path: Path) -> None:
    kept = frozen()["parts"]
    found = digests(tmp_path / "cache", **SETTINGS[name])
    assert set(found) <= set(part_names(*PARTS)) and len({part.split("/")[0] for part in found}) >= 8
    assert {part for part in found if found[part] != kept[part]} == set()
