"""Sessions played in code, with every action kept."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy

Actions = dict[str, dict[str, Any]]


def play_at_random(env: Any, *, seed: int, decisions: int) -> Iterator[tuple[Any, Any, Actions]]:
    """Yields observations, infos and the actions drawn from the masks, from the reset on; the last have no actions."""
    for k, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(seed + k)
    observations, infos = env.reset(seed=seed)
    for _ in range(decisions):
        if not env.agents:
            break
        actions = {agent: env.action_space(agent).sample(mask=infos[agent]["action_mask"]) for agent in env.agents}
        yield observations, infos, actions
        observations, _, _, _, infos = env.step(actions)
    yield observations, infos, {}


def play_by_script(env: Any, *, seed: int, decisions: int) -> Iterator[tuple[Any, Any, Actions]]:
    """As `play_at_random`, with the scripted policies."""
    observations, infos = env.reset(seed=seed)
    policies = {role: make_policy("scripted", role, env.unwrapped.limits) for role in AGENT_ROLES}
    states = {role: policy.initial_state(seed, env.unwrapped.town) for role, policy in policies.items()}
    for _ in range(decisions):
        if not env.agents:
            break
        actions: Actions = {}
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(observations[role], states[role])
        yield observations, infos, actions
        observations, _, _, _, infos = env.step(actions)
    yield observations, infos, {}


def replay(env: DuoWizardEnv, scenario: Scenario, actions: list[Actions]) -> Iterator[tuple[Any, Any]]:
    """Yields observations and infos of a scenario played with given actions, from the reset on."""
    yield env.reset(options={"scenario": scenario})
    for action in actions:
        if not env.agents:
            return
        observations, _, _, _, infos = env.step(action)
        yield observations, infos


def with_hidden_landmarks_moved(scenario: Scenario, env: DuoWizardEnv, rng: np.random.Generator) -> Scenario:
    """The scenario with its hidden landmarks at other sites, which are free."""
    board = scenario.storyboard
    taken = {landmark.site for landmark in board.landmarks}
    free = [site for site in env.town.sites if site.id not in taken]
    landmarks = list(board.landmarks)
    for k in [k for k, landmark in enumerate(landmarks) if landmark.hidden]:
        site = free.pop(int(rng.integers(len(free))))
        landmarks[k] = dataclasses.replace(
            landmarks[k],
            site=site.id,
            lane=site.lane,
            station=site.station,
            position=site.position,
            waypoint=site.waypoint,
            street=site.street,
        )
    return dataclasses.replace(scenario, storyboard=dataclasses.replace(board, landmarks=tuple(landmarks)))


def with_other_errands(scenario: Scenario) -> Scenario:
    """The scenario with a story of its own, and with every errand at the place of another one."""
    board = scenario.storyboard
    places = [subgoal.landmark for subgoal in board.subgoals]
    subgoals = tuple(
        dataclasses.replace(subgoal, landmark=place, description=f"errand {k}")
        for k, (subgoal, place) in enumerate(zip(board.subgoals, places[1:] + places[:1], strict=True))
    )
    return dataclasses.replace(scenario, storyboard=dataclasses.replace(board, story="A story.", subgoals=subgoals))


def digest(value: Any) -> str:
    """A hash of dicts, tuples, arrays, numbers and texts, to the last bit."""
    found = hashlib.sha256()

    def add(part: Any) -> None:
        if isinstance(part, Mapping):
            for key in part:  # in the order of the dict: that is to be the same too
                found.update(str(key).encode())
                add(part[key])
        elif isinstance(part, list | tuple):
            for item in part:
                add(item)
        elif isinstance(part, np.ndarray | np.generic):
            found.update(str((part.dtype, part.shape)).encode() + part.tobytes())
        else:
            found.update(repr(part).encode())

    add(value)
    return found.hexdigest()
