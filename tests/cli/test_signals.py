"""Ctrl-C and SIGTERM at any moment of a command: one line, the exit code of the signal, and no process left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.session.config import EnvConfig

pytestmark = pytest.mark.skipif(os.name != "posix", reason="process groups of POSIX")

ROOT = Path(__file__).parents[2]

COMMANDS: dict[str, tuple[str, ...]] = {
    "generate": ("generate", "--sessions", "40", "--workers", "2", "--out", "out"),
    "generate alone": ("generate", "--sessions", "40", "--workers", "1", "--out", "out"),
    "run": ("run", "--out", "out", "--no-picture", "--speed", "1"),
    "rollout": ("rollout", "--sessions", "40", "--workers", "2", "--out", "out"),
    "train": ("train", "toto", "--corpus", "CORPUS", "--seeds", "2", "--workers", "2", "--out", "out"),
    "train-rl": ("train-rl", "ppo", "--workers", "2", "--out", "out"),
    "evaluate": ("evaluate", "--corpus", "CORPUS", "--split", "all", "--model", "random", "--seeds", "99"),
}
"""Long commands by name; CORPUS stands for the folder of a small corpus."""


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("corpus")
    generate_corpus(folder, sessions=6, seed=5, config=EnvConfig(max_seconds=8.0))
    return folder


def group(number: int) -> Iterator[int]:
    """Yields the living processes of a process group."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == number and fields[0] != "Z":
            yield int(folder.name)


def interrupted(
    name: str, corpus: Path, folder: Path, sent: signal.Signals, seconds: float, *, whole_group: bool = True
) -> None:
    """Starts a command, sends a signal after some seconds, and checks how it ends."""
    words = [str(corpus) if word == "CORPUS" else word for word in COMMANDS[name]]
    process = subprocess.Popen(
        [sys.executable, "-m", "dorothie_gym", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        text=True,
        start_new_session=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    time.sleep(seconds)
    (os.killpg if whole_group else os.kill)(process.pid, sent)
    _, errors = process.communicate(timeout=60)
    where = f"{name}, {sent.name} after {seconds} s: {errors}"
    if process.returncode != 0:  # it may have been faster
        assert process.returncode == 128 + sent or (process.returncode == -sent and seconds < 0.5), where
        assert "Traceback" not in errors and errors.count("\n") == (process.returncode > 0), where
    since = time.monotonic()
    while list(group(process.pid)) and time.monotonic() - since < 3.0:
        time.sleep(0.05)  # the last process to end is multiprocessing's own, after the command
    left = list(group(process.pid))
    for number in left:
        os.kill(number, signal.SIGKILL)
    assert not left, where


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "sent", "seconds"),
    [
        ("generate", signal.SIGINT, 0.2),
        ("generate", signal.SIGINT, 2.0),
        ("generate", signal.SIGTERM, 4.0),
        ("run", signal.SIGTERM, 0.5),
        ("rollout", signal.SIGINT, 1.0),
        ("train", signal.SIGINT, 3.0),
        ("train-rl", signal.SIGINT, 4.0),
        ("evaluate", signal.SIGINT, 1.0),
    ],
)
def test_signal_ends_a_command_with_one_line_and_no_process_left(
    name: str, sent: signal.Signals, seconds: float, corpus: Path, tmp_path: Path
) -> None:
    interrupted(name, corpus, tmp_path, sent, seconds)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", COMMANDS)
def test_signals_at_many_moments(name: str, corpus: Path, tmp_path: Path) -> None:
    for sent in (signal.SIGINT, signal.SIGTERM):
        for seconds in (0.05, 0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0):
            folder = tmp_path / f"{sent}-{seconds}"
            folder.mkdir()
            interrupted(name, corpus, folder, sent, seconds, whole_group=sent == signal.SIGINT)
