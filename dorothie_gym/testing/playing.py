"""Sessions played in code with every action kept, and the comparison of observations and actions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.spaces.actions import ActionDict, ActionMapping

if TYPE_CHECKING:
    from dorothie_gym.session.scenario import Scenario

ByAgent: TypeAlias = dict[str, ActionDict]
"""Observations, infos or actions of all agents."""

ParallelSession: TypeAlias = Any
"""A `DuoWizardEnv`, or a wrapper around one that keeps its parallel API (PettingZoo's wrappers are untyped)."""


@dataclass(frozen=True)
class Decision:
    """One decision of a played session.

    Attributes:
        observations: observations of all agents, before the decision.
        infos: infos of all agents, before the decision.
        actions: actions of all agents; empty after the last decision.
    """

    observations: ByAgent
    infos: ByAgent
    actions: ByAgent


def play_random(env: ParallelSession, *, seed: int, decisions: int) -> Iterator[Decision]:
    """Plays a session with actions sampled from the action masks, starting with the reset."""
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
    """Plays a session with the scripted policies, starting with the reset."""
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
    env: ParallelSession, scenario: Scenario, actions: Sequence[Mapping[str, ActionMapping]]
) -> Iterator[tuple[ByAgent, ByAgent]]:
    """Plays a scenario with given actions; yields observations and infos, starting with those of the reset."""
    yield env.reset(options={"scenario": scenario})
    for action in actions:
        if not env.agents:
            return
        observations, _, _, _, infos = env.step(action)
        yield observations, infos


# --- comparison -------------------------------------------------------------------------------------------------------


def first_unequal(one: object, other: object, path: str = "") -> str | None:
    """Returns the path of the first part in which two nested values differ; None where they are equal to the bit.

    Mappings are compared by their keys, lists and tuples element by element, arrays and numbers by type, shape and
    bytes (so that NaN equals NaN), everything else by `==`.
    """
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for key in dict.fromkeys([*one, *other]):
            where = f"{path}.{key}" if path else str(key)
            if key not in one or key not in other:
                return where
            if (found := first_unequal(one[key], other[key], where)) is not None:
                return found
        return None
    if isinstance(one, np.ndarray | np.generic) or isinstance(other, np.ndarray | np.generic):
        left, right = np.asarray(one), np.asarray(other)
        same = left.dtype == right.dtype and left.shape == right.shape and left.tobytes() == right.tobytes()
        return None if same else path
    if isinstance(one, Sequence) and isinstance(other, Sequence) and not isinstance(one, str | bytes):
        if len(one) != len(other):
            return path
        parts = (first_unequal(a, b, f"{path}[{k}]") for k, (a, b) in enumerate(zip(one, other, strict=True)))
        return next((found for found in parts if found is not None), None)
    return None if one == other else path
