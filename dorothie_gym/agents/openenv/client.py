"""Client of sessions by text over OpenEnv."""

from __future__ import annotations

from typing import Any

from openenv.core.client_types import StepResult
from openenv.core.env_client import EnvClient
from openenv.core.env_server.types import State

from dorothie_gym.agents.openenv.models import TextAction, TextObservation


class DorothieClient(EnvClient[TextAction, TextObservation, State]):
    """Client with typed actions and observations: `async with DorothieClient(base_url=URL) as env`."""

    def _step_payload(self, action: TextAction) -> dict[str, Any]:
        return dict(action.model_dump())

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[TextObservation]:
        reward, done = payload["reward"], payload["done"]
        observation = TextObservation(**{**payload["observation"], "done": done, "reward": reward})
        return StepResult(observation=observation, reward=reward, done=done)

    def _parse_state(self, payload: dict[str, Any]) -> State:
        return State(**payload)
