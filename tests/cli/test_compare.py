from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.session.recording import SessionWriter
from tests.session.recording.builders import header, rows, write
from tests.session.recording.dialogues import talk


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["compare", *(str(argument) for argument in arguments)])


def forge(folder: Path, old: str, new: str) -> None:
    text = (folder / "events.jsonl").read_text(encoding="utf-8")
    assert old in text
    (folder / "events.jsonl").write_text(text.replace(old, new, 1), encoding="utf-8")


def test_copy_of_a_session_is_equal(tmp_path: Path) -> None:
    one = write(tmp_path / "one", talk())
    result = call(one, shutil.copytree(one, tmp_path / "other"))
    assert (result.exit_code, result.stdout) == (0, "one: equal\n")


def test_first_differing_event_is_named_with_frame_and_field(tmp_path: Path) -> None:
    one, other = write(tmp_path / "one", talk()), write(tmp_path / "other", talk())
    forge(other, "Yes, left on Fuller.", "Yes, right on Fuller.")
    k = next(k for k, event in enumerate(talk()) if event.data.get("text") == "Yes, left on Fuller.")
    result = call(one, other)
    assert result.exit_code == 1
    expected = f"one: differs first at frame {talk()[k].frame}, events[{k}].data.text: 'Yes, left on Fuller.' and "
    assert result.stdout.startswith(expected + "'Yes, right on Fuller.'")


def test_folders_are_compared_session_by_session(tmp_path: Path) -> None:
    for name in ("train/a", "test/seen/b", "sessions/c"):
        write(tmp_path / "before" / name, talk())
    shutil.copytree(tmp_path / "before", tmp_path / "after")
    shutil.rmtree(tmp_path / "after/train/a")
    forge(tmp_path / "after/sessions/c", '"frame":', '"frame": ')
    (tmp_path / "after/.parts").mkdir()
    result = call(tmp_path / "before", tmp_path / "after", "--json")
    assert result.exit_code == 1
    page = json.loads(result.stdout)
    assert (page["compared"], page["equal"]) == (3, False)
    missing = {"frame": -1, "field": "session", "first": "present", "second": "missing"}
    assert page["sessions"] == [
        {"session": "sessions/c", "equal": True, "difference": None},
        {"session": "test/seen/b", "equal": True, "difference": None},
        {"session": "train/a", "equal": False, "difference": missing},
    ]
    assert call(tmp_path / "after", tmp_path / "after").stdout.endswith("2 of 2 sessions are equal\n")


@pytest.mark.parametrize("swapped", [False, True])
def test_session_that_was_cut_off_differs_from_the_complete_one(tmp_path: Path, swapped: bool) -> None:
    whole, cut = write(tmp_path / "whole", talk(), frames=300), tmp_path / "cut"
    with SessionWriter(cut, header()) as writer:
        writer.append(talk(), rows(0, 300))
    result = call(*((cut, whole) if swapped else (whole, cut)))
    assert result.exit_code == 1 and "complete: " in result.stdout


@pytest.mark.parametrize(("other", "message"), [("nowhere", "there is no such folder"), ("empty", "holds no session")])
def test_folder_without_sessions_is_reported(tmp_path: Path, other: str, message: str) -> None:
    one = write(tmp_path / "one", talk())
    (tmp_path / "empty").mkdir()
    result = call(one, tmp_path / other)
    assert result.exit_code == 2 and message in result.stderr


def test_session_and_folder_of_sessions_cannot_be_compared(tmp_path: Path) -> None:
    write(tmp_path / "corpus/one", talk())
    result = call(tmp_path / "corpus", tmp_path / "corpus/one")
    assert result.exit_code == 2 and "give two of the same kind" in result.stderr
