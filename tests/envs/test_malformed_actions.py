"""Malformed actions: one line with the name of the field and a short value, whatever they are.

`DOROTHIE_GYM_FUZZ_SEED` sets the seed; `pytest -m slow` tries 10,000 actions for each environment and role.
"""

from __future__ import annotations

import copy
import math
import os
import random
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import dorothie_gym
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk

SEED = int(os.environ.get("DOROTHIE_GYM_FUZZ_SEED", "17"))

LONGEST = 1500
"""Most characters of a message, with the names of all fields."""


class Hostile:
    """A value whose conversions fail in ways of their own."""

    def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
        raise MemoryError("no array")

    def __int__(self) -> int:
        raise KeyError("no number")

    def __repr__(self) -> str:
        raise RecursionError("no text")


class Subclass(np.ndarray):
    """An array of another class."""


def read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


ODD: tuple[Callable[[random.Random], Any], ...] = (
    lambda rng: float("inf"), lambda rng: float("-inf"), lambda rng: float("nan"), lambda rng: -0.0,
    lambda rng: 10 ** rng.choice((5, 30, 400, 5000)), lambda rng: -(10 ** rng.choice((1, 30, 5000))),
    lambda rng: None, lambda rng: "x" * rng.choice((0, 1, 100_000)), lambda rng: b"\0" * rng.choice((1, 100_000)),
    lambda rng: [], lambda rng: {}, lambda rng: {"a": {"b": [1, {"c": 2}]}}, lambda rng: [[1, 2], [3]],
    lambda rng: True,
    lambda rng: 1.5, lambda rng: 1j, lambda rng: object(), lambda rng: Hostile(), lambda rng: int,
    lambda rng: "\ud800\n",
    lambda rng: np.array(float("nan")), lambda rng: np.array(7 ** rng.choice((1, 10)) + 10**6),
    lambda rng: np.zeros(rng.choice(((0,), (3, 3), (1000,)))), lambda rng: np.full(3, np.inf),
    lambda rng: np.array([object(), None], dtype=object), lambda rng: np.array(["a", "b"]), lambda rng: np.ma.masked,
    lambda rng: np.ma.array(5, mask=True), lambda rng: np.ma.array([1, 2, 3], mask=[0, 1, 0]),
    lambda rng: np.zeros(2, dtype=[("a", "i4"), ("b", "f8")]), lambda rng: np.uint64(2**64 - 1),
    lambda rng: np.arange(3).view(Subclass) + 10**6, lambda rng: read_only(np.full(3, -1)),
    lambda rng: np.float16("inf"),
    lambda rng: np.datetime64("NaT"), lambda rng: np.void(b"abc"), lambda rng: [10**400] * 3, lambda rng: {1, 2},
    lambda rng: np.array(10**30, dtype=object), lambda rng: (Hostile(),), lambda rng: memoryview(b"abc"),
)  # fmt: skip


def broken(action: Any, rng: random.Random) -> Any:
    """Returns an action with one or more parts replaced, added or removed."""
    if not isinstance(action, Mapping) or rng.random() < 0.1:
        if isinstance(action, np.ndarray) and action.ndim and rng.random() < 0.3:
            values = np.array(action, dtype=object)
            values.reshape(-1)[rng.randrange(values.size)] = rng.choice((None, math.inf, 10**400, "x", Hostile()))
            return values if rng.random() < 0.5 else values.tolist()
        return rng.choice(ODD)(rng)
    changed = dict(action)
    for _ in range(rng.choice((1, 1, 2))):
        name = rng.choice(list(action))
        kind = rng.random()
        if kind < 0.1:
            changed.pop(name, None)
        elif kind < 0.2:
            changed[rng.choice(("x" * 50_000, "other", 7, None, ("a",), "a\nb"))] = 0
        else:
            changed[name] = rng.choice(ODD)(rng)
    return changed


def assert_refused_or_played(step: Callable[[Any], Any], action: Any) -> bool:
    """Plays an action that may happen to be well-formed; returns whether it was refused as it has to be."""
    try:
        step(action)
    except ValueError as error:
        message = str(error)
        assert "\n" not in message and len(message) <= LONGEST, message[:300]
        message.encode()
        return True
    except ResetNeeded:
        pass
    return False


TALK = [session(talk())]

MAKERS: dict[str, Callable[[], Any]] = {
    **{name: lambda name=name: gym.make(f"dorothie_gym/{name}", disable_env_checker=True) for name in (
        "Participant-v0", "CoWizard-v0", "AdWizard-v0", "Navigation-v0", "Navigation-continuous-v0", "Town-v0",
    )},
    **{name: lambda name=name: gym.make(f"dorothie_gym/{name}", disable_env_checker=True, corpus=TALK) for name in (
        "UfN-v0", "RfN-v0", "NfD-v0",
    )},
    "Town-v0 continuous": lambda: gym.make(
        "dorothie_gym/Town-v0",
        disable_env_checker=True,
        config={"action": {"type": "ContinuousAction"}},
        town="brookside",
    ),
    "CoWizard-v0 flattened": lambda: dorothie_gym.flatten(gym.make("dorothie_gym/CoWizard-v0", town="brookside")),
}  # fmt: skip


def try_environment(name: str, count: int) -> None:
    rng, env = random.Random(f"{SEED} {name}"), MAKERS[name]()
    env.reset(seed=1)
    env.action_space.seed(1)
    valid, refused = env.action_space.sample(), 0
    for _ in range(count):
        if assert_refused_or_played(env.step, broken(valid, rng)):
            refused += 1
        else:
            env.reset(seed=1)
    assert refused > count // 2


def try_role(role: str, count: int) -> None:
    rng, env = random.Random(f"{SEED} {role}"), DuoWizardEnv("brookside")
    env.reset(seed=1)
    for agent in env.agents:
        env.action_space(agent).seed(1)
    valid, refused = {agent: env.action_space(agent).sample() for agent in env.agents}, 0
    for _ in range(count):
        actions: Any = {**valid, role: broken(copy.copy(valid[role]), rng)}
        refused += assert_refused_or_played(env.step, broken(valid, rng) if rng.random() < 0.05 else actions)
        if not env.agents:
            env.reset(seed=1)
    assert refused > count // 2


@pytest.mark.parametrize("name", MAKERS)
def test_malformed_actions_are_value_errors(name: str) -> None:
    try_environment(name, 300)


@pytest.mark.parametrize("role", ["participant", "co_wizard", "ad_wizard"])
def test_malformed_actions_of_a_role_are_value_errors(role: str) -> None:
    try_role(role, 300)


@pytest.mark.slow
@pytest.mark.parametrize("name", MAKERS)
def test_ten_thousand_malformed_actions_are_value_errors(name: str) -> None:
    try_environment(name, 10_000)


@pytest.mark.slow
@pytest.mark.parametrize("role", ["participant", "co_wizard", "ad_wizard"])
def test_ten_thousand_malformed_actions_of_a_role_are_value_errors(role: str) -> None:
    try_role(role, 10_000)
