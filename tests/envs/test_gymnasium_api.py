from __future__ import annotations

from typing import Any

import gymnasium as gym
import pytest
from gymnasium.utils.env_checker import check_env

import dorothie_gym
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk

IDS = sorted(name for name in gym.registry if name.startswith("dorothie_gym/"))


def make(name: str, **arguments: Any) -> gym.Env[Any, Any]:
    """Makes an environment; those that need sessions get a short one."""
    if name.split("/")[1] in ("UfN-v0", "RfN-v0", "NfD-v0"):
        arguments["corpus"] = [session(talk()), session(talk(), name="two")]
    return gym.make(name, **arguments)


@pytest.fixture(autouse=True)
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


@pytest.mark.long
@pytest.mark.parametrize("name", IDS)
def test_gymnasium_accepts_it(name: str) -> None:
    check_env(make(name).unwrapped)  # its warnings are errors here


@pytest.mark.parametrize("name", IDS)
def test_stable_baselines_accepts_it_when_flat(name: str) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="needs the extra 'baselines'")
    checker.check_env(dorothie_gym.flatten(make(name)))


@pytest.mark.parametrize("name", IDS)
def test_passive_checker_accepts_episode(name: str) -> None:
    env = make(name)
    _, info = env.reset(seed=4)
    env.action_space.seed(4)
    for _ in range(12):
        mask = info.get("action_mask")
        _, _, terminated, truncated, info = env.step(env.action_space.sample(mask))
        if terminated or truncated:
            env.reset()
            break
    env.close()
