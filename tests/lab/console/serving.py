"""Console on a free port of this machine, in a thread of the test."""

from __future__ import annotations

import contextlib
import json
import urllib.error
import urllib.request
from collections.abc import Iterator
from typing import Any

import websockets.sync.client as sockets

from dorothie_gym.lab.console.room import Room
from dorothie_gym.lab.console.server import Console
from tests.served_application import ServedApplication


class Served(ServedApplication):
    """Console that runs on a free port in a thread."""

    def __init__(self, room: Room, **options: Any) -> None:
        self.room, self.console = room, Console([room])
        super().__init__(self.console.app(), **options)

    def get(self, path: str) -> tuple[int, Any, bytes]:
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.port}{path}", timeout=10) as answer:
                return answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.headers, error.read()

    @contextlib.contextmanager
    def connect(self, token: str | None = None, **options: Any) -> Iterator[Any]:
        with sockets.connect(f"ws://127.0.0.1:{self.port}/ws", max_size=2**22, **options) as socket:
            if token is not None:
                socket.send(json.dumps({"k": "join", "token": token}))
            yield socket
