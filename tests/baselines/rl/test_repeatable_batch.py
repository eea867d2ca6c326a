"""Episodes in progress that another batch repeats."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dorothie_gym.baselines.rl.repeatable_batch import RepeatableVecEnv


def make(**settings: Any) -> RepeatableVecEnv:
    return RepeatableVecEnv(
        gym.make_vec("dorothie_gym/Navigation-v0", num_envs=3, autoreset_mode="SameStep", **settings)
    )


def play(env: RepeatableVecEnv, rng: np.random.Generator, steps: int) -> list[Any]:
    return [env.step(rng.integers(0, 18, 3)) for _ in range(steps)]


@pytest.mark.parametrize("steps", [0, 7, 50])
def test_another_batch_goes_on_from_recorded_episodes(steps: int) -> None:
    settings = {"max_seconds": 12.0, "patience": 11.0}  # 22 or 24 decisions: most episodes are not the first ones
    env = make(**settings)
    env.seed(3)
    env.reset()
    rng = np.random.default_rng(0)
    play(env, rng, steps)
    twin = make(**settings)
    repeated = twin.repeat_episodes(env.recorded_episodes())
    again = np.random.default_rng(1)
    for one, other in zip(play(env, np.random.default_rng(1), 60), play(twin, again, 60), strict=True):
        for found, expected in zip(one[:3], other[:3], strict=True):
            np.testing.assert_array_equal(found, expected)
    assert repeated.shape == (3, 161)


def test_foreign_episodes_are_refused() -> None:
    env = make()
    env.reset()
    episodes = env.recorded_episodes()
    with pytest.raises(ValueError, match="1 episodes were recorded"):
        env.repeat_episodes(episodes[:1])
    with pytest.raises(ValueError, match="none of the environment"):
        env.repeat_episodes([(start, np.array([18])) for start, _ in episodes])
