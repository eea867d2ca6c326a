from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.ontology import AGENT_ROLES, PhysicalAction, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.policies.navigation import NavigationAction, NavigationPolicy
from dorothie_gym.policies.navigation.actions import physical_of
from dorothie_gym.policies.navigation.demonstrations import DemonstrationRecorder, action_of
from dorothie_gym.policies.navigation.driver_view import driver_of
from dorothie_gym.policies.navigation.junction_exits import JunctionExits
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import CoWizardAction, Physical, noop
from tests.envs.navigation_drivers import obey


@pytest.fixture(scope="module")
def env() -> NavigationEnv:
    return NavigationEnv("brookside", guidance="goals")


def test_recorded_observations_equal_those_of_the_driver() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=120.0))
    seen: list[tuple[Any, int]] = []

    def drive(observation: Any, mask: Any) -> int:
        seen.append((observation, obey(observation, mask)))
        return seen[-1][1]

    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    policies[Role.CO_WIZARD] = NavigationPolicy(drive, env.limits)
    observations, _ = env.reset(seed=2)
    states = {role: policy.initial_state(policy_seed(2, role), env.town) for role, policy in policies.items()}
    recorder, lessons = DemonstrationRecorder(env.town), []
    while env.agents:
        actions = {}
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(observations[str(role)], states[role])
        done = CoWizardAction.decode(actions["co_wizard"], env.limits)
        before = len(seen)
        lesson = recorder.record(observations["co_wizard"], done)
        lessons.append((lesson, seen[-1] if len(seen) > before else None))
        observations, *_ = env.step(actions)
    driven = [lesson for lesson, _ in lessons if lesson is not None]
    assert len(driven) > 100 and len(seen) >= len(driven)
    watched = iter(seen)
    for lesson in driven:
        assert any(np.array_equal(lesson.observation, observation) for observation, _ in watched)
    assert {lesson.action for lesson in driven} > {NavigationAction.NOTHING, NavigationAction.STOP}


def test_action_of_inverts_physical_of(env: NavigationEnv) -> None:
    rng, exits = np.random.default_rng(0), JunctionExits(env.town)
    count = 0
    for seed in range(4):
        _, info = env.reset(seed=seed)
        for _ in range(60):
            action = NavigationAction(rng.choice(np.flatnonzero(info["action_mask"])))
            seen = env.session.observations((Role.CO_WIZARD,))[Role.CO_WIZARD]
            physical = physical_of(action, driver_of(seen, exits))
            set_as_asked = action in (NavigationAction.FASTER, NavigationAction.SLOWER, NavigationAction.LIGHTS)
            expected = NavigationAction.NOTHING if set_as_asked or physical is None else action
            assert action_of(physical, seen, exits) is expected
            count += expected is not NavigationAction.NOTHING
            _, _, over, cut, info = env.step(action)
            if over or cut:
                break
    assert count > 50


def test_unrequested_stop_is_left_out() -> None:
    env = DuoWizardEnv("brookside")
    observations, _ = env.reset(seed=0)
    player = NavigationPolicy(obey, env.limits)
    recorder, state = DemonstrationRecorder(env.town), player.initial_state(0, env.town)
    scripted = make_policy("scripted", Role.PARTICIPANT, env.limits)
    other = scripted.initial_state(0, env.town)
    lesson = None
    for _ in range(60):
        words, other = scripted.step(observations["participant"], other)
        driven, state = player.step(observations["co_wizard"], state)
        done = CoWizardAction.decode(driven, env.limits)
        lesson = recorder.record(observations["co_wizard"], done)
        if lesson is not None:
            break
        idle = noop(Role.AD_WIZARD, env.limits)
        observations, *_ = env.step({"participant": words, "co_wizard": driven, "ad_wizard": idle})
    assert lesson is not None
    stop = CoWizardAction(physical=Physical(action=PhysicalAction.STOP))
    assert recorder.record(observations["co_wizard"], stop) is None
