"""Mutated files of every kind are read, or refused by an error of one line, in bounded time and memory."""

from __future__ import annotations

import json
import selectors
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec

import pytest

from tests.malformed.subjects import SUBJECTS

PATIENCE = 20.0
"""Longest time that the reading of a file may take [s]."""

START = 240.0
"""Longest time until the first file is read [s]: imports, compiling and the originals."""

A_FEW = 8
"""Files of each kind without `--malformed-files`."""

GROUPS = (
    ("native", "release", "sample", "hub"),
    (
        "corpus",
        "annotations",
        "predictions",
        "storyboard",
        "study",
        "rollout",
        "cassette",
        "opendrive",
        "cache",
        "audio",
    ),
    ("yaml",),
    ("map-written", "map-left", "map-ends", "map-at-hand"),
    ("rl", "ad-wizard", "run", "benchmark", "co-wizard", "participant"),
)
"""Kinds that share a process, by the time that they take."""


def reported(process: subprocess.Popen[str]) -> Iterator[dict[str, object]]:
    """Yields what a batch reports; kills it when it is silent for too long."""
    assert process.stdout is not None
    last: dict[str, object] = {}
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        begun = time.monotonic()
        while True:
            if not selector.select(START if not last else PATIENCE):
                process.kill()
                yield {**last, "fault": f"nothing was heard for {time.monotonic() - begun:.0f} s"}
                return
            line = process.stdout.readline()
            if not line:
                yield {**last, "fault": f"the process died with code {process.wait()}"}
                return
            begun, last = time.monotonic(), json.loads(line)
            yield last
            if "end" in last:
                return


def faults_of_batch(kinds: tuple[str, ...], seed: int, count: int) -> list[dict[str, object]]:
    command = [sys.executable, "-m", "tests.malformed.batch", ",".join(kinds), str(seed), "0", str(count)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, bufsize=1) as process:
        faults = [report for report in reported(process) if "fault" in report]
        process.kill()
    return faults


def test_every_kind_of_file_is_in_a_group() -> None:
    assert sorted(kind for group in GROUPS for kind in group) == sorted(SUBJECTS)


@pytest.mark.long
@pytest.mark.timeout(0)
@pytest.mark.parametrize("kinds", GROUPS, ids="-".join)
def test_mutated_files_are_read_or_refused_in_one_line(kinds: tuple[str, ...], request: pytest.FixtureRequest) -> None:
    if "rl" in kinds and find_spec("sb3_contrib") is None:
        pytest.skip("needs the extra 'baselines'")
    total, seed = request.config.getoption("--malformed-files"), request.config.getoption("--malformed-seed")
    count = -(-total // len(SUBJECTS)) if total else (3 if kinds == ("yaml",) else A_FEW)
    faults = faults_of_batch(kinds, seed, count)
    assert not faults, "\n\n".join(f"{fault.get('kind')} {fault.get('number')}: {fault['fault']}" for fault in faults)
