"""Readers for sessions of any layout, alone or in folders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from dorothie_gym.errors import SessionError
from dorothie_gym.recording.file_names import HEADER_FILE
from dorothie_gym.recording.sdn import SignVote, detect_layout, read_sdn, settle_sign
from dorothie_gym.recording.session import Session
from dorothie_gym.recording.splits import SPLITS, TOWNS


def layout_of(folder: Path) -> str | None:
    """Returns "native", or the SDN layout of the session in a folder; None without a session."""
    if (folder / HEADER_FILE).is_file():
        return "native"
    found = detect_layout(folder)
    return None if found is None else str(found)


def read_session(path: Path | str, *, maps: Path | str | None = None, sign: SignVote | None = None) -> Session:
    """Returns the session in a folder, of any layout.

    Args:
        path: the folder.
        maps: folder with the maps of SDN's towns.
        sign: vote on the sign of angles in an SDN session; see `read_sdn`.

    Raises:
        SessionError: there is no session, or it cannot be read.
    """
    folder = Path(path)
    if layout_of(folder) in ("native", None):
        return Session.load(folder)
    return read_sdn(folder, maps=maps, sign=sign)


def session_folders(path: Path | str) -> tuple[Path, ...]:
    """Returns the session folders in a folder and in its folds, by name; for a session, the folder itself.

    Raises:
        SessionError: there is no such folder, or it holds no session.
    """
    root = Path(path)
    if not root.is_dir():
        raise SessionError(f"{root}: there is no such folder; give a folder of sessions")
    if layout_of(root) is not None:
        return (root,)
    folders = tuple(_within(root, 2))
    if not folders:
        raise SessionError(f"{root}: holds no session (no folder in it has a {HEADER_FILE})")
    return folders


def _within(folder: Path, depth: int) -> Iterator[Path]:
    for child in sorted(folder.iterdir()):
        if child.name.startswith(".") or not child.is_dir():
            continue
        if layout_of(child) is not None:
            yield child
        elif depth and child.name in (*SPLITS, *TOWNS):
            yield from _within(child, depth - 1)


def sign_of(folders: Sequence[Path]) -> SignVote | None:
    """Returns the vote of the SDN sessions among the folders on the sign of angles; None without SDN sessions."""
    read = [folder for folder in folders if layout_of(folder) not in ("native", None)]
    return settle_sign(read) if read else None
