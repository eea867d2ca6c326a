"""Files of annotators in the folder of a session, with atomic appends and a limited size."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final, Self

from dorothie_gym.errors import AnnotationError
from dorothie_gym.support.input_files import MAX_SESSION_TEXT, MAX_VALUES, MIB

MAX_LINES: Final = 50_000
"""Maximum number of lines of a log; a long session takes some 3,000 edits."""


@dataclass(frozen=True, kw_only=True)
class Extent:
    """Extent of a log, or of a part of one.

    Attributes:
        size: size [bytes].
        lines: number of line ends.
        values: bound of the number of JSON values; see `check_value_count`.
    """

    size: int = 0
    lines: int = 0
    values: int = 0

    @classmethod
    def of(cls, content: bytes) -> Self:
        """Returns the extent of bytes."""
        values = content.count(b",") + content.count(b"[") + content.count(b"{")
        return cls(size=len(content), lines=content.count(b"\n"), values=values)

    def plus(self, other: Extent) -> Extent:
        """Returns the extent of both together."""
        return Extent(size=self.size + other.size, lines=self.lines + other.lines, values=self.values + other.values)

    @property
    def excess(self) -> str | None:
        """The limit that is exceeded, in words; None within all limits."""
        limits = (
            (self.size > MAX_SESSION_TEXT, f"{MAX_SESSION_TEXT // MIB} MiB"),
            (self.lines > MAX_LINES, f"{MAX_LINES} lines"),
            (self.values > MAX_VALUES, f"{MAX_VALUES} values"),
        )
        return next((limit for exceeded, limit in limits if exceeded), None)


def check_place(path: Path) -> None:
    """Raises `AnnotationError` if a file or its folder is a link, which may lead outside the session."""
    for place, kind in ((path.parent, "folder"), (path, "file")):
        if place.is_symlink():
            raise AnnotationError(
                f"{place}: is a link; annotations are kept beside their session only; put the {kind} itself there"
            )


@contextmanager
def appending(path: Path, whole: int) -> Iterator[BinaryIO]:
    """Yields a file to append to; if that fails, the appended part is removed again.

    Args:
        path: the file; it is created if it is missing, in a folder that exists.
        whole: size to which the file is cut if the block fails [bytes]; an empty file is removed.

    Raises:
        AnnotationError: the file or its folder is a link, or the file has a further name elsewhere.
        OSError: it cannot be written.
    """
    check_place(path)
    begun = False
    try:
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | _UNLINKED, 0o666), "ab") as file:
            if os.fstat(file.fileno()).st_nlink > 1:
                raise AnnotationError(f"{path}: has another name elsewhere (hard link); replace it with a copy")
            begun = True
            yield file
    except OSError:
        if begun:  # buffered bytes are written when the file is closed, so it is cut only now
            _cut(path, whole)
        raise


def _cut(path: Path, size: int) -> None:
    if size:
        os.truncate(path, min(size, path.stat().st_size))
    else:
        path.unlink()


_UNLINKED: Final = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""A link or pipe that replaces the file in the meantime is neither followed nor waited for."""
