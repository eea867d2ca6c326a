"""Server of sessions by text over OpenEnv: `dorothie-gym serve openenv`."""

from __future__ import annotations

from typing import Any, Final

from openenv.core.env_server.http_server import create_fastapi_app

from dorothie_gym.agents.openenv.environment import DorothieEnvironment
from dorothie_gym.agents.openenv.models import TextAction, TextObservation

SESSIONS: Final = 64
"""Usual largest number of sessions at once."""


_GRACE: Final = 5
"""Time for which open connections may go on after an interruption [s]."""


def make_app(sessions: int = SESSIONS) -> Any:
    """Returns the application, which takes up to `sessions` sessions at once."""
    return create_fastapi_app(DorothieEnvironment, TextAction, TextObservation, max_concurrent_envs=sessions)


def serve(host: str, port: int, sessions: int) -> None:
    """Serves until it is interrupted."""
    import uvicorn

    uvicorn.run(make_app(sessions), host=host, port=port, log_level="warning", timeout_graceful_shutdown=_GRACE)


app = make_app()
