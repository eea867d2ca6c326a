"""Batches of self-play against single environments that stable-baselines3's `DummyVecEnv` steps."""

from __future__ import annotations

import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv

from dorothie_gym.baselines.selfplay.vec_env import SelfPlayEnvFactory
from dorothie_gym.ontology import AGENT_ROLES, Role


def test_batch_of_sessions_is_equal_to_single_ones() -> None:
    make = SelfPlayEnvFactory({"traffic": "medium", "max_seconds": 15.0}, (Role.AD_WIZARD,))
    batch, singles = make.batch(3), DummyVecEnv([make] * 3)
    batch.set_attr("scripted", AGENT_ROLES, indices=[1])
    singles.envs[1].sessions.players[0].scripted = AGENT_ROLES  # type: ignore[attr-defined]  # a SelfPlayEnv
    layout, rng, ended = batch.sessions.layout, np.random.default_rng(2), 0
    for vector in (batch, singles):
        vector.seed(40)
    rows = batch.reset()
    np.testing.assert_array_equal(rows, singles.reset())
    for _ in range(65):
        masks = [layout.masks(np.asarray(rows), role, padded=False) for role in range(3)]
        actions = np.array([[rng.choice(np.flatnonzero(own[env])) for own in masks] for env in range(3)])
        rows, rewards, dones, infos = batch.step(actions)
        expected = singles.step(actions)
        np.testing.assert_array_equal(rows, expected[0])
        np.testing.assert_array_equal(rewards, expected[1])
        np.testing.assert_array_equal(dones, expected[2])
        for info, other in zip(infos, expected[3], strict=True):
            assert info.keys() == other.keys()
            np.testing.assert_equal(info, other)
        ended += int(dones.sum())
    assert ended == 6
    for vector in (batch, singles):
        vector.close()
