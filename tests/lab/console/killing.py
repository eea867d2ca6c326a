"""Kills the console again and again while somebody talks, goes on with the session, and looks at what is recorded.

On the way, the disk is full for a while at random moments.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import websockets.sync.client as sockets
from websockets.exceptions import ConnectionClosed, InvalidMessage

from dorothie_gym.lab.console.resuming import interrupted_sessions
from dorothie_gym.session.recording import SeatEventKind, Session, read_seat_log
from tests.full_disk import full_disk, wait_for

FULL = 0.5
"""Share of the servers whose disk is full for a while."""

AT_WORK = 0.7
"""Share of the servers at which somebody is at work before anything happens; the others are struck while they start."""

LIVES = 6
"""Number of servers that go on with the same session; each plays all of it again."""

COMMAND = (
    sys.executable, "-m", "dorothie_gym.cli", "console", "--port", "0", "--json", "--no-pictures", "--after-absence",
    "wait", "--while-away", "continue",
)  # fmt: skip


class Talker:
    """Co-Wizard who says a new number again and again.

    Attributes:
        heard: numbers that the server has shown as said.
    """

    def __init__(self) -> None:
        self.heard: list[str] = []
        self._said = 0

    def talk(self, link: str) -> None:
        """Talks until the connection ends."""
        address, _, token = link.partition("/seat#")
        try:
            with sockets.connect(f"{address.replace('http', 'ws')}/ws", max_size=2**22, max_queue=None) as socket:
                socket.send(json.dumps({"k": "join", "token": token}))
                for n in range(1, 10**6):
                    self._said += 1
                    word = f"Number {self._said:05d}"
                    socket.send(json.dumps({"k": "say", "n": n, "text": f"{word}."}))
                    self._listen(socket, word)
        except (OSError, EOFError, ConnectionClosed, InvalidMessage, TimeoutError):
            return

    def _listen(self, socket: sockets.ClientConnection, word: str) -> None:
        end = time.monotonic() + 10.0
        while time.monotonic() < end:
            message = json.loads(socket.recv(timeout=10))
            if any(word in line["text"] for line in message.get("talk", ()) if line.get("who") == "co_wizard"):
                self.heard.append(word)
                return


@contextmanager
def console(out: Path, resumed: Path | None) -> Iterator[tuple[subprocess.Popen[str], str | None]]:
    """Runs a console; yields it and the link of the Co-Wizard."""
    words = ["--roles", "co_wizard=human,ad_wizard=silent"] if resumed is None else ["--resume", str(resumed)]
    with subprocess.Popen(
        [*COMMAND, "--out", str(out), *words], stdout=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            yield process, json.loads(line)["links"]["co_wizard"] if line else None
        finally:
            process.kill()


def recorded(folder: Path) -> set[str]:
    """Returns what was said at the seats of a session, which must load."""
    Session.load(folder)
    events = read_seat_log(folder) or ()
    return {str(event.data["text"]).rstrip(".") for event in events if event.kind is SeatEventKind.SAID}


def kill_again_and_again(out: Path, *, times: int, seed: int, longest: float = 3.0) -> dict[str, int]:
    """Lets a person talk at a console that is killed at random moments and goes on with the session.

    Args:
        out: folder of the sessions.
        times: number of kills.
        seed: seed of the moments.
        longest: longest life of a server after its start [s].

    Returns:
        Numbers of kills, full disks, sessions and sayings that were acknowledged.
    """
    drawn, full, sessions, heard = random.Random(seed), 0, 0, 0
    for number in range(times):
        if number % LIVES == 0:
            talker, folder, out_now = Talker(), None, out / f"session-{sessions}"
            sessions += 1
        with console(out_now, folder) as (process, link):
            assert link is not None, "a restart works"
            person = threading.Thread(target=talker.talk, args=(link,))
            before = len(talker.heard)
            person.start()
            if drawn.random() < AT_WORK:
                wait_for(lambda talker=talker, before=before: len(talker.heard) > before)  # type: ignore[misc]
            time.sleep(drawn.uniform(0.0, longest))
            if drawn.random() < FULL:
                full += 1
                with full_disk(drawn.choice([0, 1000, drawn.randrange(100_000)]), process.pid):
                    time.sleep(drawn.uniform(0.1, 1.0))
                time.sleep(drawn.uniform(0.0, 1.0))
            process.kill()
            person.join(60.0)
        if talker.heard:
            left = {each: recorded(each) for each in interrupted_sessions(out_now)}
            folder = next(each for each, said in left.items() if said >= set(talker.heard))
        if number % LIVES == LIVES - 1 or number == times - 1:
            heard += len(talker.heard)
    return {"kills": times, "full_disks": full, "sessions": sessions, "heard": heard}
