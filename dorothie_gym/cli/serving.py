"""Shared parts of commands with a web server: options, libraries, address, and the server."""

from __future__ import annotations

import atexit
import gc
import socket
import sys
from collections.abc import Collection
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym.cli.output import fail
from dorothie_gym.support.installation import pip_install

if TYPE_CHECKING:
    from starlette.applications import Starlette
    from uvicorn import Server


LOCAL = "127.0.0.1"
"""Address that is reached from this machine only."""

PORT = 8023
"""Usual port."""

SWITCH_INTERVAL = 0.0005
"""Time after which a thread that computes lets another one run [s]. The thread of the connections waits so long after
each call of the system while a session computes: with the usual 5 ms, ten connections delay a picture by 50 ms."""

Host = Annotated[str, typer.Option(help="Address to listen at; by default only this machine reaches it.")]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port to listen at; 0 takes a free one.")]

_LIBRARIES = ("starlette", "uvicorn", "websockets")


def check_libraries(command: str, extra: str = "console", libraries: Collection[str] = _LIBRARIES) -> None:
    """Fails if a library of an extra that a command needs is missing."""
    for library in libraries:
        if find_spec(library) is None:
            fail(f"{command} needs {library}, which is not installed; run: {pip_install(extra)}")


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


def serve(app: Starlette, listener: socket.socket, host: str) -> None:
    """Serves an application until Ctrl-C.

    Args:
        app: the application.
        listener: socket that listens.
        host: name or address that was given with `--host`.
    """
    from dorothie_gym.lab.web import web_server

    run_server(web_server(app, host_names=[host]), listener)


def run_server(server: Server, listener: socket.socket) -> None:
    """Runs a server until Ctrl-C.

    Args:
        server: the server.
        listener: socket that listens.
    """
    atexit.register(gc.freeze)  # a last search for garbage would take as long as a session has objects
    sys.setswitchinterval(SWITCH_INTERVAL)
    server.run(sockets=[listener])
