"""Players for the tests, which other processes find by their module."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dorothie_gym.ontology import Role
from dorothie_gym.policies import Policy, SilentPolicy
from dorothie_gym.spaces import ActionDict, SpaceLimits


class Fainting(SilentPolicy):
    """Gives up after ten decisions in towns where it has an even seed."""

    def initial_state(self, seed: int, town: object) -> Any:
        return [seed % 2, 0]

    def step(self, observation: Mapping[str, Any], state: Any) -> tuple[ActionDict, Any]:
        odd, count = state
        if not odd and count == 10:
            raise RuntimeError("I feel faint")
        action, _ = super().step(observation, None)
        return action, [odd, count + 1]


def load_fainting(path: Path, role: Role, limits: SpaceLimits) -> Policy[Any]:
    if path.read_text() != "faint":
        raise ValueError(f"{path}: is no fainting policy")
    return Fainting(role, limits)
