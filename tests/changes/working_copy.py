"""Changes of a copy of the sources, and what a fresh interpreter says of them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "changes.md"
IGNORED = shutil.ignore_patterns("pretrained", "*.pyc.*")  # byte code is copied, but what is being written now


@dataclass(frozen=True)
class Edit:
    """One edit of a file, and the error that asks for it.

    Attributes:
        file: path in the repository.
        text: text that the edit replaces, which occurs once in the file; empty to append.
        replacement: text in its place.
        demand: pattern of the last line that the probe prints before this edit; None if nothing asks for the edit.
    """

    file: str
    text: str
    replacement: str
    demand: str | None = None


class WorkingCopy:
    """A copy of the package, without the shipped weights, in a folder of a test.

    Args:
        folder: an empty folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(ROOT / "dorothie_gym", folder / "dorothie_gym", ignore=IGNORED)

    def edit(self, edit: Edit) -> None:
        """Makes an edit; fails if the text that it replaces is not there exactly once."""
        path = self.folder / edit.file
        text = path.read_text(encoding="utf-8")
        if edit.text:
            assert text.count(edit.text) == 1, f"{edit.file}: {edit.text!r} occurs {text.count(edit.text)} times"
            text = text.replace(edit.text, edit.replacement)
        else:
            text += edit.replacement
        path.write_text(text, encoding="utf-8")

    def run(self, code: str, *, compiled: bool = True) -> subprocess.CompletedProcess[str]:
        """Runs code with the copy in a fresh interpreter.

        Args:
            code: Python source.
            compiled: whether compiled functions are compiled, or run as Python.
        """
        variables = {**os.environ, "PYTHONPATH": str(self.folder)}
        if not compiled:
            variables["NUMBA_DISABLE_JIT"] = "1"
        return subprocess.run(
            [sys.executable, "-c", code], cwd=self.folder, env=variables, capture_output=True, text=True, check=False
        )

    def first_error(self, code: str) -> str:
        """Returns the last line of the error with which code ends; fails if it ends without one."""
        done = self.run(code)
        assert done.returncode != 0, f"nothing failed:\n{done.stdout}{done.stderr}"
        return done.stderr.strip().splitlines()[-1]


def follow(copy: WorkingCopy, edits: Sequence[Edit], probe: str) -> None:
    """Makes edits one after the other, each after the error that demands it, until the probe runs without error."""
    for edit in edits:
        if edit.demand is not None:
            error = copy.first_error(probe)
            assert re.search(edit.demand, error), f"before the edit of {edit.file}, the error was: {error}"
        copy.edit(edit)
    done = copy.run(probe)
    assert done.returncode == 0, done.stderr


def listed_files(heading: str) -> list[str]:
    """Returns the files that the page lists below a heading, in order; those in the first column of its table."""
    section = PAGE.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return re.findall(r"(?m)^\| (?:\d+|-) \| `([^`]+)`", section)
