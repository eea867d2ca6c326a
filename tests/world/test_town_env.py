from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.vehicle.behavior import IDMVehicle

from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.town_env import TownEnv


def drive(env: TownEnv, seed: int, steps: int) -> list[tuple[float, bool, bool]]:
    env.reset(seed=seed)
    faster, idle = (env.action_type.actions_indexes[name] for name in ("FASTER", "IDLE"))
    results = []
    for _ in range(steps):
        _, reward, terminated, truncated, _ = env.step(faster if env.vehicle.speed < 4.0 else idle)
        results.append((reward, terminated, truncated))
        if terminated or truncated:
            break
    return results


def test_it_is_highway_envs_environment_in_a_town() -> None:
    env = gym.make("dorothie_gym/Town-v0", config={"vehicles": 6}).unwrapped
    assert isinstance(env, AbstractEnv)
    assert isinstance(env.road.network, TownNetwork)
    assert len(env.road.vehicles) == 7
    assert all(isinstance(vehicle, IDMVehicle) for vehicle in env.road.vehicles[1:])


def test_progress_on_the_road_is_rewarded() -> None:
    env = TownEnv({"vehicles": 0})
    results = drive(env, seed=1, steps=15)
    assert env.vehicle.on_road
    assert results[-1][0] > 0.9 * env.vehicle.speed / env.config["reward_speed"] > 0.3


def test_time_runs_out() -> None:
    assert [row[2] for row in drive(TownEnv({"vehicles": 0, "duration": 3.0}), seed=1, steps=9)] == [False, False, True]


def test_a_crash_ends_it_and_costs() -> None:
    env = TownEnv({"vehicles": 0})
    env.reset(seed=1)
    env.vehicle.crashed = True
    _, reward, terminated, truncated, info = env.step(1)
    assert terminated and not truncated
    assert info["rewards"]["collision"] == -1.0
    assert reward == pytest.approx(sum(info["rewards"].values()))


@pytest.mark.parametrize("kind", ["Kinematics", "OccupancyGrid", "LidarObservation", "TimeToCollision"])
def test_observation_types_work(kind: str) -> None:
    env = TownEnv({"observation": {"type": kind}})
    observation, _ = env.reset(seed=3)
    for _ in range(3):
        assert env.observation_space.contains(observation)
        observation = env.step(env.action_space.sample())[0]
    assert isinstance(env.observation_space, spaces.Box)
    assert np.isfinite([env.observation_space.low, env.observation_space.high]).all()


def test_continuous_actions_work() -> None:
    env = TownEnv({"action": {"type": "ContinuousAction"}})
    env.reset(seed=3)
    env.step(np.array([1.0, 0.0], dtype=np.float32))
    assert env.vehicle.speed > 1.0


def test_it_is_drawn() -> None:
    env = TownEnv(render_mode="rgb_array")
    env.reset(seed=3)
    picture = env.render()
    assert picture is not None and picture.shape == (600, 600, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3
    env.close()


def test_the_same_seed_drives_the_same() -> None:
    assert drive(TownEnv(), 5, 12) == drive(TownEnv(), 5, 12)


def test_the_town_may_change_with_a_reset(tmp_path: Any) -> None:
    env = TownEnv({"vehicles": 2})
    before = env.road.network
    env.reset(seed=1)
    assert env.road.network is before
    with pytest.raises(Exception, match="nowhere"):
        env.reset(options={"config": {"town": "nowhere"}})
