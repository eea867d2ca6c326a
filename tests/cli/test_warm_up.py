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
from typer import Typer
from typer.testing import CliRunner

from benchmarks.commands import app as benchmarks
from dorothie_gym.cli import warm_up as command
from dorothie_gym.cli.app import app
from dorothie_gym.envs import warm_up as batches
from dorothie_gym.pictures.camera import warm_up as camera
from dorothie_gym.session import warm_up as compiling

NAMES = ("sim.step.step", "sim.step.step_share")
BATCH_NAME = "envs.driving_steps.act_share"
CAMERA_NAME = "camera.shading.shade"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Pretends to compile two functions on a terminal; the list grows by each call's choice to compile everything."""
    found: list[bool] = []

    def compile_two(progress: Callable[[str, int, int], None], *, everything: bool, rare: bool) -> None:
        found.append(everything)
        for done, name in enumerate(NAMES, start=1):
            progress(name, done, len(NAMES))

    def compile_batch(progress: Callable[[str, int, int], None]) -> None:
        progress(BATCH_NAME, 1, 1)

    def compile_camera(progress: Callable[[str, int, int], None], *, rare: bool) -> None:
        progress(CAMERA_NAME, 1, 1)

    monkeypatch.setattr(compiling, "warm_up", compile_two)
    monkeypatch.setattr(camera, "warm_up", compile_camera)
    monkeypatch.setattr(batches, "warm_up", compile_batch)
    monkeypatch.setattr(command, "stderr", lambda: Console(stderr=True, force_terminal=True, width=130))
    return found


def test_warm_up_compiles_everything_and_reports_it(asked: list[bool]) -> None:
    result = CliRunner().invoke(app, ["warm-up"], catch_exceptions=False)
    assert result.exit_code == 0 and asked == [True]
    assert result.stdout.startswith("Compiled 4 functions in 0 s; kept in ")
    assert "Compiling, once per machine" in result.stderr
    assert CAMERA_NAME in result.stderr
    facts = json.loads(CliRunner().invoke(app, ["warm-up", "--json"], catch_exceptions=False).stdout)
    assert facts["functions"] == 4 and facts["seconds"] < 5.0 and Path(facts["folder"]).is_dir()


def test_cold_run_shows_what_is_compiled_before_the_session(asked: list[bool], monkeypatch: pytest.MonkeyPatch) -> None:
    words = ["run", "--max-seconds", "2", "--no-picture"]
    monkeypatch.setattr(compiling, "is_warm", lambda: True)
    warm = CliRunner().invoke(app, words, catch_exceptions=False)
    assert warm.exit_code == 0 and asked == [] and "Compiling" not in warm.stderr
    monkeypatch.setattr(compiling, "is_warm", lambda: False)
    cold = CliRunner().invoke(app, words, catch_exceptions=False)
    assert cold.exit_code == 0 and asked == [False]
    assert "Compiling, once per machine" in cold.stderr and NAMES[-1] in cold.stderr
    assert cold.stdout.splitlines()[0] == warm.stdout.splitlines()[0]  # later lines hold durations


@pytest.mark.parametrize(
    ("program", "words", "stepped"),
    [
        (benchmarks, ["rl"], True),
        (benchmarks, ["vector"], True),
        (benchmarks, ["world"], False),
        (app, ["train-rl", "ppo", "--out", "run", "--workers", "0"], True),
        (app, ["train-rl", "ppo", "--out", "run", "--workers", "2"], False),
    ],
)
def test_commands_that_step_batches_compile_them_first(
    asked: list[bool], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, program: Typer, words: list[str], stepped: bool
) -> None:
    def interrupt(progress: Callable[[str, int, int], None], *, everything: bool, rare: bool) -> None:
        raise KeyboardInterrupt  # the command itself is not to run

    def interrupt_batch(progress: Callable[[str, int, int], None]) -> None:
        progress(BATCH_NAME, 1, 1)
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(batches, "is_warm", lambda: False)
    monkeypatch.setattr(compiling, "is_warm", lambda: stepped)
    if stepped:
        monkeypatch.setattr(batches, "warm_up", interrupt_batch)
    else:
        monkeypatch.setattr(compiling, "warm_up", interrupt)
    result = CliRunner().invoke(program, words)
    assert (BATCH_NAME in result.stderr) is stepped
    assert result.exit_code != 0


def test_warm_up_without_a_cache_is_refused() -> None:
    # the tests' own process has chosen a folder for numba
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA")}
    result = subprocess.run(
        [sys.executable, "-m", "dorothie_gym", "warm-up"],
        capture_output=True,
        text=True,
        check=False,
        env={**inherited, "DOROTHIE_GYM_CACHE": "", "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert result.returncode == 2 and result.stdout == "" and result.stderr.count("\n") == 1
    assert "DOROTHIE_GYM_CACHE is empty" in result.stderr
