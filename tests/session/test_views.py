"""Observations as views: equal to copies, replaced only by changes, and never kept by the policies that read them."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.policy import AnyPolicy, Players, TypedPolicy
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.view_arrays import SPEAKING, AdWizardArrays, CoWizardArrays, ParticipantArrays

CHANGING = {*SPEAKING, *ParticipantArrays._fields, *CoWizardArrays._fields, *AdWizardArrays._fields}


def scripted(engine: SessionEngine) -> dict[Role, AnyPolicy]:
    return {
        **{role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES},
        Role.AD_WIZARD: ScriptedAdWizard(engine.limits, rate=4.0),
    }


def play(engine: SessionEngine, seed: int, decisions: int) -> Any:
    policies = scripted(engine)
    players = Players(policies)
    engine.reset(seed)
    states = {role: policies[role].initial_state(policy_seed(seed, role), engine.town) for role in AGENT_ROLES}
    for _ in range(decisions):
        yield
        engine.step(players.decide(engine, states))


def test_views_equal_copies() -> None:
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=300.0))
    before: dict[tuple[str, str], Any] = {}
    kept = changed = 0
    for number, _ in enumerate(play(engine, 4, 101)):
        views = engine.observations.views(AGENT_ROLES)
        for agent, copy in engine.observations.of().items():
            assert views[agent].keys() == copy.keys()
            for name, value in copy.items():
                assert np.array_equal(views[agent][name], value), (agent, name, number)
                if name not in CHANGING:
                    same = before.get((agent, name)) is views[agent][name]
                    kept, changed = kept + same, changed + (not same)
                    before[agent, name] = views[agent][name]
    assert changed < kept / 10  # texts and tables that did not change are the same objects
    again = deepcopy(engine)
    shown, copied = again.observations.views(AGENT_ROLES), again.observations.of()
    assert all(np.array_equal(shown[agent][name], copied[agent][name]) for agent in copied for name in copied[agent])


def test_views_cannot_be_written_to() -> None:
    engine = SessionEngine("brookside")
    engine.reset(0)
    for view in engine.observations.views(AGENT_ROLES).values():
        for value in view.values():
            if isinstance(value, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    value[...] = 0


def test_views_of_a_past_decision_are_refused() -> None:
    engine = SessionEngine("brookside")
    observations = engine.reset(0)
    players = Players({role: make_policy("silent", role) for role in AGENT_ROLES})
    engine.step(players.decide(engine, dict.fromkeys(AGENT_ROLES)))
    with pytest.raises(RuntimeError, match="another decision"):
        observations.views(AGENT_ROLES)


class Forgetful(TypedPolicy[Any]):
    """Plays another policy, with observations that are overwritten as soon as it has decided."""

    def __init__(self, policy: TypedPolicy[Any]) -> None:
        super().__init__(policy.role, policy.limits)
        self._policy = policy

    def initial_state(self, seed: int, town: Any) -> Any:
        return self._policy.initial_state(seed, town)

    def act(self, observation: Any, state: Any) -> Any:
        own = {name: value.copy() if isinstance(value, np.ndarray) else value for name, value in observation.items()}
        found = self._policy.act(own, state)
        for value in own.values():
            if isinstance(value, np.ndarray):
                value.fill(77)
        return found


class Encoding(Forgetful):
    """Plays another policy with action dicts."""

    def step(self, observation: Any, state: Any) -> Any:
        assert isinstance(observation, dict) and observation["pose"].flags.writeable  # a copy
        return self._policy.step(observation, state)


@pytest.mark.parametrize("wrapper", [Forgetful, Encoding])
def test_policies_keep_no_views_and_need_no_dicts(wrapper: type[Forgetful]) -> None:
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=150.0))
    policies = scripted(engine)
    assert all(isinstance(policy, TypedPolicy) and policy.is_direct for policy in policies.values())
    trails = []
    for players in (policies, {role: wrapper(policy) for role, policy in policies.items()}):  # type: ignore[arg-type]
        play_session(engine, players, seed=11)
        trails.append((engine.session.trail, [each.text for each in engine.session.dialogue.said], engine.summary()))
    assert trails[0] == trails[1]
