"""`dorothie-gym warm-up`, and the progress bar of a command that has to compile first."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from dorothie_gym.cli import warm_up as command
from dorothie_gym.cli.app import app
from dorothie_gym.engine import warm_up as compiling

NAMES = ("sim.step.step", "sim.batch.play_share")


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Pretends to compile two functions on a terminal; the list grows by each call's choice to compile everything."""
    found: list[bool] = []

    def compile_two(progress: Callable[[str, int, int], None], *, everything: bool) -> None:
        found.append(everything)
        for done, name in enumerate(NAMES, start=1):
            progress(name, done, len(NAMES))

    monkeypatch.setattr(compiling, "warm_up", compile_two)
    monkeypatch.setattr(command, "stderr", lambda: Console(stderr=True, force_terminal=True, width=130))
    return found


def test_warm_up_compiles_everything_and_reports_it(asked: list[bool]) -> None:
    result = CliRunner().invoke(app, ["warm-up"], catch_exceptions=False)
    assert result.exit_code == 0 and asked == [True]
    assert result.stdout.startswith("Compiled 2 functions in 0 s; kept in ")
    assert "Compiling, once per machine" in result.stderr and NAMES[-1] in result.stderr
    facts = json.loads(CliRunner().invoke(app, ["warm-up", "--json"], catch_exceptions=False).stdout)
    assert facts["functions"] == 2 and facts["seconds"] < 5.0 and Path(facts["folder"]).is_dir()


def test_cold_run_shows_what_is_compiled_before_the_session(asked: list[bool], monkeypatch: pytest.MonkeyPatch) -> None:
    words = ["run", "--max-seconds", "2", "--no-picture"]
    monkeypatch.setattr(compiling, "is_warm", lambda *, everything: True)
    warm = CliRunner().invoke(app, words, catch_exceptions=False)
    assert warm.exit_code == 0 and asked == [] and "Compiling" not in warm.stderr
    monkeypatch.setattr(compiling, "is_warm", lambda *, everything: False)
    cold = CliRunner().invoke(app, words, catch_exceptions=False)
    assert cold.exit_code == 0 and asked == [False]
    assert "Compiling, once per machine" in cold.stderr and NAMES[-1] in cold.stderr
    assert cold.stdout.splitlines()[0] == warm.stdout.splitlines()[0]  # later lines hold durations


def test_warm_up_without_a_cache_is_refused() -> None:
    # the tests' own process has chosen a folder for numba
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA")}
    result = subprocess.run(
        [sys.executable, "-m", "dorothie_gym", "warm-up"], capture_output=True, text=True, check=False,
        env={**inherited, "DOROTHIE_GYM_CACHE": "", "PYTHONPATH": str(Path(__file__).parents[1])},
    )  # fmt: skip
    assert result.returncode == 2 and result.stdout == "" and result.stderr.count("\n") == 1
    assert "DOROTHIE_GYM_CACHE is empty" in result.stderr
