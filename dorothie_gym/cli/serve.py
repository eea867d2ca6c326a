"""`dorothie-gym serve`: server of sessions for agents of other frameworks."""

from __future__ import annotations

import enum
from typing import Annotated

import typer

from dorothie_gym.agents.openenv import SESSIONS
from dorothie_gym.cli.options import needs
from dorothie_gym.cli.serving import LOCAL, Host, Port, address, check_libraries, listen, run_server
from dorothie_gym.cli.warm_up import compile_first


class Framework(enum.StrEnum):
    """Framework with a server of environments; the name is also that of the extra."""

    OPENENV = "openenv"


def serve(
    framework: Annotated[
        Framework, typer.Argument(metavar="openenv", help=f"Framework of the clients ({needs('openenv')}).")
    ],
    host: Host = LOCAL,
    port: Port = 8000,
    sessions: Annotated[int, typer.Option(min=1, max=10_000, help="Largest number of sessions at once.")] = SESSIONS,
) -> None:
    """Serve sessions by text for language-model agents, until Ctrl-C.

    Each connection plays sessions of its own; see docs/agents-openenv.md.
    """
    check_libraries(f"serve {framework}", str(framework), ("openenv", "uvicorn"))
    listener = listen(host, port)
    compile_first()
    from dorothie_gym.agents.openenv.server import make_server

    server = make_server(sessions)
    typer.echo(address(host, listener.getsockname()[1]), err=True)
    run_server(server, listener)
    raise KeyboardInterrupt  # nothing else ends the server, and uvicorn loses the interruption at times
