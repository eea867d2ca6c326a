"""Folders of sessions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.layout import HEADER_FILE
from dorothie_gym.sessions.session import Session


def session_folders(path: Path | str) -> tuple[Path, ...]:
    """Returns the folders of the sessions in a folder, by name; a folder that is a session is its own only one.

    Raises:
        SessionError: there is no such folder, or it holds no session.
    """
    root = Path(path)
    if not root.is_dir():
        raise SessionError(f"{root}: there is no such folder; give a folder of sessions")
    if (root / HEADER_FILE).is_file():
        return (root,)
    folders = tuple(sorted(child for child in root.iterdir() if (child / HEADER_FILE).is_file()))
    if not folders:
        raise SessionError(f"{root}: holds no session (no folder in it has a {HEADER_FILE})")
    return folders


def load_sessions(path: Path | str) -> tuple[Session, ...]:
    """Returns the sessions in a folder, by name; raises `SessionError` for the first that cannot be read."""
    return tuple(Session.load(folder) for folder in session_folders(path))


def load_readable(path: Path | str) -> tuple[tuple[Session, ...], dict[str, str]]:
    """Returns the sessions in a folder, by name, and for each that cannot be read its name and the reason."""
    sessions: list[Session] = []
    unreadable: dict[str, str] = {}
    for folder in session_folders(path):
        try:
            sessions.append(Session.load(folder))
        except SessionError as error:
            unreadable[folder.name] = str(error)
    return tuple(sessions), unreadable


def split_by_name(sessions: Sequence[Session]) -> tuple[tuple[Session, ...], tuple[Session, ...]]:
    """Returns the first half of the sessions by name, to train on, and the second (the larger if odd), to test on."""
    ordered = sorted(sessions, key=lambda session: session.name)
    middle = len(ordered) // 2
    return tuple(ordered[:middle]), tuple(ordered[middle:])
