"""`dorothie-gym rollout`."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from dorothie_gym.evaluation.closed_loop import METRICS
from dorothie_gym.evaluation.closed_loop.results import print_result

SHORT = ("--co-wizard", "lane-follow", "--towns", "brookside", "--max-seconds", "6", "--workers", "1")


def invoke(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["rollout", *map(str, arguments)])


def test_json_has_each_metric_with_its_interval_and_is_reproducible() -> None:
    first, second = (invoke(*SHORT, "--sessions", 2, "--json") for _ in range(2))
    assert first.exit_code == 0, first.output
    assert first.stdout == second.stdout
    page = json.loads(first.stdout)
    for metric in METRICS:
        assert set(page[metric.key]) == {"mean", "low", "high"}
    assert (page["sessions"], page["errored"], len(page["seeds"])) == (2, 0, 2)
    assert set(page["per_town"]) == {"brookside"} and set(page["per_exception"]) == {"none"}


def test_tables_name_seeds_and_the_folder_of_sessions(tmp_path: Path) -> None:
    done = invoke(*SHORT, "--sessions", 1, "--out", tmp_path / "kept")
    assert done.exit_code == 0, done.output
    for words in ("1 sessions: participant scripted, co_wizard lane-follow", "driving score", "Seeds (of --seed 0)"):
        assert words in done.stdout
    assert (tmp_path / "kept" / "sessions" / "0000-brookside" / "session.json").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--co-wizard", "clever"), "co_wizard: there is no policy 'clever', nor a file of that name"),
        (("--participant", "lane-follow"), "participant: there is no policy 'lane-follow'"),
        (("--towns", "atlantis"), "atlantis"),
        (("--towns", ","), "give seen, development, validation, unseen, all"),
        (("--co-wizard", "weights.json"), "which cannot be played"),
        (("--co-wizard", "hollow"), "co_wizard: hollow/model."),
        (("--participant", "hollow"), "participant: hollow/model."),
    ],
)
def test_invalid_arguments_are_reported(
    arguments: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("weights.json").write_text('{"kind": "nothing known"}')
    Path("hollow").mkdir()
    Path("hollow/model.json").write_text('{"kind": "dorothie_gym-rl"}')
    done = invoke(*arguments)
    assert done.exit_code == 2 and message in done.stderr and "Traceback" not in done.stderr


@pytest.mark.long
def test_ctrl_c_names_the_results_and_the_command_that_resumes(tmp_path: Path) -> None:
    out = tmp_path / "stopped"
    arguments = [*SHORT[:4], "--max-seconds", "40", "--workers", "1", "--sessions", "40", "--out", str(out)]
    process = subprocess.Popen(
        [sys.executable, "-m", "dorothie_gym.cli", "rollout", *arguments],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        text=True,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    while process.poll() is None and not list(out.glob("sessions/*/session.json")):
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate()
    assert process.returncode == 130, errors
    page = json.loads((out / "rollout.json").read_text())
    assert f"Interrupted with {page['sessions']} of 40 sessions finished" in errors
    assert f"--towns brookside --sessions 40 --seed 0 --max-seconds 40 --out {out}" in errors


def test_tables_keep_all_digits_on_a_narrow_terminal() -> None:
    from rich.console import Console

    from tests.evaluation.closed_loop.test_results import result

    found = result()
    wide, narrow = (Console(width=width, record=True, file=io.StringIO()) for width in (400, 80))
    for console in (wide, narrow):
        print_result(found, console)
    shown, whole = (console.export_text().split("\n", 1)[1] for console in (narrow, wide))
    assert "…" not in shown and max(map(len, shown.splitlines())) <= 80
    numbers = re.findall(r"\d+\.\d+", whole)
    assert numbers and sorted(re.findall(r"\d+\.\d+", shown)) == sorted(numbers)
