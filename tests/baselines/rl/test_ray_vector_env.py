"""Training on a Ray cluster; `pytest -m integrations` with dorothie-gym[ray] installed."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl import Training, tuned_settings
from dorothie_gym.baselines.rl.vector_env import ProcessVecEnv, RayVecEnv
from dorothie_gym.errors import ProcessError

pytestmark = [pytest.mark.integrations, pytest.mark.timeout(900), pytest.mark.filterwarnings("ignore")]

POLE = partial(gym.make, "CartPole-v1")


def test_cluster_that_loses_a_machine_learns_the_weights_of_a_local_run(cluster: Any, tmp_path: Path) -> None:
    def lose_one(done: int, total: int, row: Any) -> None:
        if done >= 512 and cluster.second is not None:
            cluster.remove_node(cluster.second, allow_graceful=False)
            cluster.second = None

    settings = tuned_settings(
        "maskable_ppo", "dorothie_gym/Navigation-v0", steps=1024, environments=4, evaluate_every=1024, episodes=2
    )
    far = Training(settings, tmp_path / "far", lose_one, cluster.address).run()
    near = Training(settings, tmp_path / "near").run()
    assert cluster.second is None and far.steps == near.steps
    weights = [(tmp_path / name / "model.safetensors").read_bytes() for name in ("far", "near")]
    assert weights[0] == weights[1]


def test_environments_of_a_lost_process_are_restored(cluster: Any) -> None:
    far, near = RayVecEnv(POLE, 3, 2, cluster.address), ProcessVecEnv(POLE, 3, 2)
    actions = np.random.default_rng(0).integers(2, size=(60, 3))
    for vector in (far, near):
        vector.seed(7)
        vector.reset()
        vector.env_method("reset", seed=3, indices=1)
    for step, action in enumerate(actions):
        if step in (20, 40):
            far._ray.kill(far._actors[step // 40])
        results = [vector.step(action) for vector in (far, near)]
        for one, other in zip(results[0][:3], results[1][:3], strict=True):
            assert np.array_equal(one, other)
    assert far.get_attr("_elapsed_steps") == near.get_attr("_elapsed_steps")
    far.close()
    near.close()


def test_environment_that_cannot_be_made_on_the_cluster_is_reported(cluster: Any) -> None:
    with pytest.raises(RuntimeError, match="NoSuch"):
        RayVecEnv(partial(gym.make, "NoSuch-v0"), 1, 1, cluster.address)


def test_address_without_a_cluster_is_reported(tmp_path: Path) -> None:
    pytest.importorskip("ray")
    settings = tuned_settings("ppo", "dorothie_gym/Navigation-v0")
    with pytest.raises(ProcessError, match="there is no Ray cluster"):
        Training(settings, tmp_path, ray="127.0.0.1:1")
