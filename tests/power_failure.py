"""Model of a disk that loses, at a power failure, whatever was not synced."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import pytest

needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads files by their descriptors in /proc")


class Disk:
    """What is on the disk: the contents of synced files, and the names in synced folders, at their last sync.

    Args:
        root: folder that exists on the disk.
        monkeypatch: of the test.
    """

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._root = root
        self._contents: dict[int, bytes] = {}
        self._names: dict[int, dict[str, int]] = {}
        self._sync, self._replace = os.fsync, os.replace
        self.early: list[str] = []
        """Names that files got before their contents were on the disk."""
        monkeypatch.setattr(os, "fsync", self._fsync)
        monkeypatch.setattr(os, "replace", self._checked_replace)

    def content(self, path: Path) -> bytes | None:
        """Returns the content of a file after a power failure; None if the file would be missing or empty."""
        number = self._number(path)
        return None if number is None else self._contents.get(number)

    def _number(self, path: Path) -> int | None:
        """Returns the inode that a path has after a power failure."""
        if path == self._root:
            return path.stat().st_ino
        parent = self._number(path.parent)
        return None if parent is None else self._names.get(parent, {}).get(path.name)

    def _fsync(self, descriptor: int) -> None:
        self._sync(descriptor)
        found = os.fstat(descriptor)
        if stat.S_ISDIR(found.st_mode):
            self._names[found.st_ino] = {entry.name: entry.inode() for entry in os.scandir(descriptor)}
        else:
            self._contents[found.st_ino] = Path(f"/proc/self/fd/{descriptor}").read_bytes()

    def _checked_replace(self, source: Path, target: Path) -> None:
        if self._contents.get(os.stat(source).st_ino) != Path(source).read_bytes():
            self.early.append(Path(target).name)
        self._replace(source, target)


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Disk:
    """Disk of this process from now on."""
    return Disk(tmp_path, monkeypatch)
