"""Study on a free port of this machine, in a thread of the test, and people without browsers."""

from __future__ import annotations

import contextlib
import http.client
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import websockets.sync.client as sockets

from dorothie_gym.lab.studies.folder import running_study
from dorothie_gym.lab.studies.server import StudyServer
from dorothie_gym.lab.web import WebServer, web_server


class ServedStudy:
    """Study that runs on a free port in a thread."""

    def __init__(self, file: Path, data: Path) -> None:
        self.file, self.data = file, data
        self.port = 0
        self.study: StudyServer | None = None
        self._server: WebServer | None = None
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        try:
            with running_study(self.file, self.data) as (study, records):  # SQLite belongs to one thread
                self.study = StudyServer(study, self.file.parent, records)
                self._server = web_server(self.study.app(), timeout_graceful_shutdown=1)
                listener = socket.create_server(("127.0.0.1", self.port))
                self.port = listener.getsockname()[1]
                self._server.run([listener])
        except BaseException as error:
            self._failure = error
            raise

    def __enter__(self) -> ServedStudy:
        self._thread.start()
        while self._server is None or not self._server.started:
            assert self._thread.is_alive(), self._failure
            time.sleep(0.02)
        return self

    def __exit__(self, *error: object) -> None:
        assert self._server is not None
        self._server.should_exit = True
        self._thread.join(60.0)  # on a busy machine
        assert not self._thread.is_alive()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"


class Client:
    """Person without a browser, who sends the requests of the page."""

    def __init__(self, port: int) -> None:
        self._port, self.cookie, self.tag = port, "", ""
        self.view: dict[str, Any] = {}
        self.answer: dict[str, Any] = {}
        self.received = b""
        self.headers: dict[str, str] = {}

    @property
    def port(self) -> int:
        """Port of the server; a cookie that has it in its name is for the next server if that is another one."""
        return self._port

    @port.setter
    def port(self, port: int) -> None:
        self.cookie = self.cookie.replace(f"_{self._port}=", f"_{port}=")
        self._port = port

    def send(self, method: str, path: str, body: bytes | None = None, headers: dict[str, str] | None = None) -> Any:
        """Returns status, headers and content of an answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        try:
            cookie = {"Cookie": self.cookie} if self.cookie else {}
            connection.request(method, path, body, {**cookie, **self.headers, **(headers or {})})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def post(self, name: str, body: object = None) -> int:
        """Sends a request of the page; returns the status, and keeps the view of a participant."""
        content = json.dumps({} if body is None else body).encode()
        status, headers, answer = self.send("POST", f"/study/{name}", content, {"Content-Type": "application/json"})
        if "Set-Cookie" in headers:
            self.cookie = headers["Set-Cookie"].partition(";")[0]
        self.answer = json.loads(answer)
        self.received += answer
        if status == 200:
            self.view, self.tag = self.answer, headers["ETag"]
        return int(status)

    def do(self, name: str, body: object = None) -> None:
        """Sends a request that must succeed."""
        status = self.post(name, body)
        assert status == 200, (status, self.answer)

    @property
    def stage(self) -> str:
        return str(self.view["stage"])

    def follow(self, reached: Callable[[], object], seconds: float = 40.0) -> None:
        """Asks for news until something is true."""
        end = time.monotonic() + seconds
        while not reached():
            assert time.monotonic() < end, f"not in time: {self.view}"
            self.do("news", {"have": self.tag})

    def enter(self, parameters: dict[str, str] | None = None) -> None:
        """Goes from the link to the waiting room, past the tutorial."""
        self.do("join", {"parameters": parameters or {}})
        self.do("consent", {"agreed": [True, True]})
        self.do("answers", {"stage": "before", "answers": {"age": 30}})
        self.do("proceed", {"stage": "instructions"})
        self.do("proceed", {"stage": "tutorial"})

    def finish(self, comment: str = "") -> None:
        """Goes from the end of the session to the completion code."""
        self.follow(lambda: self.view.get("over"))
        self.do("proceed", {"stage": "session"})
        self.do("answers", {"stage": "after", "answers": {"trust": 5, "comment": comment}})
        self.do("proceed", {"stage": "debriefing"})

    @contextlib.contextmanager
    def sit(self) -> Iterator[Any]:
        """Sits down at the seat of the session, or tutorial."""
        self.follow(lambda: self.view.get("token"))
        with sockets.connect(f"ws://127.0.0.1:{self.port}/ws", max_size=2**22, max_queue=None) as socket:
            socket.send(json.dumps({"k": "join", "token": self.view["token"]}))
            yield socket

    def say(self, socket: Any, text: str) -> None:
        """Says something and waits until it is over."""
        socket.send(json.dumps({"k": "say", "n": 1, "text": text}))
        end = time.monotonic() + 20.0
        while time.monotonic() < end:
            message = json.loads(socket.recv(timeout=10))
            if any(text[:5] in line["text"] for line in message.get("talk", ())):
                return
        raise AssertionError("it was not said")


def at_once(*runs: Callable[[], object]) -> None:
    """Runs something for several people at the same time; raises the first error."""
    with ThreadPoolExecutor(len(runs)) as threads:
        for done in [threads.submit(run) for run in runs]:
            done.result()


def seat(*people: Client) -> None:
    """Lets people in the waiting room wait until each has a seat."""
    at_once(*(lambda person=person: person.follow(lambda: person.view.get("token")) for person in people))  # type: ignore[misc]
