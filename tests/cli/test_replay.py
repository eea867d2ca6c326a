from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from dorothie_gym.cli import app
from tests.archive.sdn.builders import release


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded") / "one"
    assert call("run", "--seed", 2, "--max-seconds", 20, "--json", "--out", folder).exit_code == 0
    return folder


def test_check_of_a_recorded_session_succeeds(recorded: Path) -> None:
    result = call("replay", recorded, "--check", "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert (facts["equal"], facts["checked"]) == (True, 1)
    row = facts["sessions"][0]
    assert (row["session"], row["frames"], row["difference"], row["complete"]) == ("one", 600, None, True)


def test_check_of_a_changed_session_names_frame_and_field(recorded: Path, tmp_path: Path) -> None:
    folder = tmp_path / "forged"
    folder.mkdir()
    for file in recorded.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    events = (folder / "events.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    k = next(k for k, line in enumerate(events) if '"DialogueMove"' in line)
    event = json.loads(events[k])
    event["data"]["text"] = "forged"
    events[k] = json.dumps(event) + "\n"
    (folder / "events.jsonl").write_text("".join(events), encoding="utf-8")
    result = call("replay", folder, "--check")
    assert result.exit_code == 1
    assert f"differs first at frame {event['frame']}, events[{k}].data.text: recorded 'forged'" in result.stdout


def test_sessions_that_cannot_be_replayed_are_reported(recorded: Path, tmp_path: Path) -> None:
    sdn = release(tmp_path / "release")
    for arguments, message in (
        ((sdn,), "give --town FILE, or --maps DIR"),
        ((sdn, "--check", "--town", "brookside"), "was not recorded"),
        ((recorded, "--check", "--video", "v.mp4"), "exclude each other"),
        ((recorded, "--video", "v.gif"), "not a video format"),
        ((tmp_path / "nowhere",), "no session"),
    ):
        result = call("replay", *arguments)
        assert result.exit_code == 2 and message in result.stderr, result.output


def test_session_is_shown_until_the_window_is_closed(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr("dorothie_gym.pictures.views.frames.HumanWindow.show", lambda self, frame, rate: None)
    result = call("replay", recorded, "--fps", 1, "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["pictures"] == 20


def test_invisible_window_is_refused(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dorothie_gym.cli.sessions._is_window_invisible", lambda: True)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    result = call("replay", recorded)
    assert result.exit_code == 2 and "--video FILE.mp4" in result.stderr
