"""Server of sessions by text over OpenEnv: `dorothie-gym serve openenv`."""

from __future__ import annotations

import gc
from typing import Any, Final

import filterpy.kalman  # noqa: F401  # takes a second or more, for which no turn should wait: see `beliefs.refined`
import uvicorn
from openenv.core.env_server.http_server import create_fastapi_app

from dorothie_gym.agents.openenv import SESSIONS
from dorothie_gym.agents.openenv.environment import DorothieEnvironment
from dorothie_gym.agents.openenv.models import TextAction, TextObservation

_GRACE: Final = 5
"""Time for which open connections may go on after an interruption [s]."""

_FIRST_TURNS: Final = 12
"""Number of turns that are played before clients are let in."""


def make_app(sessions: int) -> Any:
    """Returns the application, which takes up to `sessions` sessions at once."""
    return create_fastapi_app(DorothieEnvironment, TextAction, TextObservation, max_concurrent_envs=sessions)


def make_server(sessions: int) -> uvicorn.Server:
    """Returns a server that has played some turns, with talk, so that no client waits for imports, models and maps."""
    environment = DorothieEnvironment()
    environment.reset(seed=0)
    for _ in range(_FIRST_TURNS):
        environment.step(TextAction(value='{"say": "Where should I go now?", "again": "5"}'))
    environment.close()
    gc.collect()
    gc.freeze()  # searches for garbage leave out what stays
    config = uvicorn.Config(make_app(sessions), log_level="warning", timeout_graceful_shutdown=_GRACE)
    return uvicorn.Server(config)


app = make_app(SESSIONS)
