"""Environments in generated towns: another town for each seed, and pools of towns in batches."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym import DuoWizardEnv, NavigationEnv
from dorothie_gym.envs.navigation_vector_env import NavigationVectorEnv
from dorothie_gym.errors import TownError
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.maps import load_town
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.policies.policy_loader import make_policy

SERIES = "generated,size=small"


def test_each_seed_is_played_in_its_own_town() -> None:
    env = DuoWizardEnv(SERIES)
    spaces = [env.observation_space(agent) for agent in env.possible_agents]
    names = []
    for seed in (4, 5, 4):
        observations, _ = env.reset(seed=seed)
        names.append(env.town.name)
        assert env.session_header().town == env.town.name
        assert all(
            space.contains(observations[agent]) for agent, space in zip(env.possible_agents, spaces, strict=True)
        )
    assert names == [f"generated:{seed},size=small" for seed in (4, 5, 4)]


def test_scenario_is_played_in_the_town_of_its_seed() -> None:
    env = DuoWizardEnv(SERIES)
    env.reset(seed=6)
    scenario = env.scenario
    env.reset(seed=7)
    env.reset(options={"scenario": scenario})
    assert env.town is load_town("generated:6,size=small")


def test_session_of_a_series_is_that_of_its_town() -> None:
    ends = []
    for town in (SERIES, "generated:8,size=small"):
        env = DuoWizardEnv(town, max_cycles=25)
        play_session(env, {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}, seed=8)
        ends.append(env.state())
    np.testing.assert_array_equal(ends[0], ends[1])


def test_state_is_restored_in_the_town_of_its_session() -> None:
    env = NavigationEnv(SERIES)
    env.reset(seed=9)
    state = env.clone_state()
    seen = [env.step(0)[0] for _ in range(3)]
    env.reset(seed=10)
    assert env.town.name == "generated:10,size=small"
    env.restore_state(state)
    assert env.town.name == "generated:9,size=small"
    np.testing.assert_array_equal([env.step(0)[0] for _ in range(3)], seen)


def test_batch_plays_the_first_towns_of_a_series() -> None:
    env = NavigationVectorEnv(3, town=SERIES)
    assert [town.name for town in env.towns] == [f"generated:{k},size=small" for k in range(3)]
    observations, _ = env.reset(seed=0)
    single = NavigationEnv("generated:1,size=small")
    np.testing.assert_array_equal(observations[1], single.reset(seed=1)[0])


def test_wrong_series_is_refused() -> None:
    with pytest.raises(TownError, match="size is 'tiny'"):
        DuoWizardEnv("generated,size=tiny")
