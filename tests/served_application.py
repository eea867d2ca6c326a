"""Web application on a free port of this machine, in a thread of the test."""

from __future__ import annotations

import threading
from typing import Any, Self

import uvicorn


class ServedApplication:
    """Application that uvicorn serves while the context is open.

    Attributes:
        port: of the server.
    """

    port: int

    def __init__(self, application: Any, port: int = 0, **options: Any) -> None:
        self.server = uvicorn.Server(uvicorn.Config(application, port=port, log_level="warning", **options))
        self.thread = threading.Thread(target=self.server.run, daemon=True)

    def __enter__(self) -> Self:
        self.thread.start()
        while not self.server.started:
            assert self.thread.is_alive()
            threading.Event().wait(0.02)
        self.port = self.server.servers[0].sockets[0].getsockname()[1]
        return self

    def __exit__(self, *error: object) -> None:
        self.server.should_exit = True
        self.thread.join(60.0)
        assert not self.thread.is_alive()
