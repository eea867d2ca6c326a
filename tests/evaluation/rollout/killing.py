"""Kills `dorothie-gym generate` again and again, and looks at what it leaves.

`python -m tests.evaluation.rollout.killing --times 50` kills it (SIGKILL, its workers too) at 50 random moments, lets
it end, and compares every byte with an undisturbed run. Prints one line of JSON; fails where a session was lost or
differs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dorothie_gym.evaluation.rollout import finished_sessions, generate_corpus
from dorothie_gym.session.config import EnvConfig

ROOT = Path(__file__).parents[3]


def contents(root: Path) -> dict[str, str]:
    """A hash of every file below a folder."""
    files = (path for path in sorted(root.rglob("*")) if path.is_file())
    return {str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def begin(
    out: Path, *, sessions: int, seconds: float, workers: int, seed: int = 5, more: Mapping[str, Any] | None = None
) -> subprocess.Popen[str]:
    """Starts `generate`, with `more` options, in a process group of its own."""
    settings = {"out": out, "sessions": sessions, "seed": seed, "max-seconds": seconds, "workers": workers}
    settings |= more or {}
    arguments = [str(part) for name, value in settings.items() for part in (f"--{name}", value)]
    return subprocess.Popen(
        [sys.executable, "-m", "dorothie_gym.cli", "generate", *arguments],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        text=True,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def _wait_for_work(process: subprocess.Popen[str], root: Path) -> None:
    """Returns when something is written of a session, or the process has ended."""
    began = time.time()
    while process.poll() is None:
        try:
            if any(path.stat().st_mtime > began for path in root.glob(".parts/*/*.journal")):
                return
        except FileNotFoundError:
            return  # that one has just been finished
        time.sleep(0.05)


def kill_again_and_again(
    folder: Path, *, times: int, sessions: int, seconds: float, longest: float, seed: int = 0
) -> dict[str, Any]:
    """Makes a corpus undisturbed and another one that is killed on the way, and compares them.

    Args:
        folder: where both are made.
        times: how often it is killed.
        sessions: of the corpus.
        seconds: simulated seconds after which a session is cut off.
        longest: it is killed within so many seconds after its start, or mostly, after it has begun to play a session.
        seed: of the moments.

    Raises:
        AssertionError: a finished session was lost or changed, or the bytes differ in the end.
    """
    generate_corpus(folder / "one", sessions=sessions, seed=5, config=EnvConfig(max_seconds=seconds))
    moments, two = random.Random(seed), folder / "two"
    kept: dict[str, str] = {}
    finished: list[int] = []
    for _ in range(times):
        process = begin(two, sessions=sessions, seconds=seconds, workers=2)
        if moments.random() < 0.8:  # the others die while they start
            _wait_for_work(process, two)
        time.sleep(moments.uniform(0.0, longest))
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        there = {name: found for name, found in contents(two).items() if name[0] in "tv"} if two.is_dir() else {}
        assert kept.items() <= there.items(), "no finished session is lost or changed"
        kept = there
        finished.append(finished_sessions(two, sessions=sessions, seed=5))
        print(f"killed {len(finished)} times, {finished[-1]} of {sessions} sessions finished", file=sys.stderr)
    process = begin(two, sessions=sessions, seconds=seconds, workers=2)
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    assert contents(two) == contents(folder / "one"), "the bytes are those of an undisturbed run"
    return {"killed": times, "sessions": sessions, "finished_after_each": finished}


def main() -> None:
    """Kills as often as the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--sessions", type=int, default=24)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--longest", type=float, default=3.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = kill_again_and_again(
            Path(folder), times=asked.times, sessions=asked.sessions, seconds=asked.seconds, longest=asked.longest
        )
    print(json.dumps(found))


if __name__ == "__main__":
    main()
