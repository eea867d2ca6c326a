"""Reinforcement learning on wrapped environments."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import pytest

import dorothie_gym
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk

QUIET = {"participant": "silent", "ad_wizard": "silent"}


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Limits torch to one thread, because tests share the cores."""
    torch = pytest.importorskip("torch", reason="needs the extra 'baselines'")
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def driving() -> Any:
    env = gym.make("dorothie_gym/CoWizard-v0", partners=QUIET, max_cycles=20, town="brookside")
    return dorothie_gym.flatten(env, fields=("physical", "angle"))


@pytest.mark.parametrize(("package", "name"), [("stable_baselines3", "PPO"), ("sb3_contrib", "MaskablePPO")])
def test_learner_improves(package: str, name: str) -> None:
    learner = getattr(pytest.importorskip(package, reason="needs the extra 'baselines'"), name)
    model = learner("MultiInputPolicy", driving(), n_steps=32, batch_size=32, n_epochs=1, device="cpu", seed=0)
    model.learn(64)
    assert model.num_timesteps == 64
    assert model.predict(model.env.reset())[0].shape == (1, 2)


def test_masked_learner_takes_feasible_actions_only() -> None:
    contrib = pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    env = dorothie_gym.flatten(
        gym.make("dorothie_gym/CoWizard-v0", partners=QUIET, max_cycles=20, town="brookside"), fields=("physical",)
    )
    model = contrib.MaskablePPO("MultiInputPolicy", env, n_steps=8, batch_size=8, device="cpu", seed=0)
    observation, _ = env.reset(seed=1)
    for _ in range(15):
        action, _ = model.predict(observation, action_masks=env.get_wrapper_attr("action_masks")())
        assert env.get_wrapper_attr("action_masks")()[int(action[0])]
        observation, *_ = env.step(action)


def points_of(task: str, fields: tuple[str, ...] | None = None) -> Any:
    return dorothie_gym.flatten(gym.make(f"dorothie_gym/{task}-v0", corpus=[session(talk())]), fields)


def test_learner_improves_on_recorded_points() -> None:
    """The reward rises in training on one session."""
    learner = pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'").PPO
    env = points_of("NfD", ("action",))
    settings = {"n_steps": 64, "batch_size": 64, "n_epochs": 8, "gamma": 0.0, "learning_rate": 3e-3}
    model = learner("MultiInputPolicy", env, device="cpu", seed=0, **settings)
    before = mean_reward(model, env)
    model.learn(512)
    assert mean_reward(model, env) > before


def test_learner_accepts_moves_and_slots() -> None:
    learner = pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'").PPO
    model = learner("MultiInputPolicy", points_of("UfN"), n_steps=8, batch_size=8, n_epochs=1, device="cpu", seed=0)
    model.learn(16)
    assert model.num_timesteps == 16
    assert model.predict(model.env.reset())[0].shape == (1, 70)


def mean_reward(model: Any, env: Any) -> float:
    """Returns the mean reward of an episode."""
    observation, _ = env.reset(seed=0)
    rewards, done = [], False
    while not done:
        observation, reward, done, _, _ = env.step(model.predict(observation, deterministic=True)[0])
        rewards.append(reward)
    return sum(rewards) / len(rewards)


@pytest.mark.parametrize("task", ["UfN", "RfN", "NfD"])
def test_tasks_pass_stable_baselines_checks(task: str) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="needs the extra 'baselines'")
    checker.check_env(points_of(task))
