"""Sessions with random actions."""

from __future__ import annotations

from typing import Any

from dorothie_gym import DuoWizardEnv


def played(env: DuoWizardEnv, decisions: int = 4, seed: int = 3) -> dict[str, Any]:
    """Returns the observations after some decisions with random actions."""
    observations: dict[str, Any]
    observations, _ = env.reset(seed=seed)
    for agent in env.possible_agents:
        env.action_space(agent).seed(seed)
    for _ in range(decisions):
        actions = {agent: env.action_space(agent).sample() for agent in env.agents}
        observations, *_ = env.step(actions)
    return observations
