"""Trainings on a full disk: one line that names the file, exit code 1; the same command goes on when there is space.

The disk is a small file system in memory, which a process may mount in a user namespace of its own.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.session.config import EnvConfig

pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

ROOT = Path(__file__).parents[2]

PROGRAM = """
import subprocess, sys
from pathlib import Path
from tests.forked_commands import start_command

def run(errors):
    process = start_command(words, Path.cwd(), errors)
    process.join()
    return process.exitcode

size, folder, *words = sys.argv[1:]
folder = Path(folder)
subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=True)
folder.with_suffix(".code").write_text(str(run(folder.with_suffix(".first"))))
folder.with_suffix(".parts").write_text(" ".join(map(str, folder.rglob("*.part"))))
subprocess.run(["mount", "-o", "remount,size=300m", "tmpfs", folder], check=True)
sys.exit(run(folder.with_suffix(".second")))
"""
"""Runs a command on a disk of a size, and again with more space."""

SHORT = ("--episodes", "1", "--set", "max_seconds=10", "--set", "traffic=none", "--workers", "0")

COMMANDS: dict[str, tuple[str, ...]] = {
    "train": ("train", "toto", "--corpus", "CORPUS", "--seeds", "1", "--encoder", "hashing", "--workers", "1"),
    "train-rl": ("train-rl", "a2c", "--steps", "512", "--environments", "2", "--evaluate-every", "256", *SHORT),
    "two trainings": ("train", "toto", "--corpus", "CORPUS", "--seeds", "2", "--encoder", "hashing", "--workers", "2"),
    "table": ("table", "--corpus", "CORPUS", "--models", "tfidf", "--seeds", "1"),
    "dqn": ("train-rl", "dqn", "--steps", "512", "--environments", "2", "--evaluate-every", "256", *SHORT),
}


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("corpus")
    generate_corpus(folder, sessions=12, seed=2, workers=1, config=EnvConfig(max_seconds=60.0))
    return folder


@pytest.fixture
def disk(tmp_path: Path) -> Path:
    """Folder where a process in a user namespace can mount a file system."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["unshare", "--user", "--map-root-user", "--mount", "mount", "-t", "tmpfs", "tmpfs", str(folder)]
    if shutil.which("unshare") is None or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("no file system can be mounted in a user namespace")
    return folder


def check_command_on_full_disk(name: str, size: str, corpus: Path, disk: Path) -> bool:
    """Runs a command on a disk of a size, and again with more space; returns whether the disk was full."""
    words = [str(corpus) if word == "CORPUS" else word for word in COMMANDS[name]]
    again = subprocess.run(
        ["unshare", "--user", "--map-root-user", "--mount", sys.executable, "-c", PROGRAM, size, str(disk), *words,
         "--out", str(disk / "run")],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False, timeout=240,
    )  # fmt: skip
    first, code = disk.with_suffix(".first").read_text(), int(disk.with_suffix(".code").read_text())
    full = code != 0
    if full:
        last = first.splitlines()[-1]
        assert re.fullmatch(rf"Error: {disk}/run/\S+: No space left on device; make space and run.*", last), first
        assert code == 1 and first.count("Error") == 1 and "Traceback" not in first
        assert disk.with_suffix(".parts").read_text() == ""
    assert again.returncode == 0, again.stderr + disk.with_suffix(".second").read_text()
    return full


@pytest.mark.long
@pytest.mark.parametrize(("name", "size"), [("train", "300k"), ("train-rl", "200k")])
def test_training_on_full_disk_is_reported_and_goes_on(name: str, size: str, corpus: Path, disk: Path) -> None:
    assert check_command_on_full_disk(name, size, corpus, disk)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", COMMANDS)
def test_disks_of_many_sizes(name: str, corpus: Path, disk: Path) -> None:
    full = [check_command_on_full_disk(name, f"{size}k", corpus, disk) for size in (4, 60, 150, 400, 900, 2000, 5000)]
    assert full[0]


def test_tensors_that_cannot_be_written_raise_an_error_of_the_system(tmp_path: Path) -> None:
    import torch

    from dorothie_gym.baselines.tensor_files import save_tensors

    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError, match="taken") as caught:
        save_tensors({"weights": torch.zeros(10)}, tmp_path / "taken")
    assert caught.value.errno is not None and caught.value.filename == str(tmp_path / "taken")
