"""Vector environments as stable-baselines3 sees them."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.wrappers import sb3_vec_env

NAVIGATION = "dorothie_gym/Navigation-v0"


def make(num_envs: int = 3, **settings: Any) -> VecEnv:
    return sb3_vec_env(gym.make_vec(NAVIGATION, num_envs=num_envs, autoreset_mode="SameStep", **settings))


def test_other_autoreset_modes_are_refused() -> None:
    with pytest.raises(ValueError, match='autoreset_mode="SameStep"'):
        sb3_vec_env(gym.make_vec(NAVIGATION, num_envs=1, town="brookside"))


def test_episodes_are_those_of_single_environments() -> None:
    env = make(max_seconds=15.0, town="brookside")
    seeds = env.seed(3)
    observations: Any = env.reset()
    singles = [NavigationEnv("brookside", max_seconds=15.0) for _ in range(3)]
    for number, (single, seed) in enumerate(zip(singles, seeds, strict=True)):
        np.testing.assert_array_equal(single.reset(seed=seed)[0], observations[number])
    rng = np.random.default_rng(0)
    for step in range(1, 31):
        actions = rng.integers(0, 18, 3)
        observations, rewards, dones, infos = env.step(actions)
        assert rewards.dtype == np.float32
        assert dones.all() if step == 30 else not dones.any()
        for number, single in enumerate(singles):
            expected, reward, _, _, info = single.step(actions[number])
            assert rewards[number] == np.float32(reward)
            if step < 30:
                np.testing.assert_array_equal(observations[number], expected)
                assert infos[number] == {}
            else:
                np.testing.assert_array_equal(infos[number]["terminal_observation"], expected)
                assert infos[number]["TimeLimit.truncated"] is True
                assert infos[number]["reason"] == info["reason"] == "out of time"
                assert infos[number]["is_success"] is False
                np.testing.assert_array_equal(observations[number], single.reset()[0])


def test_runs_with_neighbouring_seeds_share_no_episode() -> None:
    env = make(8)
    assert not set(env.seed(0)) & set(env.seed(1))
    assert env.seed(1) == env.seed(1)


def test_masks_reach_maskable_ppo() -> None:
    env = VecMonitor(make(max_seconds=20.0))
    assert is_masking_supported(env)
    env.reset()
    masks = get_action_masks(env)
    assert masks.shape == (3, 18) and masks.dtype == np.bool_ and masks[:, 0].all()
    MaskablePPO("MlpPolicy", env, n_steps=32, batch_size=48, n_epochs=1, device="cpu").learn(96)


def test_ppo_learns_and_counts_episodes() -> None:
    env = VecMonitor(make(max_seconds=10.0))
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=48, n_epochs=1, device="cpu")
    model.learn(192)
    assert len(model.ep_info_buffer or ()) == 9  # three environments, 64 decisions each, 20 in an episode
    env.close()


def test_attributes_are_those_of_the_batch() -> None:
    env = make(2)
    assert env.get_attr("num_envs") == [2, 2] and env.get_attr("num_envs", 0) == [2]
    assert env.env_is_wrapped(gym.Wrapper) == [False, False]
    assert not env.has_attr("no_such_attribute")
    with pytest.raises(ValueError, match="all 2 environments"):
        env.set_attr("num_envs", 3, indices=[0])
    env.close()
