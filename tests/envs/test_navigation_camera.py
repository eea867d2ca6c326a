"""Navigation environments whose observations are pictures."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from dorothie_gym import CameraConfig
from dorothie_gym.envs.navigation.config import SMALL_CAMERA
from dorothie_gym.envs.navigation_continuous_v0 import NavigationContinuousEnv
from dorothie_gym.envs.navigation_v0 import NavigationEnv
from dorothie_gym.envs.navigation_vector_env import NavigationVectorEnv
from dorothie_gym.policies.navigation import NavigationAction
from dorothie_gym.session.config import CameraOutput
from tests.envs.dashboard_reader import instruction_on, obey_picture, planned_on, speed_on
from tests.envs.navigation_drivers import drive
from tests.envs.test_navigation_vector_env import CONTINUOUS, NAVIGATION, check_equal, pedals, play_both

TINY = CameraConfig(width=24, height=16, antialiasing=False)
SHORT: dict[str, Any] = {"max_seconds": 30.0, "patience": 15.0, "observation": "camera"}


def test_observation_is_a_picture_of_the_cars_camera() -> None:
    env = NavigationEnv("brookside", observation="camera")
    picture, info = env.reset(seed=0)
    assert env.observation_space == gym.spaces.Box(0, 255, (84, 84, 3), np.uint8)
    assert env.observation_space.contains(picture)
    sky, road = picture[:20].reshape(-1, 3).mean(axis=0), picture[60:72, 30:54].reshape(-1, 3).mean(axis=0)
    assert sky[2] > sky[0] + 20.0  # blue at noon
    assert np.ptp(road) < 30.0  # grey
    assert info["action_mask"].shape == (18,)
    assert len(np.unique(picture[:72].reshape(-1, 3), axis=0)) > 300


@pytest.mark.parametrize("seed", [0, 3])
def test_a_driver_who_sees_nothing_but_the_dashboard_arrives(seed: int) -> None:
    env = NavigationEnv("brookside", observation="camera", traffic="none")
    assert drive(env, obey_picture, seed)["is_success"]


def test_dashboard_follows_the_car() -> None:
    env = NavigationEnv("brookside", observation="camera", traffic="none")
    picture, info = env.reset(seed=0)
    speeds, planned = [], []
    for _ in range(60):
        vector = env.batch.vectors[0]
        speeds.append((speed_on(picture[-12:]), float(vector[0]) * 25.0))
        action = obey_picture(picture, info["action_mask"])
        asked = instruction_on(picture[-12:])
        picture, _, _, _, info = env.step(action)
        if action >= NavigationAction.TURN_BACK and not any(info["refused"].values()):
            planned.append((planned_on(picture[-12:]), asked))
    assert max(known for _, known in speeds) > 5.0
    np.testing.assert_allclose(*np.array(speeds).T, atol=0.1)
    assert planned
    assert all(shown == asked for shown, asked in planned)


def test_other_observations_rewards_and_ends_are_those_of_vectors() -> None:
    one, other = (
        NavigationEnv("brookside", exceptions=3.0),
        NavigationEnv("brookside", exceptions=3.0, observation="camera", camera=TINY),
    )
    one.reset(seed=4)
    other.reset(seed=4)
    rng = np.random.default_rng(0)
    for _ in range(80):
        action = int(rng.choice(np.flatnonzero(one.action_masks())))
        vector, *outcome = one.step(action)
        _, *same = other.step(action)
        assert outcome[:3] == same[:3]
        check_equal(outcome[3], same[3])
        np.testing.assert_array_equal(vector, other.batch.vectors[0])
        if outcome[1] or outcome[2]:
            break


@pytest.mark.long
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_batch_is_equal_to_single_environments(mode: AutoresetMode) -> None:
    assert play_both(NAVIGATION, mode, lambda rng: rng.integers(0, 18, 3), 90, threads=2, camera=TINY, **SHORT) >= 3


@pytest.mark.long
def test_batch_with_pedals_is_equal_to_single_environments() -> None:
    assert play_both(CONTINUOUS, AutoresetMode.SAME_STEP, pedals, 320, threads=2, camera=TINY, **SHORT) >= 3


@pytest.mark.long
@pytest.mark.parametrize("settings", [{"guidance": "goals", "exceptions": 4.0}, {"town": "midtown"}])
def test_settings_are_those_of_the_single_environment(settings: dict[str, Any]) -> None:
    """Weather and faulty sensors of the Ad-Wizard, and another town."""
    play_both(NAVIGATION, AutoresetMode.NEXT_STEP, lambda rng: rng.integers(0, 18, 3), 40, 3, 2, **SHORT, **settings)


def test_number_of_threads_changes_no_byte() -> None:
    one, two = (
        NavigationVectorEnv(5, ["brookside", "midtown"], observation="camera", threads=threads) for threads in (1, 2)
    )
    check_equal(one.reset(seed=2), two.reset(seed=2))
    rng = np.random.default_rng(5)
    for _ in range(12):
        actions = rng.integers(0, 18, 5)
        check_equal(one.step(actions), two.step(actions))
    assert (one.threads, two.threads) == (1, 2)
    assert one.observation_space == gym.spaces.Box(0, 255, (5, 84, 84, 3), np.uint8)


@pytest.mark.parametrize("kind", [NavigationEnv, NavigationContinuousEnv])
def test_copies_and_states_continue_with_equal_pictures(kind: Any) -> None:
    env = kind(observation="camera", camera=TINY, exceptions=3.0)
    env.reset(seed=1)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(40)]
    for action in actions[:20]:
        env.step(action)
    state, twin = env.clone_state(), copy.deepcopy(env)
    rest = [env.step(action) for action in actions[20:]]
    check_equal([twin.step(action) for action in actions[20:]], rest)
    env.restore_state(state)
    check_equal([env.step(action) for action in actions[20:]], rest)
    assert (rest[0][0] != rest[-1][0]).any()


@pytest.mark.parametrize("name", [NAVIGATION, CONTINUOUS])
def test_gymnasium_accepts_the_environments(name: str) -> None:
    check_env(gym.make(name, observation="camera").unwrapped, skip_render_check=True)


def test_pictures_have_the_size_of_the_camera() -> None:
    env = NavigationContinuousEnv("brookside", observation="camera", camera=CameraConfig(width=160, height=120))
    picture, _ = env.reset(seed=0)
    assert picture.shape == (120, 160, 3)
    assert env.observation_space.contains(picture)


def test_frames_are_stacked_by_gymnasiums_wrapper() -> None:
    env = gym.wrappers.FrameStackObservation(
        gym.make(NAVIGATION, observation="camera", camera=TINY, town="brookside"), 4
    )
    stacked, _ = env.reset(seed=0)
    assert stacked.shape == (4, 16, 24, 3)
    newer, *_ = env.step(0)
    np.testing.assert_array_equal(newer[:3], stacked[1:])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"observation": "pixels"}, "observation is 'pixels'; it must be one of vector, camera"),
        ({"camera": TINY}, 'camera is set, but observation is "vector"'),
        ({"observation": "camera", "camera": 84}, "camera is a int; it must be CameraConfig"),
        (
            {"observation": "camera", "camera": CameraConfig(outputs=(CameraOutput.RGB, CameraOutput.DEPTH))},
            "drivers observe",
        ),
    ],
)
def test_wrong_settings_are_refused(settings: dict[str, Any], message: str) -> None:
    for kind in (NavigationEnv, NavigationContinuousEnv, NavigationVectorEnv):
        with pytest.raises(ValueError, match=message.replace("(", r"\(")):
            kind(**settings)


def test_camera_is_small_unless_another_is_given() -> None:
    assert NavigationEnv("brookside", observation="camera").config.camera == SMALL_CAMERA
    assert NavigationEnv("brookside").config.camera is None
