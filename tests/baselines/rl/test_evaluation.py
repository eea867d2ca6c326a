from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl import evaluate_policy
from dorothie_gym.baselines.rl.evaluation import evaluate_settings, play_batch
from dorothie_gym.baselines.rl.settings import NAVIGATION, TrainingSettings
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.envs.navigation_vector_env import NavigationVectorEnv
from dorothie_gym.evaluation.analysis.intervals import wilson_interval
from tests.envs.navigation_drivers import follow_lane, obey


def test_wilson_interval_equals_that_of_the_textbook() -> None:
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.278), abs=1e-3)
    assert wilson_interval(8, 10) == pytest.approx((0.490, 0.943), abs=1e-3)
    assert wilson_interval(10, 10)[1] == 1.0


def test_results_do_not_depend_on_the_number_of_parallel_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    def act(observations: Any, masks: Any) -> list[int]:
        return [obey(observation, mask) for observation, mask in zip(observations, masks, strict=True)]

    in_parallel = evaluate_policy(lambda: NavigationEnv("brookside", traffic="none", max_seconds=60.0), act, 5, seed=3)
    monkeypatch.setattr("dorothie_gym.baselines.rl.evaluation.PARALLEL_EPISODES", 1)
    one_by_one = evaluate_policy(lambda: NavigationEnv("brookside", traffic="none", max_seconds=60.0), act, 5, seed=3)
    assert in_parallel == one_by_one and in_parallel.episodes == 5


def test_a_batch_plays_the_episodes_of_single_environments(monkeypatch: pytest.MonkeyPatch) -> None:
    def act(observations: Any, masks: Any) -> list[int]:
        return [obey(observation, mask) for observation, mask in zip(observations, masks, strict=True)]

    settings: dict[str, Any] = {"traffic": "none", "max_seconds": 120.0}
    singles = evaluate_policy(lambda: NavigationEnv(**settings), act, 5, seed=3)
    for together in (128, 2):
        monkeypatch.setattr("dorothie_gym.baselines.rl.evaluation.BATCHED_EPISODES", together)
        batched = play_batch(
            lambda count: NavigationVectorEnv(count, autoreset_mode="Disabled", **settings), act, 5, seed=3
        )
        assert batched.statistics == singles


def test_episodes_of_several_towns_are_those_of_each() -> None:
    def act(observations: Any, masks: Any) -> list[int]:
        return [obey(observation, mask) for observation, mask in zip(observations, masks, strict=True)]

    towns, settings = ["brookside", "northgate"], {"traffic": "none", "max_seconds": 60.0}
    several = TrainingSettings(algorithm="ppo", env=NAVIGATION, env_settings={"town": towns, **settings})
    parts = [evaluate_policy(lambda t=town: NavigationEnv(t, **settings), act, 3, seed=3) for town in towns]
    pooled = evaluate_settings(several, act, 3, seed=3)
    assert pooled.episodes == 6 and parts[0].reward != parts[1].reward
    assert pooled.reward == pytest.approx(sum(part.reward for part in parts) / 2)


def test_following_the_lane_has_no_success() -> None:
    outcome = evaluate_policy(
        lambda: NavigationEnv("brookside", patience=10.0), lambda o, m: [follow_lane(o, m)] * len(o), 3
    )
    assert outcome.success == 0.0 and outcome.low == 0.0 and outcome.high > 0.5
