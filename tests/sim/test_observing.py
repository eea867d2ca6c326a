from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from highway_env.envs.common.observation import KinematicObservation, OccupancyGridObservation
from highway_env.vehicle.objects import Obstacle

from dorothie_gym.sim.town_env import TownEnv
from dorothie_gym.sim.town_observations import Kinematics, OccupancyGrid

FEATURES = [
    "presence", "x", "y", "vx", "vy", "heading", "cos_h", "sin_h", "cos_d", "sin_d", "long_off", "lat_off", "ang_off",
]  # fmt: skip


@pytest.fixture(scope="module")
def env() -> TownEnv:
    env = TownEnv({"vehicles": 12, "pedestrians": 12, "policy_frequency": 5}, town="brookside")
    env.reset(seed=6)
    env.road.objects.append(Obstacle(env.road, env.vehicle.position + 12.0))
    return env


@pytest.mark.parametrize(
    "config",
    [
        {},
        {"vehicles_count": 30, "see_behind": True},
        {"features": FEATURES, "observe_intentions": True, "vehicles_count": 12},
        {"features": FEATURES, "absolute": True, "normalize": False, "include_obstacles": False},
        {"features": ["y", "x"], "vehicles_count": 2},
        {"features_range": {"x": [-50, 50], "vx": [-9, 9]}, "clip": False, "vehicles_count": 9},
        {"order": "shuffled", "vehicles_count": 8},
    ],
)
def test_rows_are_highway_envs_to_the_last_bit(env: TownEnv, config: dict[str, Any]) -> None:
    ours, stock = Kinematics(env, **config), KinematicObservation(env, **config)
    for _ in range(6):
        state = env.np_random.bit_generator.state
        expected = stock.observe()
        env.np_random.bit_generator.state = state
        found = ours.observe()
        assert found.dtype == expected.dtype and found.shape == expected.shape == ours.space().shape
        np.testing.assert_array_equal(found, expected)
        assert np.abs(found[0]).max() > 0.0
        env.step(env.action_type.actions_indexes["FASTER"])


def test_one_row_is_the_observer_alone(env: TownEnv) -> None:
    alone = Kinematics(env, vehicles_count=1, normalize=False).observe()  # highway-env would list all of them here
    np.testing.assert_array_equal(alone, Kinematics(env, normalize=False).observe()[:1])


def test_observation_without_a_road_is_zero() -> None:
    env = TownEnv({"vehicles": 0}, town="brookside")
    env.road = None
    assert not env.observation_type.observe().any()


@pytest.mark.long
@pytest.mark.parametrize("town", ["brookside", "northgate"])
@pytest.mark.parametrize(
    "config",
    [
        {},
        {"align_to_vehicle_axes": True, "grid_size": [[-12, 30], [-15, 15]], "grid_step": [3, 2]},
        {"features": FEATURES, "clip": False, "grid_size": [[-60, 60], [-60, 60]]},
        {"features": ["presence", "nothing_like_it", "x"], "features_range": {"x": [-50, 50], "y": [-40, 40]}},
    ],
)
def test_grids_are_highway_envs(town: str, config: dict[str, Any]) -> None:
    env = TownEnv({"town": town, "vehicles": 30, "policy_frequency": 5})
    env.reset(seed=5)
    ours, stock = OccupancyGrid(env, **config), OccupancyGridObservation(env, **config)
    for _ in range(3):
        np.testing.assert_array_equal(ours.observe(), stock.observe())
        assert ours.observe().dtype == ours.space().dtype
        assert ours.observe().any()
        env.step(env.action_type.actions_indexes["FASTER"])
    assert env.observation_space.contains(env.observation_type.observe())


def test_images_of_grids_show_nothing_where_nothing_is() -> None:
    env = TownEnv({"vehicles": 10}, town="brookside")
    image = OccupancyGrid(env, as_image=True, features=["presence", "on_road"]).observe()
    assert image.dtype == np.uint8
    assert set(np.unique(image)) == {0, 255}
    with pytest.raises(NotImplementedError):
        OccupancyGrid(env, absolute=True).observe()
