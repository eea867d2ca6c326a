"""An output folder that is deleted while a command writes to it is an error, and is not made again."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows does not delete open files")

ROOT = Path(__file__).parents[1]

COMMANDS: dict[str, tuple[str, ...]] = {
    "generate": ("generate", "--sessions", "12", "--max-seconds", "8", "--workers", "1"),
    "generate with two workers": ("generate", "--sessions", "12", "--max-seconds", "8", "--workers", "2"),
    "rollout": ("rollout", "--sessions", "12", "--max-seconds", "8", "--workers", "1"),
    "run": ("run", "--max-seconds", "8", "--speed", "4", "--no-picture"),
}


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("again", [False, True], ids=["deleted", "replaced by an empty folder"])
def test_deleted_output_folder_is_named_and_not_made_again(name: str, again: bool, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = subprocess.Popen(
        [sys.executable, "-m", "dorothie_gym", *COMMANDS[name], "--out", str(out)],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    while process.poll() is None and not list(out.glob("**/session.json")):
        time.sleep(0.01)
    out.rename(tmp_path / "gone")
    shutil.rmtree(tmp_path / "gone", ignore_errors=True)
    if again:
        out.mkdir()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1, errors
    assert errors.startswith(f"Error: {out}: the folder was deleted") and errors.count("\n") == 1
    assert out.exists() == again and not list(out.glob("**/session.json"))
