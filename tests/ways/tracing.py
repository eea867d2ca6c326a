"""Files on the way of a piece of data through the package, from traces of real calls.

A way is a series of stages. A stage is traced from a call of its first function to the first call of its last
function that is made within it: the files of the stage are those of the functions of the package that are on the
stack at that moment, between the two. Where data waits to be fetched (a queue, an array, a file), a stage ends, and
the next one begins with the function that fetches it. Functions that only compute a value and have returned by then
are not on the way, nor is code of other libraries.

A profile function sees calls of Python functions in all threads that start under it. Compiled functions do not call it:
a way that leads through them is traced in a process in which they run as Python (`NUMBA_DISABLE_JIT`).
"""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import dorothie_gym

PACKAGE = Path(dorothie_gym.__file__).parent
PAGE = PACKAGE.parent / "docs" / "architecture.md"


@dataclass
class Stage:
    """One stage of a way.

    Attributes:
        first: function with which it begins, as "folder/module.py:Class.function".
        last: function with which it ends.
        path: functions on the stack when `last` was first called within `first`, in order; empty before.
    """

    first: str
    last: str
    path: list[str] = field(default_factory=list)

    def look(self, frame: FrameType) -> None:
        """Notes the stack below a frame if the frame is the end of the stage."""
        if self.path or _name(frame) != self.last:
            return
        names: list[str] = []
        found: FrameType | None = frame
        while found is not None:
            name = _name(found)
            if name is not None:
                names.append(name)
            if name == self.first:
                self.path = names[::-1]
                return
            found = found.f_back


def _name(frame: FrameType) -> str | None:
    """Returns the name of a function of the package; None for others."""
    path = Path(frame.f_code.co_filename)
    if not path.is_relative_to(PACKAGE):
        return None
    function = frame.f_code.co_qualname.replace(".<locals>", "")
    return f"{path.relative_to(PACKAGE).as_posix()}:{function}"


@contextmanager
def traced(stages: Sequence[Stage]) -> Iterator[None]:
    """Traces stages in this thread and those that start meanwhile."""
    ends = {stage.last.rsplit(".", 1)[-1].rsplit(":", 1)[-1] for stage in stages}

    def look(frame: FrameType, event: str, argument: object) -> None:
        if event == "call" and frame.f_code.co_name in ends:
            for stage in stages:
                stage.look(frame)

    threading.setprofile(look)
    sys.setprofile(look)
    try:
        yield
    finally:
        sys.setprofile(None)
        threading.setprofile(None)


def files_of(stages: Sequence[Stage]) -> list[str]:
    """Returns the files of a way in the order in which they are first reached; fails if a stage was not reached."""
    for stage in stages:
        assert stage.path, f"{stage.last} was not called within {stage.first}"
    return list(dict.fromkeys(name.split(":")[0] for stage in stages for name in stage.path))


def files_on_page(heading: str) -> list[str]:
    """Returns the files in the table below a heading of the page, in order."""
    section = PAGE.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    rows = re.findall(r"(?m)^\| (`.+?) \|", section)
    return [name for row in rows for name in re.findall(r"`([^`]+\.py)`", row)]
