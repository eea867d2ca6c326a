"""`python -m dorothie_gym.testing`: an installation is checked, and what fails is named."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from dorothie_gym.testing import check_installation
from dorothie_gym.testing.installation import CHECKS, check_cache, check_picture, check_requirements


def broken() -> str:
    raise RuntimeError("no fonts\nhere")


def test_a_check_that_fails_is_one_line_and_the_others_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert not check_installation({"fonts": broken, "cache": check_cache})
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("FAILED fonts") and "RuntimeError: no fonts here" in lines[1]
    assert lines[2].startswith("ok     cache") and lines[-1] == "1 of 2 checks failed"


def test_a_sound_installation_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert check_installation({"requirements": check_requirements, "cache": check_cache})
    assert capsys.readouterr().out.splitlines()[-1] == "The installation works."


def test_a_picture_is_drawn() -> None:
    assert "1280 x 800" in check_picture()


@pytest.mark.long
def test_the_command_runs_outside_the_checkout(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "dorothie_gym.testing"], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert sum(line.startswith("ok ") for line in done.stdout.splitlines()) == len(CHECKS)
