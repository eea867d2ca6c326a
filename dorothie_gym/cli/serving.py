"""Shared parts of commands with a web server: options, libraries, address, and the server."""

from __future__ import annotations

import socket
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.options import needs
from dorothie_gym.cli.output import fail

if TYPE_CHECKING:
    from starlette.applications import Starlette

LOCAL = "127.0.0.1"
"""Address that is reached from this machine only."""

PORT = 8023
"""Usual port."""

Host = Annotated[str, typer.Option(help="Address to listen at; by default only this machine reaches it.")]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port to listen at; 0 takes a free one.")]

_LIBRARIES = ("starlette", "uvicorn", "websockets")


def check_libraries(command: str) -> None:
    """Fails if a library of the extra `console` is missing."""
    for library in _LIBRARIES:
        if find_spec(library) is None:
            fail(f"{command} {needs('console')}: {library} is not installed; run: pip install 'dorothie-gym[console]'")


def listen(host: str, port: int) -> socket.socket:
    """Returns a socket that listens at an address; fails if it cannot be used."""
    listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)  # links work from now on
    except OSError as error:
        listener.close()
        fail(f"{host}:{port} cannot be used ({error.strerror}); give another --port, or 0 for a free one")
    return listener


def address(host: str, port: int) -> str:
    """Returns the address of a server for browsers."""
    return f"http://{f'[{host}]' if ':' in host else host}:{port}"


def serve(app: Starlette, listener: socket.socket) -> None:
    """Serves an application until Ctrl-C."""
    import uvicorn

    from dorothie_gym.console.messages import MAX_BYTES

    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        ws="websockets-sansio",
        ws_max_size=2 * MAX_BYTES,
        ws_per_message_deflate=False,
        server_header=False,
        timeout_graceful_shutdown=2,
    )
    uvicorn.Server(config).run(sockets=[listener])
