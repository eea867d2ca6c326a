"""Settings of highway-env that the vector environment supports."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dorothie_gym.sim.batch.town_vector_env import Actions, Kinematics, TownVectorEnv


@pytest.mark.parametrize(
    "config",
    [
        {"observation": {"type": "LidarObservation"}},
        {"observation": {"type": "Kinematics", "features": ["x", "cos_d"]}},
        {"action": {"type": "DiscreteAction"}},
        {"action": {"type": "ContinuousAction", "dynamical": True}},
        {"action": {"type": "ContinuousAction", "speed_range": [0, 50]}},
    ],
)
def test_what_only_plain_environments_can_do_is_referred_to_them(config: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match='vectorization_mode="sync"'):
        gym.make_vec("dorothie_gym/Town-v0", num_envs=2, config=config)


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"observation": {"type": "Kinematics", "vehicles_count": 0}}, "vehicles_count"),
        ({"observation": {"type": "Kinematics", "order": "upwards"}}, "order"),
        ({"action": {"type": "DiscreteMetaAction", "target_speeds": [5.0]}}, "target_speeds"),
    ],
)
def test_impossible_settings_are_named(config: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        TownVectorEnv(2, config)


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({}, ["LANE_LEFT", "IDLE", "LANE_RIGHT", "FASTER", "SLOWER"]),
        ({"lateral": False}, ["SLOWER", "IDLE", "FASTER"]),
        ({"longitudinal": False}, ["LANE_LEFT", "IDLE", "LANE_RIGHT"]),
    ],
)
def test_meta_actions_are_numbered_as_by_highway_env(config: dict[str, Any], words: list[str]) -> None:
    actions = Actions({"type": "DiscreteMetaAction", "target_speeds": [0.0, 5.0], **config})
    every = gym.spaces.MultiDiscrete([len(words)] * len(words))
    order = ["LANE_LEFT", "IDLE", "LANE_RIGHT", "FASTER", "SLOWER"]
    codes = actions.read(np.arange(len(words)), every, np.zeros(len(words)))
    assert [order[code] for code in codes] == words


def test_values_are_scaled_by_the_lanes_of_the_road_or_as_wished() -> None:
    usual = Kinematics({"type": "Kinematics", "features": ["y", "cos_h"]}).ranges(3)
    assert usual[0].tolist() == [-12.0, 12.0] and np.isnan(usual[1]).all()
    wished = Kinematics({"type": "Kinematics", "features": ["x", "y"], "features_range": {"x": [0, 7]}}).ranges(3)
    assert wished[0].tolist() == [0.0, 7.0] and np.isnan(wished[1]).all()
    assert np.isnan(Kinematics({"type": "Kinematics", "normalize": False}).ranges(3)).all()
