"""A film whose process is killed can be watched until then."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import os, sys
from pathlib import Path
import numpy as np
from dorothie_gym.cli.output import video_writer

writer = video_writer(Path(sys.argv[1]), 10.0)
noise = np.random.default_rng(0)
for number in range(600):
    writer.append_data(noise.integers(0, 256, (96, 160, 3), dtype=np.uint8))
print("written", flush=True)
sys.stdin.read()
"""


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pipes of imageio's reader
@pytest.mark.parametrize("name", ["film.mp4", "film.mov"])
def test_film_of_a_killed_process_can_be_watched(name: str, tmp_path: Path) -> None:
    imageio = pytest.importorskip("imageio.v2")
    path = tmp_path / name
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    )
    assert process.stdin is not None and process.stdout is not None
    assert process.stdout.readline() == b"written\n"
    os.killpg(process.pid, signal.SIGKILL)
    process.wait(timeout=20)
    process.stdin.close()
    process.stdout.close()
    with imageio.get_reader(path) as film:
        frames = sum(1 for _ in film)
    assert frames >= 100
