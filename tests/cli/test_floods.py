"""Servers of the commands under floods: people come and stay, and the command ends at Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from tests.flooded_servers import SERVERS, FloodedServer
from tests.floods import KINDS

COUNTS = {"idle": 1100, "half_headers": 1100, "half_bodies": 1100, "sockets": 520, "requests": 200, "pipelined": 60}

COMING, GAP, ENDING, LINES = 2.0, 0.5, 5.0, 10
"""Longest time to come, between two signs of life at a seat, and to end [s]; most lines of the log."""


@pytest.mark.long
@pytest.mark.parametrize("server", ["console", "study"])
def test_people_take_part_while_all_floods_begin(server: str, tmp_path: Path) -> None:
    """Beside other tests, which take the processor too, people come and the server ends, whenever that is."""
    found, log = flood(server, "mixed", tmp_path, seconds=1.5, count=350)
    assert found["lines"] <= LINES, log[:2000]


@pytest.mark.slow
@pytest.mark.parametrize("server", SERVERS)
@pytest.mark.parametrize("kind", KINDS)
def test_people_take_part_during_a_short_flood(kind: str, server: str, tmp_path: Path) -> None:
    check_flood(server, kind, tmp_path, seconds=5.0, count=COUNTS.get(kind, 100))


@pytest.mark.slow
@pytest.mark.parametrize("server", SERVERS)
@pytest.mark.parametrize("kind", COUNTS)
def test_people_take_part_during_a_flood(kind: str, server: str, tmp_path: Path) -> None:
    check_flood(server, kind, tmp_path, seconds=60.0, count=COUNTS[kind])


def check_flood(server: str, kind: str, folder: Path, *, seconds: float, count: int) -> None:
    """Checks what a flood does within the limits, on a machine that does nothing else."""
    found, log = flood(server, kind, folder, seconds=seconds, count=count)
    assert found["coming"] < COMING and found["gap"] < GAP and found["ending"] < ENDING, found
    assert found["lines"] <= LINES, log[:2000]


def flood(server: str, kind: str, folder: Path, *, seconds: float, count: int) -> tuple[dict[str, float], str]:
    """Floods a server in which somebody sits, lets others come, and ends the server during the flood.

    Returns:
        Longest waits [s] and the number of lines of the log; the log.
    """
    with SERVERS[server](folder) as running:
        command = [sys.executable, "-m", "tests.floods", kind, running.port, seconds + 30.0, count]
        with subprocess.Popen([*map(str, command), running.PAGE, running.FORM]) as flooding:
            try:
                waits = come_for(running, seconds)
                gap = max(running.gaps)
                began = time.monotonic()
                running.process.send_signal(signal.SIGINT)
                running.process.wait(60.0)
                ended = time.monotonic() - began
                assert flooding.poll() is None, "the flood has lasted to the end"
            finally:
                flooding.kill()
        log = running.log.read_text()
    found = {"coming": max(waits), "gap": gap, "ending": ended, "lines": len(log.splitlines())}
    print(f"{server}, {kind}: {found}")
    return found, log


def come_for(running: FloodedServer, seconds: float) -> list[float]:
    """Comes to a server again and again; returns how long each time took [s]."""
    waits: list[float] = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        began = time.monotonic()
        running.come()
        waits.append(time.monotonic() - began)
        time.sleep(0.3)
    return waits
