"""`dorothie-gym serve`: server of sessions for agents of other frameworks."""

from __future__ import annotations

import enum
from importlib import import_module
from typing import Annotated

import typer

from dorothie_gym.cli.options import needs
from dorothie_gym.cli.output import fail
from dorothie_gym.support.installation import pip_install


class Framework(enum.StrEnum):
    """Framework with a server of environments."""

    OPENENV = "openenv"


def serve(
    framework: Annotated[
        Framework, typer.Argument(metavar="openenv", help=f"Framework of the clients ({needs('openenv')}).")
    ],
    host: Annotated[str, typer.Option(metavar="HOST", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port.")] = 8000,
    sessions: Annotated[int, typer.Option(min=1, max=10_000, help="Largest number of sessions at once.")] = 64,
) -> None:
    """Serve sessions by text for language-model agents, until Ctrl-C.

    Each connection plays sessions of its own; see docs/agents-openenv.md.
    """
    try:
        server = import_module(f"dorothie_gym.agents.{framework}.server")
    except ModuleNotFoundError as error:
        fail(f"serve {framework} needs {error.name}, which is not installed; run: {pip_install('openenv')}")
    typer.echo(f"http://{host}:{port}", err=True)
    server.serve(host, port, sessions)
