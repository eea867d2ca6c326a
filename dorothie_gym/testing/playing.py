"""Sessions played in code, with every action kept."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy

ByAgent: TypeAlias = dict[str, dict[str, Any]]
"""Observations, infos or actions of all agents."""

ParallelSession: TypeAlias = Any
"""A `DuoWizardEnv`, or a wrapper around one that keeps its parallel API (PettingZoo's wrappers are untyped)."""


@dataclass(frozen=True)
class Decision:
    """One decision of a played session.

    Attributes:
        observations: of all agents, before the decision.
        infos: of all agents, before the decision.
        actions: of all agents; empty after the last decision.
    """

    observations: ByAgent
    infos: ByAgent
    actions: ByAgent


def play_random(env: ParallelSession, *, seed: int, decisions: int) -> Iterator[Decision]:
    """Plays a session with actions sampled from the action masks, from the reset on."""
    for k, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(seed + k)
    observations, infos = env.reset(seed=seed)
    for _ in range(decisions):
        if not env.agents:
            break
        actions = {agent: env.action_space(agent).sample(mask=infos[agent]["action_mask"]) for agent in env.agents}
        yield Decision(observations, infos, actions)
        observations, _, _, _, infos = env.step(actions)
    yield Decision(observations, infos, {})


def play_scripted(env: ParallelSession, *, seed: int, decisions: int) -> Iterator[Decision]:
    """Plays a session with the scripted policies, from the reset on."""
    observations, infos = env.reset(seed=seed)
    policies = {role: make_policy("scripted", role, env.unwrapped.limits) for role in AGENT_ROLES}
    states = {role: policy.initial_state(seed, env.unwrapped.town) for role, policy in policies.items()}
    for _ in range(decisions):
        if not env.agents:
            break
        actions: ByAgent = {}
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(observations[str(role)], states[role])
        yield Decision(observations, infos, actions)
        observations, _, _, _, infos = env.step(actions)
    yield Decision(observations, infos, {})


def play_again(
    env: ParallelSession, scenario: Scenario, actions: Sequence[Mapping[str, Mapping[str, Any]]]
) -> Iterator[tuple[ByAgent, ByAgent]]:
    """Plays a scenario with given actions; yields observations and infos, from the reset on."""
    yield env.reset(options={"scenario": scenario})
    for action in actions:
        if not env.agents:
            return
        observations, _, _, _, infos = env.step(action)
        yield observations, infos
