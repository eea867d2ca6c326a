"""Folder of a series of sessions: locked by one process at a time, and tied to the settings of the series."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from dorothie_gym._version import __version__
from dorothie_gym.errors import OutputFolderError, SessionError, short_repr
from dorothie_gym.session.recording.header import FORMAT_VERSION
from dorothie_gym.support.files import PART, write_atomically
from dorothie_gym.support.input_files import MAX_SMALL_JSON, raising, read_json

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.policies.policy_loader import Player

if sys.platform != "win32":
    import fcntl

PARTS_FOLDER: Final = ".parts"
"""Folder of unfinished sessions within the folder of a series; removed when all sessions are finished."""


class PlannedSession(Protocol):
    """Session to be played; it follows from town, seed, players and trial."""

    @property
    def town(self) -> str:
        """Name or file of the town."""
        ...

    @property
    def seed(self) -> int:
        """Seed of the session."""
        ...

    @property
    def path(self) -> str:
        """Folder of the session within the folder of all sessions."""
        ...

    @property
    def partners(self) -> Mapping[Role, Player]:
        """Players of this session that replace those of the series."""
        ...

    @property
    def trial(self) -> int:
        """Number of the trial, of several of one scenario."""
        ...


@contextlib.contextmanager
def locked_folder(root: Path, file: str, settings: Mapping[str, object]) -> Iterator[None]:
    """Locks a folder as long as the block lasts, and creates the folder and an empty `PARTS_FOLDER` in it.

    Args:
        root: the folder.
        file: name of the file in it that states the settings.
        settings: settings that determine the sessions, in JSON types; a folder with other settings is refused.

    Raises:
        SessionError: the folder contains other files, or another process holds its lock.
        OutputFolderError: the folder was deleted or replaced inside the block.
        OSError: the folder cannot be written.
    """
    with _lock(root), noticing_deletion(root):
        _check_settings(root / file, settings)
        shutil.rmtree(root / PARTS_FOLDER, ignore_errors=True)
        (root / PARTS_FOLDER).mkdir()
        yield
        shutil.rmtree(root / PARTS_FOLDER)


def _check_settings(path: Path, settings: Mapping[str, object]) -> None:
    """Writes the settings into a new folder; raises `SessionError` if the folder has others or holds other files."""
    root = path.parent
    page = json.dumps({"package_version": __version__, "format_version": FORMAT_VERSION, **settings}, indent=1) + "\n"
    if not path.exists():
        others = [entry.name for entry in root.iterdir() if entry.name != path.name + PART]
        if others:
            raise SessionError(f"{root}: holds something else ({others[0]}); choose a new or an empty folder")
        write_atomically(path, page)
        return
    with raising(lambda message: SessionError(f"{message}; choose another folder")):
        found = read_json(path, MAX_SMALL_JSON)
    for name, value in json.loads(page).items():
        if not isinstance(found, dict) or found.get(name) != value:
            there = found.get(name) if isinstance(found, dict) else found
            raise SessionError(
                f"{path}: has {name} {short_repr(there)}, not {value!r}; choose another folder, or resume "
                "with the same settings"
            )


@contextlib.contextmanager
def _lock(root: Path) -> Iterator[None]:
    """Creates a folder and locks it as long as the block lasts; raises `SessionError` if another process holds it."""
    root.mkdir(parents=True, exist_ok=True)
    if sys.platform == "win32":
        yield
        return
    descriptor = os.open(root, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise SessionError(f"{root}: another process writes to this folder; wait for it, or stop it") from None
    try:
        yield
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def noticing_deletion(folder: Path) -> Iterator[None]:
    """Raises `OutputFolderError` if a folder was deleted or replaced inside the block, also after other failures."""
    deleted = f"{folder}: the folder was deleted or replaced while it was being written; run the command again"
    before = _identity(folder)
    try:
        yield
    except Exception as error:
        if _identity(folder) == before:
            raise
        raise OutputFolderError(deleted) from error
    if _identity(folder) != before:
        raise OutputFolderError(deleted)


def _identity(folder: Path) -> tuple[int, int] | None:
    """Returns numbers that belong to a folder as long as it exists; None without a folder."""
    try:
        found = folder.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return found.st_dev, found.st_ino
