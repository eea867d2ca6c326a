"""Servers of the commands in processes of their own, with people at them, for floods."""

from __future__ import annotations

import contextlib
import http.client
import json
import subprocess
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import websockets.sync.client as sockets
from websockets.exceptions import ConnectionClosed

from tests.lab.annotation.builders import recorded
from tests.lab.studies.content import SOLO, write_study
from tests.lab.studies.serving import Client

STUDY = {
    **SOLO,
    "tutorial": None,
    "session": {"max_seconds": 600.0, "pictures": False},
    "absence": {"seconds": 600.0, "then": "wait"},
}

STEADY = 30
"""Looks in a row without a long gap, by which a session has been loaded."""


class FloodedServer(ABC):
    """Server of a command, which others flood.

    Args:
        folder: folder for its files.

    Attributes:
        PAGE: path of its first page.
        FORM: path to which its page sends forms.
        log: file of its messages.
        process: the command.
        port: its port.
        gaps: times between two signs of life that somebody at a seat has received [s].
    """

    PAGE: ClassVar[str]
    FORM: ClassVar[str]

    def __init__(self, folder: Path) -> None:
        self.log = folder / "log"
        command = [sys.executable, "-m", "dorothie_gym.cli", *self._command(folder), "--port", "0", "--json"]
        with self.log.open("w") as errors:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
        self.gaps: list[float] = []
        self._leaves = False
        self._person = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> FloodedServer:
        with contextlib.ExitStack() as stack:
            stack.push(self.__exit__)
            assert self.process.stdout is not None
            self.port = self._read_links(json.loads(self.process.stdout.readline()))
            self._person.start()
            while len(self.gaps) < STEADY or max(self.gaps[-STEADY:]) > 0.4:
                assert self._person.is_alive(), self.log.read_text()
                time.sleep(0.1)
            self.gaps.clear()
            stack.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        self._leaves = True
        self.process.kill()
        self.process.communicate()
        if self._person.is_alive():
            self._person.join(40.0)

    @abstractmethod
    def _command(self, folder: Path) -> list[str]:
        """Returns the words of the command."""

    @abstractmethod
    def _read_links(self, printed: dict[str, Any]) -> int:
        """Keeps the links that the command has printed; returns its port."""

    @abstractmethod
    def _signs(self) -> Iterator[None]:
        """Sits at a seat; yields with each sign of life, until the server ends."""

    @abstractmethod
    def come(self) -> None:
        """Comes with the right link and gets what one comes for."""

    def _watch(self) -> None:
        last = None
        with contextlib.suppress(ConnectionClosed, OSError, http.client.HTTPException):
            for _ in self._signs():
                now = time.monotonic()
                if last is not None:
                    self.gaps.append(now - last)
                last = now
                if self._leaves:
                    return

    def _open_page(self) -> None:
        with self._connect() as window:
            assert ask(window, "GET", self.PAGE)

    def _connect(self) -> contextlib.closing[http.client.HTTPConnection]:
        return contextlib.closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=30))


class FloodedConsole(FloodedServer):
    """Console in which the person at the wheel sits, and spectators come."""

    PAGE, FORM = "/seat", "/speech/heard"

    def _command(self, folder: Path) -> list[str]:
        return ["console", "--no-pictures"]

    def _read_links(self, printed: dict[str, Any]) -> int:
        self._tokens = {name: link.rpartition("#")[2] for name, link in printed["links"].items()}
        return int(printed["links"]["co_wizard"].partition("/seat#")[0].rpartition(":")[2])

    def _signs(self) -> Iterator[None]:
        yield from frames(self.port, self._tokens["co_wizard"])

    def come(self) -> None:
        """Opens the page and sits down until the first view is shown."""
        self._open_page()
        shown = frames(self.port, self._tokens["spectator"])
        next(shown), next(shown)  # the greeting and the view
        shown.close()


class FloodedStudy(FloodedServer):
    """Study in which one person drives, and others come."""

    PAGE, FORM = "/", "/study/join"

    def _command(self, folder: Path) -> list[str]:
        return ["study", "run", str(write_study(folder, STUDY)), "--out", str(folder / "data")]

    def _read_links(self, printed: dict[str, Any]) -> int:
        return int(printed["link"].rstrip("/").rpartition(":")[2])

    def _signs(self) -> Iterator[None]:
        person = Client(self.port)
        person.do("join")
        person.do("consent", {"agreed": [True, True]})
        person.do("answers", {"stage": "before", "answers": {"age": 30}})
        person.do("proceed", {"stage": "instructions"})
        person.follow(lambda: person.view.get("token"))
        yield from frames(self.port, person.view["token"])

    def come(self) -> None:
        """Opens the link, takes part and consents."""
        self._open_page()
        person = Client(self.port)
        person.do("join")
        person.do("consent", {"agreed": [True, True]})


class FloodedAnnotation(FloodedServer):
    """Annotation tool in which Anna works all the time, and comes again in another window."""

    PAGE, FORM = "/annotate", "/api/sessions/0/mark"

    def _command(self, folder: Path) -> list[str]:
        recorded(folder / "corpus" / "one")
        return ["annotate", str(folder / "corpus"), "--annotator", "anna"]

    def _read_links(self, printed: dict[str, Any]) -> int:
        address, _, token = printed["links"]["anna"].partition("/annotate#")
        self._secret = {"Authorization": f"Bearer {token}"}
        return int(address.rpartition(":")[2])

    def _signs(self) -> Iterator[None]:
        row = {"speaker": "participant", "utterance": 0, "spans": [{"words": 4, "move": "Instruct"}]}
        with self._connect() as window:
            state = json.loads(ask(window, "GET", "/api/sessions/0/marks", headers=self._secret))
            while True:
                body = {"base": state["edit"], "change": {"utterances": [row]}, "label": "test"}
                state = json.loads(ask(window, "POST", self.FORM, json.dumps(body).encode(), self._secret))
                yield
                time.sleep(0.1)

    def come(self) -> None:
        """Opens the page, and the session."""
        self._open_page()
        with self._connect() as window:
            ask(window, "GET", "/api/seat", headers=self._secret)
            ask(window, "GET", "/api/sessions/0", headers=self._secret)


SERVERS: dict[str, type[FloodedServer]] = {
    "console": FloodedConsole,
    "study": FloodedStudy,
    "annotation": FloodedAnnotation,
}


def frames(port: int, token: str) -> Iterator[None]:
    """Sits down at a seat; yields with each message."""
    with sockets.connect(f"ws://127.0.0.1:{port}/ws", max_size=2**22, max_queue=None, open_timeout=30) as seat:
        seat.send(json.dumps({"k": "join", "token": token}))
        while True:
            seat.recv(timeout=30)
            yield


def ask(
    connection: http.client.HTTPConnection,
    method: str,
    path: str,
    body: bytes | None = None,
    headers: dict[str, str] | None = None,
) -> bytes:
    """Sends a request that must succeed; returns the content of the answer."""
    connection.request(method, path, body, headers or {})
    answer = connection.getresponse()
    content = answer.read()
    assert answer.status == 200, (path, answer.status, content[:200])
    return content
