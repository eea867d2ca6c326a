import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import POLICY_NAMES, make_policy
from dorothie_gym.session.spaces import SpaceLimits, action_space, decode_action, noop, observation_space

ROLES = (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD)
LIMITS = SpaceLimits()


def same(first: dict, second: dict) -> bool:
    return first.keys() == second.keys() and all(np.array_equal(first[key], second[key]) for key in first)


@pytest.mark.parametrize("role", ROLES)
def test_silent_policy_does_nothing(role):
    policy = make_policy("silent", role, LIMITS)
    action, _ = policy.step({}, policy.initial_state(1, load_town("brookside")))
    assert same(action, noop(role, LIMITS))


@pytest.mark.parametrize("role", ROLES)
def test_random_policy_samples_the_action_space_from_its_seed(role):
    policy, town = make_policy("random", role, LIMITS), load_town("brookside")
    observation = observation_space(role, LIMITS).sample()
    first, state = policy.step(observation, policy.initial_state(3, town))
    again, _ = policy.step(observation, policy.initial_state(3, town))
    following, _ = policy.step(observation, state)
    assert first in action_space(role, LIMITS)
    assert same(first, again)
    assert not same(first, following)
    decode_action(role, first, LIMITS)


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("name", POLICY_NAMES)
def test_every_named_policy_exists_for_every_role(name, role):
    assert make_policy(name, role, LIMITS).role is role


def test_unknown_policy_raises_error_with_known_names():
    with pytest.raises(ValueError, match="scripted, silent, random"):
        make_policy("clever", Role.PARTICIPANT, LIMITS)


def test_agent_role_has_no_policy():
    with pytest.raises(ValueError, match="agent"):
        make_policy("silent", Role.AGENT, LIMITS)
