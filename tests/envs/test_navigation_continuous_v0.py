from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.envs.navigation_continuous_v0 import (
    CONTINUOUS_FIELD_SPECS,
    CONTINUOUS_FIELDS,
    NavigationContinuousEnv,
)
from dorothie_gym.envs.navigation_continuous_vector_env import NavigationContinuousVectorEnv
from dorothie_gym.policies.navigation import layout
from tests.envs.navigation_drivers import pursue

FIELD = layout(CONTINUOUS_FIELDS)


@pytest.fixture(scope="module")
def env() -> NavigationContinuousEnv:
    return NavigationContinuousEnv("brookside", traffic="none")


@pytest.mark.parametrize("seed", [1, 6])
def test_path_following_driver_succeeds(env: NavigationContinuousEnv, seed: int) -> None:
    observation, _ = env.reset(seed=seed)
    over = False
    while not over:
        observation, _, terminated, truncated, info = env.step(pursue(observation))
        over = terminated or truncated
    assert info["is_success"], info


def test_car_moves_only_by_throttle_and_brake(env: NavigationContinuousEnv) -> None:
    observation, _ = env.reset(seed=1)
    for _ in range(20):
        observation, _, _, _, _ = env.step(np.array((-1.0, 0.0, -1.0), dtype=np.float32))
    assert observation[FIELD["speed"]] == 0.0
    for _ in range(20):
        observation, _, _, _, _ = env.step(np.array((1.0, 0.0, -1.0), dtype=np.float32))
    assert float(env.session.world.car.speed) == pytest.approx(6.0, abs=0.2)  # 3 m/s^2 for 2 s
    assert observation[FIELD["controls"]][0] == 1.0
    for _ in range(15):
        observation, _, _, _, _ = env.step(np.array((0.0, 0.0, 1.0), dtype=np.float32))
    assert observation[FIELD["speed"]] == 0.0


def test_steering_to_the_right_leaves_the_path_to_the_right(env: NavigationContinuousEnv) -> None:
    observation, _ = env.reset(seed=4)
    for _ in range(12):
        observation, _, _, _, _ = env.step(np.array((1.0, 0.15, 0.0), dtype=np.float32))
    assert observation[FIELD["offset"]] > 0.05 and observation[FIELD["course"]][0] > 0.05
    assert observation[FIELD["path"]].reshape(-1, 2)[3, 1] < 0.0  # the path is to the left


def test_car_off_its_path_gets_new_path(env: NavigationContinuousEnv) -> None:
    env.reset(seed=2)
    planner = env.session.world.planner
    paths = {id(planner.path)}
    for k in range(300):
        wheel = 0.12 if k % 40 < 20 else -0.12
        observation, _, terminated, _, _ = env.step(np.array((0.3, wheel, -1.0), dtype=np.float32))
        assert env.observation_space.contains(observation)
        paths.add(id(planner.path))
        if terminated:
            break
        assert abs(planner.offset) < 16.0
    assert len(paths) > 1


def test_leaving_the_road_terminates_episode(env: NavigationContinuousEnv) -> None:
    env.reset(seed=2)
    for _ in range(400):
        _, _, terminated, _, info = env.step(np.array((0.5, 0.0, -1.0), dtype=np.float32))
        if terminated:
            break
    assert terminated and info["reason"] == "left the road" and not info["is_success"]
    assert info["reward_terms"]["gave_up"] < 0.0 and info["infractions"]["off_road"] > 0


def test_decision_frequency_is_respected() -> None:
    env = NavigationContinuousEnv("brookside", decision_frequency=5.0, traffic="none")
    env.reset(seed=0)
    for _ in range(5):
        env.step(np.zeros(3, dtype=np.float32))
    assert env.session.world.time == pytest.approx(1.0)
    with pytest.raises(ValueError, match="decision_frequency"):
        NavigationContinuousEnv("brookside", decision_frequency=7.0)


@pytest.mark.parametrize("action", [np.zeros(2), np.array((0.0, np.nan, 0.0)), 3])
def test_malformed_actions_raise_error(env: NavigationContinuousEnv, action: object) -> None:
    env.reset(seed=0)
    with pytest.raises(ValueError, match="throttle, steer, brake"):
        env.step(action)  # type: ignore[arg-type]  # a wrong type on purpose


def test_values_lie_in_the_ranges_of_their_fields() -> None:
    env = NavigationContinuousEnv("brookside", traffic="medium")
    env.action_space.seed(1)
    observation, _ = env.reset(seed=1)
    least, greatest = observation.copy(), observation.copy()
    for _ in range(200):
        observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
        least, greatest = np.minimum(least, observation), np.maximum(greatest, observation)
        if terminated or truncated:
            observation, _ = env.reset()
    for spec in CONTINUOUS_FIELD_SPECS:
        assert spec.low <= least[FIELD[spec.name]].min() and greatest[FIELD[spec.name]].max() <= spec.high, spec.name


def test_acceleration_is_throttle_or_brake() -> None:
    one, two = (
        NavigationContinuousEnv("brookside", control=control, max_seconds=20.0)
        for control in ("acceleration", "pedals")
    )
    batch = NavigationContinuousVectorEnv(1, "brookside", control="acceleration", max_seconds=20.0)
    assert one.action_space.shape == (2,) and two.action_space.shape == (3,)
    np.testing.assert_array_equal(one.reset(seed=3)[0], two.reset(seed=3)[0])
    batch.reset(seed=3)
    one.action_space.seed(0)
    for _ in range(100):
        pull, steer = one.action_space.sample()
        chosen = np.array([pull, steer], dtype=np.float32)
        observation, reward, *_ = one.step(chosen)
        pressed, same, *_ = two.step(np.array([max(pull, 0.0), steer, max(-pull, 0.0)], dtype=np.float32))
        np.testing.assert_array_equal(observation, pressed)
        assert reward == same
        np.testing.assert_array_equal(batch.step(chosen[None])[0][0], observation)
    with pytest.raises(ValueError, match="acceleration, steer"):
        one.step(np.zeros(3, dtype=np.float32))


def test_unknown_control_is_refused() -> None:
    with pytest.raises(ValueError, match="control is 'wheel'; it must be one of pedals, acceleration"):
        NavigationContinuousEnv("brookside", control="wheel")
