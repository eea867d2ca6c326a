from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.archive import load_readable, load_sessions, session_folders, split_by_name
from dorothie_gym.errors import SessionError
from tests.session.recording.builders import session, write


def test_sessions_of_a_folder_come_by_name(tmp_path: Path) -> None:
    for name in ("b", "a", "c"):
        write(tmp_path / name, frames=2)
    (tmp_path / "notes").mkdir()
    assert [loaded.name for loaded in load_sessions(tmp_path)] == ["a", "b", "c"]


def test_folder_that_is_a_session_is_its_own_only_one(tmp_path: Path) -> None:
    write(tmp_path / "a", frames=2)
    assert session_folders(tmp_path / "a") == (tmp_path / "a",)


def test_folder_without_sessions_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="holds no session"):
        session_folders(tmp_path)
    with pytest.raises(SessionError, match="no such folder"):
        session_folders(tmp_path / "missing")


def test_unreadable_session_is_reported_by_name(tmp_path: Path) -> None:
    write(tmp_path / "a", frames=2)
    write(tmp_path / "b", frames=2)
    (tmp_path / "b/session.json").write_text("{}\n")
    sessions, unreadable = load_readable(tmp_path)
    assert [loaded.name for loaded in sessions] == ["a"]
    assert "session.json" in unreadable["b"]


def test_second_half_by_name_is_for_the_test() -> None:
    sessions = [session(name=name) for name in ("c", "a", "b")]
    train, test = split_by_name(sessions)
    assert [one.name for one in train] == ["a"]
    assert [one.name for one in test] == ["b", "c"]
