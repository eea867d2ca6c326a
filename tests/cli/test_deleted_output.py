"""An output folder that is deleted while a command writes to it is an error, and is not made again."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import pytest

from tests.forked_commands import start_command

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows does not delete open files")

COMMANDS: dict[str, tuple[str, ...]] = {
    "generate": ("generate", "--sessions", "60", "--max-seconds", "8", "--workers", "1"),
    "generate with two workers": ("generate", "--sessions", "60", "--max-seconds", "8", "--workers", "2"),
    "rollout": ("rollout", "--sessions", "60", "--max-seconds", "8", "--workers", "1"),
    "run": ("run", "--max-seconds", "8", "--speed", "1", "--no-picture"),
}
"""Commands by name; each goes on for eight seconds and more, so that the folder is deleted while it writes."""


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("again", [False, True], ids=["deleted", "replaced by an empty folder"])
def test_deleted_output_folder_is_named_and_not_made_again(name: str, again: bool, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = start_command([*COMMANDS[name], "--out", str(out)], tmp_path, tmp_path / "errors")
    while process.is_alive() and not list(out.glob("**/session.json")):
        time.sleep(0.01)
    out.rename(tmp_path / "gone")
    shutil.rmtree(tmp_path / "gone", ignore_errors=True)
    if again:
        out.mkdir()
    process.join(60)
    errors = (tmp_path / "errors").read_text()
    assert process.exitcode == 1, errors
    assert errors.startswith(f"Error: {out}: the folder was deleted") and errors.count("\n") == 1
    assert out.exists() == again and not list(out.glob("**/session.json"))
