"""Web application on a free port of this machine, in a thread of the test."""

from __future__ import annotations

import socket
import threading
from typing import Any, Self

from dorothie_gym.lab.web import web_server


class ServedApplication:
    """Application that is served as by the commands while the context is open.

    Attributes:
        port: of the server.
    """

    port: int

    def __init__(self, application: Any, port: int = 0, **options: Any) -> None:
        self.server = web_server(application, **options)
        self.listener = socket.create_server(("127.0.0.1", port))
        self.port = self.listener.getsockname()[1]
        self.thread = threading.Thread(target=self.server.run, args=([self.listener],), daemon=True)

    def __enter__(self) -> Self:
        self.thread.start()
        while not self.server.started:
            assert self.thread.is_alive()
            threading.Event().wait(0.02)
        return self

    def __exit__(self, *error: object) -> None:
        self.server.should_exit = True
        self.thread.join(60.0)
        assert not self.thread.is_alive()
