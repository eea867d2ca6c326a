"""A folder that sessions are made in: by one process at a time, from the same settings each time it is gone on with."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from dorothie_gym._version import __version__
from dorothie_gym.errors import SessionError
from dorothie_gym.files import PART, write_atomically
from dorothie_gym.recording import FORMAT_VERSION

if sys.platform != "win32":
    import fcntl

PARTS: Final = ".parts"
"""Folder within it of sessions that are not finished yet; gone when all are."""


@contextlib.contextmanager
def making_in(root: Path, file: str, wanted: Mapping[str, Any]) -> Iterator[None]:
    """Holds a folder, made if need be, as long as the block lasts, with an empty `PARTS` in it.

    Args:
        root: the folder.
        file: name of the file in it that tells what is made there.
        wanted: what that is (JSON types); a folder with another one is not gone on with.

    Raises:
        SessionError: the folder holds something else, or another process is at work in it.
        OSError: the folder cannot be written.
    """
    with _alone_in(root):
        _claim(root / file, wanted)
        shutil.rmtree(root / PARTS, ignore_errors=True)
        (root / PARTS).mkdir()
        yield
        shutil.rmtree(root / PARTS)


def _claim(path: Path, wanted: Mapping[str, Any]) -> None:
    """Notes what is made; raises `SessionError` where the folder holds something that was made from something else."""
    root = path.parent
    page = json.dumps({"package_version": __version__, "format_version": FORMAT_VERSION, **wanted}, indent=1) + "\n"
    if not path.exists():
        others = [entry.name for entry in root.iterdir() if entry.name != path.name + PART]
        if others:
            raise SessionError(f"{root}: holds something else ({others[0]}); choose a new or an empty folder")
        write_atomically(path, page)
        return
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise SessionError(f"{path}: cannot be read ({error}); choose another folder") from None
    for name, value in json.loads(page).items():
        if not isinstance(found, dict) or found.get(name) != value:
            there = found.get(name) if isinstance(found, dict) else found
            raise SessionError(
                f"{path}: what is in this folder has {name} {there!r}, not {value!r}; "
                "choose another folder, or go on with the same settings"
            )


@contextlib.contextmanager
def _alone_in(root: Path) -> Iterator[None]:
    """Holds a folder, made if need be, as long as the block lasts; raises `SessionError` where another process does."""
    root.mkdir(parents=True, exist_ok=True)
    if sys.platform == "win32":
        yield
        return
    descriptor = os.open(root, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise SessionError(f"{root}: another process is at work in it; wait for it, or stop it") from None
    try:
        yield
    finally:
        os.close(descriptor)
