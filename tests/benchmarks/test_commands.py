from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

from benchmarks.commands import app

ROOT = Path(__file__).parents[2]
SMALL = ("--town", "brookside", "--vehicles", 2, "--pedestrians", 1, "--repeats", 1)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, list(map(str, arguments)))


def test_without_arguments_the_measurements_are_listed() -> None:
    result = call()
    assert all(name in result.output for name in ("world", "env", "vector", "import"))


@pytest.mark.long
def test_standard_output_is_json_and_nothing_else() -> None:
    command = [sys.executable, "-m", "benchmarks", "world", *map(str, SMALL), "--json"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert done.returncode == 0 and done.stderr == ""
    figures: dict[str, Any] = json.loads(done.stdout)
    assert done.stdout.count("\n") == 1
    promised = {"substeps_per_second", "stock_substeps_per_second", "ratio", "vehicles", "pedestrians", "lanes"}
    assert promised <= set(figures)
    assert not any(Path().iterdir())


def test_table_is_shown_and_chart_is_drawn() -> None:
    result = call("world", *SMALL, "--picture")
    assert result.exit_code == 0, result.output
    for text in ("highway-env's road", "spread", "times real time", "KiB", "numba", "bench_world.png"):
        assert text in result.stdout
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert Path("bench_world.png").read_bytes().startswith(b"\x89PNG")


def test_chart_can_be_drawn_with_json() -> None:
    result = call("world", *SMALL, "--json", "--picture", "c.png")
    assert json.loads(result.stdout)["town"] == "brookside"
    assert Path("c.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("world", "--town", "nowhere"), "known towns are brookside"),
        (("env", "--town", "nowhere", "--json"), "known towns are brookside"),
        (("world", "--vehicles", "-1"), "--vehicles"),
        (("env", "--pedestrians", "201"), "--pedestrians"),
        (("world", "--seed", "x"), "--seed"),
        (("import", "--repeats", "0"), "--repeats"),
        (("vector", "--worlds", "0"), "--worlds"),
        (("world", "--picture", "chart.jpg"), ".png"),
        (("world", "--nonsense"), "--nonsense"),
        (("import", "extra"), "extra"),
    ],
)
def test_invalid_option_is_reported_in_one_line(arguments: tuple[str, ...], said: str) -> None:
    result = call(*arguments)
    assert result.exit_code == 2 and result.stdout == ""
    assert result.stderr.startswith("Error: ") and result.stderr.count("\n") == 1 and said in result.stderr


def test_ctrl_c_exits_with_130_and_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*arguments: object, **settings: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("benchmarks.world.alternate", interrupted)
    result = call("world", *SMALL, "--json")
    assert result.exit_code == 130 and result.stdout == ""
    assert result.stderr.count("\n") == 1 and "Interrupted" in result.stderr
