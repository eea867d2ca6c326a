"""Every mistake of a user: one message on standard error, exit code 2, nothing on standard output."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli import app


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")


def refused(*arguments: object) -> str:
    """Returns the message with which a command fails."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit), "no traceback"
    assert result.stdout == ""
    message = result.stderr
    assert message.startswith("Error: ") and message.count("\n") == 1
    return message


def template(**changes: Any) -> Path:
    subgoals = [{"destination": "$P", "description": "Go to $P"}, {"destination": "$H", "description": "Go home"}]
    board = {
        "story": "Go to $P, then home.",
        "variables": [["P", "places.stores"], ["H", "places.residential"]],
        "subgoals": subgoals,
        **changes,
    }
    path = Path("board.json")
    path.write_text(json.dumps(board), encoding="utf-8")
    return path


@pytest.mark.parametrize("json_too", [[], ["--json"]])
def test_unknown_town_is_reported_with_the_known_ones(json_too: list[str]) -> None:
    message = refused("run", "--town", "nowhere", *json_too)
    assert "nowhere" in message and "brookside" in message
    assert refused("towns", "nowhere", *json_too) == message


def test_missing_map_is_reported() -> None:
    assert "missing.xodr: file: cannot be read (No such file or directory)" in refused("run", "--town", "missing.xodr")


def test_truncated_map_is_reported() -> None:
    Path("cut.xodr").write_text('<?xml version="1.0"?>\n<OpenDRIVE>\n  <road id="1" leng', encoding="utf-8")
    message = refused("towns", "cut.xodr", "--json")
    assert "cut.xodr" in message and "line 3" in message


def test_storyboard_with_an_unknown_category_is_reported() -> None:
    path = template(variables=[["P", "places.moonbase"], ["H", "places.residential"]])
    message = refused("run", "--storyboard", path)
    assert "board.json" in message and "places.moonbase" in message


def test_subgoal_with_an_unknown_reference_is_reported() -> None:
    path = template(
        subgoals=[{"destination": "$Q", "description": "Go"}, {"destination": "$H", "description": "Go home"}]
    )
    message = refused("run", "--storyboard", path)
    assert "subgoals[0].destination" in message and "'Q'" in message


def test_unknown_storyboard_is_reported_with_the_known_ones() -> None:
    message = refused("run", "--storyboard", "nothing")
    assert "nothing" in message and "poorly_cat" in message


def test_unknown_policy_is_reported_with_the_known_ones() -> None:
    assert "scripted, silent, random" in refused("run", "--ad-wizard", "nasty")


def test_unwritable_folder_is_reported() -> None:
    Path("file").touch()
    assert str(Path("file/below")) in refused("run", "--out", "file/below", "--json")


def test_folder_that_holds_a_session_is_refused() -> None:
    silent = ("--max-seconds", "1", "--json", "--out", "one")
    assert CliRunner().invoke(app, ["run", *silent]).exit_code == 0
    before = Path("one/events.jsonl").read_bytes()
    assert "one: holds a session already" in refused("run", "--seed", 1, *silent)
    assert Path("one/events.jsonl").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "--picture", "none/p.png"], "the folder none does not exist"),
        (["run", "--picture", "p.jpg"], "ends in .png"),
        (["run", "--picture", "folder.png"], "cannot be written"),
        (["run", "--video", "v.txt"], ".mp4"),
        (["run", "--video", "none/v.mp4"], "the folder none does not exist"),
        (["run", "--picture", "p.png", "--no-picture"], "exclude each other"),
        (["towns", "--picture", "p.png"], "name it"),
        (["towns", "brookside", "--picture", "none/p.png"], "the folder none does not exist"),
    ],
)
def test_unwritable_files_are_reported(arguments: list[str], words: str) -> None:
    Path("folder.png").mkdir()
    assert words in refused(*arguments)
    assert [path.name for path in Path().iterdir()] == ["folder.png"], "nothing is left behind"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--tasks", "driving"], "'driving'"),
        (["--model", "oracle"], "majority, random"),
        (["--sessions", "none"], "none: there is no such folder"),
        (["--sessions", "."], "holds no session"),
        (["--split", "dev"], "'dev'"),
        (["none.parquet"], "none.parquet: No such file or directory"),
        (["text.parquet", "--corpus", "."], "text.parquet: not a readable Parquet file"),
        (["text.parquet", "--save", "x.parquet"], "add --model majority or --model random"),
        (["--save", "none/x.parquet"], "the folder none does not exist"),
    ],
)
def test_invalid_evaluations_are_reported(arguments: list[str], words: str) -> None:
    Path("text.parquet").write_text("session,event")
    assert words in refused("evaluate", *arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "--seed", "x"], "Invalid value for '--seed': "),
        (["run", "--seed", "-1"], "Invalid value for '--seed': "),
        (["run", "--max-seconds", "0"], "Invalid value for '--max-seconds': "),
        (["run", "--perception", "eyes"], "'eyes' is not one of 'symbolic', 'camera'; see dorothie-gym run --help"),
        (["film", "a", "--out", "b.mp4", "--view", "side"], "'--view': 'side' is not one of 'map', 'camera', 'both'"),
        (["run", "--bogus"], "No such option: --bogus"),
        (["film"], "Missing argument 'SESSION'; see dorothie-gym film --help"),
        (["film", "a", "--out"], "Option '--out' requires an argument"),
        (["walk"], "No such command 'walk'; see dorothie-gym --help"),
        (["--bogus"], "No such option: --bogus"),
    ],
)
def test_invalid_options_are_reported(arguments: list[str], words: str) -> None:
    assert words in refused(*arguments)


def test_a_group_without_a_command_shows_its_help() -> None:
    result = CliRunner().invoke(app, ["study"])
    assert "Usage: " in result.output and "invite" in result.output and "Error" not in result.output
