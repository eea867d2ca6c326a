"""Kills the annotation server again and again while a person marks, and looks at what it leaves.

On the way, the disk is full for a while at random moments.
"""

from __future__ import annotations

import http.client
import json
import os
import random
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dorothie_gym.lab.annotation.log import Action, AnnotationLog
from dorothie_gym.ontology import DialogueMove
from tests.full_disk import full_disk, wait_for
from tests.lab.annotation.builders import recorded

FULL = 0, 2, 3, 4, 6
"""Possible numbers of times that the disk is full during the life of a server."""

AT_WORK = 0.7
"""Share of the servers at which somebody is at work before anything happens; the others are struck while they start."""


class Annotator:
    """Person at a server that is killed and started again; keeps the link of the first start."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.token, self.base = folder, "", 0
        self.waiting: dict[str, object] | None = None
        self.failure: str | None = None
        self.moves = [move.label for move in DialogueMove]

    @contextmanager
    def server(self) -> Iterator[subprocess.Popen[str]]:
        command = [sys.executable, "-m", "dorothie_gym.cli", "annotate", "one", "--port", "0", "--json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=self.folder, env=os.environ) as process:
            try:
                assert process.stdout is not None
                found = json.loads(process.stdout.readline())
                self.address = found["address"].replace("/annotate", "/api/")
                if link := found["links"]["annotator"]:
                    assert not self.token, "the link of the first start goes on working"
                    self.token = link.split("#")[1]
                yield process
            finally:
                process.kill()

    def ask(self, path: str, body: object = None) -> dict[str, Any]:
        request = urllib.request.Request(
            self.address + path,
            data=None if body is None else json.dumps(body).encode(),
            headers={"Authorization": f"Bearer {self.token}"},
        )
        with urllib.request.urlopen(request, timeout=30) as answer:
            found: dict[str, Any] = json.load(answer)
            return found

    def mark(self) -> None:
        """Sends the edit that waits, or else the next one."""
        again = self.waiting is not None
        if self.waiting is None:
            row = {"speaker": "participant", "utterance": 0, "spans": [{"words": 4, "move": self.next_move(1)}]}
            self.waiting = {"base": self.base, "label": "x", "change": {"utterances": [row]}}
        self.base = self.ask("sessions/0/mark", {**self.waiting, "again": again})["edit"]
        self.waiting = None

    def mark_on_and_on(self) -> None:
        """Marks until the server is gone; keeps an answer that no server may give."""
        while True:
            try:
                self.mark()
            except urllib.error.HTTPError as error:
                if error.code not in (429, 507):
                    self.failure = f"{error.code}: {error.read()!r}"
                    return
                time.sleep(0.02)
            except (OSError, http.client.HTTPException):
                return

    def next_move(self, further: int = 0) -> str:
        return self.moves[(self.base + further) % len(self.moves)]


def kill_again_and_again(folder: Path, *, times: int, seed: int, longest: float = 1.0) -> dict[str, int]:
    """Lets a person mark at a server that is killed at random moments.

    Args:
        folder: an empty folder.
        times: number of kills.
        seed: seed of the moments.
        longest: longest life of a server after its start [s].

    Returns:
        Numbers of kills, full disks and edits that were acknowledged.
    """
    drawn, full = random.Random(seed), 0
    _, text = recorded(folder / "one")
    person = Annotator(folder)
    for _ in range(times):
        with person.server() as process:
            marking = threading.Thread(target=person.mark_on_and_on)
            before = person.base
            marking.start()
            if drawn.random() < AT_WORK:
                wait_for(lambda before=before: person.base > before)  # type: ignore[misc]
            time.sleep(drawn.random() * longest)
            for _ in range(drawn.choice(FULL)):
                full += 1
                with full_disk(drawn.choice([0, 1, 200, drawn.randrange(20_000)]), process.pid):
                    time.sleep(drawn.uniform(0.1, longest / 2))
                time.sleep(drawn.random() * longest)
            process.kill()
            marking.join(60.0)
            assert person.failure is None, person.failure
        log = AnnotationLog(text, folder / "one", "annotator")
        assert person.base <= log.edits <= person.base + 1, "at most one edit was not acknowledged"
    with person.server():
        if person.waiting is not None:
            person.mark()
        state = person.ask("sessions/0/marks")
    log = AnnotationLog(text, folder / "one", "annotator")
    assert state["edit"] == log.edits == person.base > 0
    labels = [line.change.utterances[0].spans[0].move for line in log.lines if line.action is Action.MARK]
    assert labels == [person.moves[edit % len(person.moves)] for edit in range(1, person.base + 1)]
    assert log.lines[0].action is Action.START
    assert not [path for path in (folder / "one").rglob("*") if path.name.endswith(".part")]
    return {"kills": times, "full_disks": full, "edits": person.base}
