"""Parts that are texts of the command line, and files of leaderboards and predictions."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import chdir
from functools import cache
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
from typer.main import get_command
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.evaluation.closed_loop.protocol import LeaderboardProtocol
from dorothie_gym.evaluation.closed_loop.submission import check_submission
from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.session.config import EnvConfig
from tests.portability.parts import Values, group, table_content, without_versions

WIDTH = "100"
"""Width of help texts."""

FORCED_COLOURS = ("FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS", "TERMINAL_WIDTH", "CLICOLOR_FORCE", "TTY_COMPATIBLE")
"""Variables that change the help texts of typer."""

ERRORS: dict[str, tuple[str, ...]] = {
    "unknown town": ("run", "--town", "broksid"),
    "unknown storyboard": ("run", "--storyboard", "nothing"),
    "unknown policy": ("run", "--ad-wizard", "nasty"),
    "missing map": ("run", "--town", "missing.xodr"),
    "truncated map": ("towns", "cut.xodr", "--json"),
    "no such option": ("generate", "--sesions", "3"),
    "number out of range": ("rollout", "--sessions", "0"),
    "no session": ("replay", "nowhere"),
    "picture format": ("run", "--picture", "p.jpg"),
    "unknown task": ("evaluate", "nowhere", "--tasks", "driving"),
    "no rollout": ("submit", "nowhere"),
    "page format": ("leaderboard", "nowhere", "--out", "page.html"),
    "unknown command": ("rolout",),
}
"""Mistakes of users."""

MODELS = ("pretrained:toto", "pretrained:reader")
"""Shipped models of the three tasks."""


def invoke(*arguments: object) -> Any:
    os.environ["COLUMNS"] = WIDTH
    for name in FORCED_COLOURS:
        os.environ.pop(name, None)
    return CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="dorothie-gym")


# --- Texts ------------------------------------------------------------------------------------------------------------


def _commands(command: Any, path: tuple[str, ...] = ("dorothie-gym",)) -> Iterator[str]:
    yield " ".join(path)
    for name, below in getattr(command, "commands", {}).items():
        yield from _commands(below, (*path, name))


@group(*_commands(get_command(app)))
def help_texts(command: str) -> Values:
    """What `--help` prints, without the spaces at the ends of lines."""
    result = invoke(*command.split()[1:], "--help")
    assert result.exit_code == 0, result.output
    yield "text", re.sub(r" +$", "", result.output, flags=re.MULTILINE)


@group(*ERRORS)
def error_lines(name: str) -> Values:
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("cut.xodr").write_text('<?xml version="1.0"?>\n<OpenDRIVE>\n  <road id="1" leng', encoding="utf-8")
        result = invoke(*ERRORS[name])
    printed = (result.stdout + result.stderr).replace(f"{Path(folder).resolve()}{os.sep}", "")
    yield "text", f"{printed}exit code {result.exit_code}\n"


# --- Leaderboard ------------------------------------------------------------------------------------------------------


@group("unseen")
def leaderboard(part: str) -> Values:
    """Table, rollouts and submissions of three Co-Wizards; without times, versions and hashes of whole files."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        rows = [word for name in ("scripted", "lane-follow", "random") for word in ("--row", name)]
        short = ("--sessions", 3, "--max-seconds", 60, "--workers", 1, "--json", "--out", "page.md")
        result = invoke("leaderboard", "rows", "--play", "--parts", part, *rows, *short)
        assert result.exit_code == 0, result.output
        yield "page", without_versions(json.loads(result.stdout))
        protocol = LeaderboardProtocol(sessions=3, config=EnvConfig(max_seconds=60.0))
        for place in sorted(Path("rows").iterdir()):
            yield f"{place.name} rollout", without_versions(json.loads((place / "rollout.json").read_bytes()))
            found = check_submission(place, sample=1, seed=0, protocol=protocol)
            assert found.submission is not None, found.faults
            yield f"{place.name} submission", without_versions(dict(found.submission), "sha256")
        refused = invoke("submit", place, "--workers", 1, "--json")
        assert refused.exit_code == 1, refused.output
        yield "refused", json.loads(refused.stdout)["faults"]


# --- Predictions ------------------------------------------------------------------------------------------------------


@cache
def _corpus() -> tuple[Path, tempfile.TemporaryDirectory[str]]:
    """A small corpus, in a folder that is there until the end of the process."""
    folder = tempfile.TemporaryDirectory()
    generate_corpus(Path(folder.name), sessions=8, seed=5, config=EnvConfig(max_seconds=90.0))
    return Path(folder.name), folder


@group(*MODELS)
def predictions(name: str) -> Values:
    """File with the predictions of a shipped model for a small corpus.

    Classes are compared, not the angles: those are sums of torch, whose last digits depend on the processor.
    """
    # imported here: torch is slow to import, and not needed for texts
    from tests.portability.predicted import predicted_file

    corpus, _ = _corpus()
    with tempfile.TemporaryDirectory() as folder:
        table = pq.read_table(predicted_file(name, corpus, Path(folder) / "predictions.parquet"))
        yield "columns", [(field.name, str(field.type)) for field in table.schema]
        yield "about", without_versions(json.loads(table.schema.metadata[b"dorothie_gym.about"]), "version")
        for task in sorted(set(table["task"].to_pylist())):
            yield task, table_content(table.filter([row == task for row in table["task"].to_pylist()]), "angle")
