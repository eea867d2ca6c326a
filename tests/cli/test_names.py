"""Names on the command line: environments, completion, suggestions, and brackets in help texts."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from click.testing import Result
from typer.main import get_command
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.cli.output import stderr, stdout

ROOT = Path(__file__).parents[2]


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def test_envs_lists_every_registered_environment() -> None:
    import json

    import pettingzoo

    rows = json.loads(call("envs", "--json").stdout)
    ids = {row["id"] for row in rows}
    assert {name for name in gym.registry if name.startswith("dorothie_gym/")} < ids
    assert ids - set(gym.registry) == {"dorothie_gym/DuoWizard-v0"}
    pettingzoo.make("parallel", "dorothie_gym/DuoWizard-v0")
    listed = call("envs").stdout
    for row in rows:
        assert row["id"] in listed and row["description"] and row["make"] in listed
    assert max(map(len, listed.splitlines())) <= 80


def test_package_is_a_program() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "dorothie_gym", "--version"],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=60,
    )
    assert re.fullmatch(r"dorothie-gym \S+\n", done.stdout)


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (("run", "--town", "broksid"), "did you mean 'brookside'?"),
        (("towns", "Midtwon"), "did you mean 'midtown'?"),
        (("run", "--storyboard", "film_nigth"), "did you mean 'film_night'?"),
        (("run", "--co-wizard", "lanefollow"), "did you mean 'lane-follow'?"),
        (("run", "--co-wizard", "pretrained:maskableppo"), "did you mean 'pretrained:maskable-ppo'?"),
        (("rollout", "--ad-wizard", "silnet"), "did you mean 'silent'?"),
        (("rollout", "--towns", "brookside,northgat"), "did you mean 'northgate'?"),
    ],
)
def test_similar_name_is_suggested(arguments: tuple[str, ...], wanted: str) -> None:
    done = call(*arguments)
    assert done.exit_code == 2 and wanted in done.stderr


def test_similar_model_and_algorithm_are_suggested() -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    assert "did you mean 'toto-belief'?" in call("train", "toto-belif").stderr
    assert "did you mean 'maskable_ppo'?" in call("train-rl", "maskable-ppo", "--out", "never").stderr


def test_name_that_resembles_nothing_has_no_suggestion() -> None:
    assert "did you mean" not in call("run", "--town", "qqqq").stderr


def completions(line: str) -> list[str]:
    """Returns what a shell offers at the end of a command line."""
    done = subprocess.run(
        [sys.executable, "-c", "from dorothie_gym.cli import app; app(prog_name='dorothie-gym')"],
        env={**os.environ, "PYTHONPATH": str(ROOT), "_DOROTHIE_GYM_COMPLETE": "complete_bash",
             "COMP_WORDS": f"dorothie-gym {line}", "COMP_CWORD": str(len(line.split()) + line.endswith(" "))},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    return done.stdout.split()


@pytest.mark.long
@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("run --town m", ["midtown", "millbrook"]),
        ("run --storyboard film", ["film_night"]),
        ("run --co-wizard l", ["lane-follow"]),
        ("rollout --co-wizard pretrained:m", ["pretrained:maskable-ppo"]),
        ("rollout --participant s", ["scripted", "silent"]),
        ("rollout --towns seen,b", ["seen,brookside"]),
        ("towns n", ["northgate"]),
    ],
)
def test_names_are_completed(line: str, wanted: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert completions(line) == wanted


def commands(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    yield path
    for name, child in getattr(command, "commands", {}).items():
        yield from commands(child, (*path, name))


@pytest.mark.long
def test_help_shows_brackets_and_every_extra_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "250")
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    texts = {path: call(*path, "--help").stdout for path in commands(get_command(app))}
    for path, text in texts.items():
        assert not re.search(r"needs dorothie-gym(?!\[)", text), path
        assert "\\[" not in text, path
        assert all(name in extras for name in re.findall(r"dorothie-gym\[(\w+)\]", text)), path
    assert "needs dorothie-gym[video]" in texts["run",] and "needs dorothie-gym[video]" in texts["replay",]
    for name in ("rollout", "generate", "train-rl"):
        assert "needs dorothie-gym[ray]" in texts[name,]


def test_texts_with_brackets_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    from rich.table import Table

    row = Table("a")
    row.add_row("pip install 'dorothie-gym[statistics]'")
    stdout().print(row)
    stdout().print("out/[bold]x[/]")
    stderr().print("[red]")
    shown = capsys.readouterr()
    assert "dorothie-gym[statistics]" in shown.out and "[bold]x[/]" in shown.out and "[red]" in shown.err


@pytest.mark.parametrize("command", ["towns", "storyboards", "policies", "envs"])
def test_listings_fit_80_columns_without_cut_words(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    lines = call(command).stdout.splitlines()
    prose = [line for line in lines if ": dorothie-gym " not in line]  # commands to copy
    assert len(prose) > 3 and max(map(len, prose)) <= 80
    assert not [line for line in lines if "…" in line]
