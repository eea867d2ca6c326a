from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from dorothie_gym import IdenticalSpaces
from dorothie_gym.envs import duo_wizard_v0
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.sim.config import WorldConfig

with warnings.catch_warnings():
    # PettingZoo's tests import one of its own environments in a deprecated way.
    warnings.filterwarnings("ignore", "The old environment creation API", DeprecationWarning)
    from pettingzoo.test import (
        api_test,
        max_cycles_test,
        parallel_api_test,
        parallel_seed_test,
        render_test,
        seed_test,
        state_test,
    )

CYCLES = 60

ADVICE = (
    "Observation is not a NumPy array",
    "Observation space for each agent probably should be gymnasium.spaces.box or gymnasium.spaces.discrete",
    "Action space for each agent probably should be gymnasium.spaces.box or gymnasium.spaces.discrete",
    "We recommend agents to be named in the format <descriptor>_<number>, like .player_0.",
    "Agents have different observation space sizes",
)
"""Warnings about conventions that the design does not follow: plain spaces, numbered names, equal spaces."""

pytestmark = [pytest.mark.filterwarnings(f"ignore:{text}$:UserWarning:pettingzoo.test.api_test") for text in ADVICE]


@pytest.fixture(autouse=True)
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def parallel(**arguments: Any) -> Any:
    return duo_wizard_v0.parallel_env(**{"max_cycles": CYCLES, **arguments})


def turns(**arguments: Any) -> Any:
    return duo_wizard_v0.env(**{"max_cycles": CYCLES, **arguments})


def test_parallel_api() -> None:
    parallel_api_test(parallel(), num_cycles=CYCLES)


@pytest.mark.parametrize(
    "arguments",
    [
        {"config": EnvConfig(observe_acts=False)},
        {"config": EnvConfig(decision_frequency=30.0, world=WorldConfig(vehicles=0, pedestrians=0))},
        {"storyboard": "fetch_priya"},
    ],
    ids=["words only", "empty streets, 30 Hz", "one storyboard"],
)
def test_parallel_api_with_arguments(arguments: dict[str, Any]) -> None:
    parallel_api_test(parallel(**arguments), num_cycles=20)


def test_aec_api() -> None:
    api_test(turns(), num_cycles=CYCLES)


@pytest.mark.parametrize("wrapped", [lambda env: env, IdenticalSpaces], ids=["plain", "identical spaces"])
def test_state_lies_in_its_space(wrapped: Callable[[Any], Any]) -> None:
    state_test(turns(), wrapped(parallel()), num_cycles=CYCLES)
    env = wrapped(parallel())
    assert env.state_space is env.state_space and env.state_space.shape == (13,)
    env.reset(seed=1)
    state = env.state()
    assert state.dtype == env.state_space.dtype and state in env.state_space and state[0] == 0.0
    assert np.isfinite(env.state_space.sample()).all()


def test_equal_seeds_give_equal_aec_sessions() -> None:
    seed_test(turns, num_cycles=CYCLES)


def test_equal_seeds_give_equal_parallel_sessions() -> None:
    parallel_seed_test(parallel, num_cycles=CYCLES)


def test_max_cycles() -> None:
    max_cycles_test(duo_wizard_v0)


def test_rendering() -> None:
    render_test(turns)
