from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import dorothie_gym
from dorothie_gym.envs.single_role_v0 import SingleRole
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, RandomPolicy, SilentPolicy, make_policy
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.session.spaces import SpaceLimits, noop, observation_space


class RecordingPolicy(SilentPolicy):
    """Silent policy that records its seeds and observations."""

    observes = True

    def __init__(self, role: Role) -> None:
        super().__init__(role)
        self.seeds: list[int] = []
        self.seen: list[Mapping[str, Any]] = []

    def initial_state(self, seed: int, town: Any) -> None:
        self.seeds.append(seed)

    def step(self, observation: Mapping[str, Any], state: None) -> tuple[dict[str, Any], None]:
        self.seen.append(observation)
        return super().step(observation, state)


@pytest.mark.parametrize("role", AGENT_ROLES)
def test_role_acts_in_its_own_spaces(role: Role) -> None:
    env = SingleRole(role, partners={other: "random" for other in AGENT_ROLES if other is not role}, max_cycles=5)
    observation, info = env.reset(seed=3)
    env.action_space.seed(3)
    truncated = False
    while not truncated:
        assert env.observation_space.contains(observation)
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample(info["action_mask"]))
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        assert not terminated
    assert info["is_success"] is False
    with pytest.raises(ResetNeeded, match="reset"):
        env.step(noop(role, env.engine.limits))


def test_session_equals_one_played_by_three_policies() -> None:
    env = SingleRole("co_wizard", max_cycles=40)
    duo = dorothie_gym.DuoWizardEnv(max_cycles=40)
    policies = {role: make_policy("scripted", role) for role in AGENT_ROLES}
    observations, _ = duo.reset(seed=9)
    states = {role: policies[role].initial_state(policy_seed(9, role), duo.town) for role in AGENT_ROLES}
    mine, _ = env.reset(seed=9)
    while duo.agents:
        np.testing.assert_equal(mine, observations["co_wizard"])
        actions = {}
        for role in AGENT_ROLES:
            actions[str(role)], states[role] = policies[role].step(observations[role], states[role])
        observations, *_ = duo.step(actions)
        mine, *_ = env.step(actions["co_wizard"])
    np.testing.assert_equal(mine, observations["co_wizard"])


def test_partners_get_their_own_observations_and_session_seeds() -> None:
    partners = {"participant": RecordingPolicy(Role.PARTICIPANT), "ad_wizard": RecordingPolicy(Role.AD_WIZARD)}
    env = SingleRole("co_wizard", partners=partners)
    for seed in (1, 2, 1):
        env.reset(seed=seed)
        env.step(env.noop_action)
    for role, partner in partners.items():
        one, two, again = partner.seeds
        assert one == again != two
        assert observation_space(Role(role), env.engine.limits).contains(partner.seen[-1])
    assert partners["participant"].seeds[0] != partners["ad_wizard"].seeds[0]


def test_seeds_follow_gymnasium_convention() -> None:
    env = SingleRole("co_wizard", partners={"participant": "silent", "ad_wizard": "silent"})
    env.reset(seed=5)
    assert env.np_random_seed == 5
    assert env.engine.scenario.seed == 5
    env.reset()
    drawn = env.engine.scenario.seed
    env.reset(seed=5)
    env.reset()
    assert env.engine.scenario.seed == drawn != 5


def test_given_scenario_is_played() -> None:
    env = SingleRole("participant", partners={"co_wizard": "silent", "ad_wizard": "silent"})
    scenario = dorothie_gym.draw_scenario(env.engine.town, None, 77)
    env.reset(seed=1, options={"scenario": scenario})
    assert env.engine.scenario is scenario


def test_arguments_are_passed_by_gymnasium_make() -> None:
    policy = RandomPolicy(Role.AD_WIZARD)
    env = gym.make(
        "dorothie_gym/CoWizard-v0",
        town="brookside",
        storyboard="fetch_priya",
        config=dorothie_gym.EnvConfig(max_seconds=2.0),
        partners={"ad_wizard": policy},
        render_mode="rgb_array",
    )
    env.reset(seed=0)
    role = env.unwrapped
    assert isinstance(role, SingleRole)
    assert role.partners[Role.AD_WIZARD] is policy
    assert role.engine.scenario.storyboard.name == "fetch_priya"
    for expected in (False, False, False, True):
        assert env.step(role.noop_action)[3] is expected
    picture: Any = env.render()
    assert picture.dtype == np.uint8 and picture.shape[2] == 3
    env.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"role": "agent"}, "role is 'agent'; it must be one of participant, co_wizard, ad_wizard"),
        ({"role": "driver"}, "role is 'driver'"),
        ({"role": "co_wizard", "partners": {"co_wizard": "silent"}}, "partners has 'co_wizard'; the others are"),
        ({"role": "co_wizard", "partners": {"stranger": "silent"}}, "partners has 'stranger'"),
        ({"role": "co_wizard", "partners": {"ad_wizard": "clever"}}, "no policy 'clever'"),
        ({"role": "co_wizard", "partners": {"ad_wizard": SilentPolicy(Role.PARTICIPANT)}}, "a policy of participant"),
        (
            {"role": "co_wizard", "partners": {"ad_wizard": SilentPolicy(Role.AD_WIZARD, SpaceLimits(lanes=9))}},
            "other SpaceLimits",
        ),
        ({"role": "co_wizard", "render_mode": "ascii"}, "render_mode is 'ascii'"),
    ],
)
def test_error_names_invalid_argument(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SingleRole(**arguments)


def test_error_names_field_of_malformed_action() -> None:
    env = SingleRole("co_wizard", partners={"participant": "silent", "ad_wizard": "silent"})
    with pytest.raises(ResetNeeded):
        env.step(env.noop_action)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="action of co_wizard: field 'angle'"):
        env.step({**env.noop_action, "angle": 180})


def test_partner_policy_is_used_as_given() -> None:
    partner: Policy[Any] = SilentPolicy(Role.PARTICIPANT)
    env = SingleRole("ad_wizard", partners={Role.PARTICIPANT: partner})
    assert env.partners[Role.PARTICIPANT] is partner
