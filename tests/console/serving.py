"""Console on a free port of this machine, in a thread of the test."""

from __future__ import annotations

import contextlib
import json
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from typing import Any

import uvicorn
import websockets.sync.client as sockets

from dorothie_gym.console.messages import MAX_BYTES
from dorothie_gym.console.room import Room
from dorothie_gym.console.server import Console


class Served:
    """Console that runs on a free port in a thread."""

    def __init__(self, room: Room) -> None:
        self.room, self.console = room, Console([room])
        config = uvicorn.Config(
            self.console.app(), port=0, log_level="warning", ws="websockets-sansio", ws_max_size=2 * MAX_BYTES
        )  # fmt: skip
        self.server = uvicorn.Server(config)
        self.thread = threading.Thread(target=self.server.run, daemon=True)

    def __enter__(self) -> Served:
        self.thread.start()
        while not self.server.started:
            assert self.thread.is_alive()
            threading.Event().wait(0.02)
        self.port = self.server.servers[0].sockets[0].getsockname()[1]
        return self

    def __exit__(self, *error: object) -> None:
        self.server.should_exit = True
        self.thread.join(10.0)
        assert not self.thread.is_alive()

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
