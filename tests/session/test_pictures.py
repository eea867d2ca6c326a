"""Sessions with a camera: what the roles see of it, and that it changes nothing else."""

from __future__ import annotations

import warnings
from copy import deepcopy
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from dorothie_gym import DuoWizardEnv, EnvConfig
from dorothie_gym.ontology import Sensor
from dorothie_gym.session.config import CameraConfig, CameraOutput
from tests.session.random_play import played

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)  # of PettingZoo's own environments
    from pettingzoo.test import parallel_api_test

CAMERA = CameraConfig(width=96, height=64)
ALL = replace(CAMERA, outputs=tuple(CameraOutput))
CONFIG = EnvConfig(camera=CAMERA)


def test_participant_and_co_wizard_observe_rgb_and_the_ad_wizard_does_not() -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    observations = played(env)
    for agent in ("participant", "co_wizard"):
        assert env.observation_space(agent)["camera"].shape == (64, 96, 3)
        assert env.observation_space(agent).contains(observations[agent])
        assert observations[agent]["camera"].dtype == np.uint8
        assert observations[agent]["camera"].std() > 10.0
        assert "depth" not in observations[agent]
    assert "camera" not in observations["ad_wizard"]
    assert env.observation_space("ad_wizard").contains(observations["ad_wizard"])
    observations["participant"]["camera"][:] = 0  # the caller's own
    assert observations["co_wizard"]["camera"].any()


def test_privileged_outputs_are_observed_where_they_are_asked_for() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(camera=ALL))
    observation = played(env)["co_wizard"]
    space = env.observation_space("co_wizard")
    assert {"camera", "depth", "semantic", "instance"} <= set(space.spaces)
    assert space.contains(observation)
    picture = env.session.picture
    assert picture is not None and picture.boxes is not None
    np.testing.assert_array_equal(observation["depth"], picture.depth)
    np.testing.assert_array_equal(observation["instance"], picture.instance)


def test_the_environments_pass_the_checks_of_gymnasium_and_pettingzoo() -> None:
    parallel_api_test(DuoWizardEnv("brookside", config=CONFIG), num_cycles=6)
    env = gym.make("dorothie_gym/CoWizard-v0", config=CONFIG, town="brookside")
    check_env(env.unwrapped, skip_render_check=True)


def test_a_camera_changes_nothing_else() -> None:
    with_camera, without = DuoWizardEnv("brookside", config=CONFIG), DuoWizardEnv("brookside", config=EnvConfig())
    seen, expected = played(with_camera), played(without)
    assert without.session.picture is None
    for agent, observation in expected.items():
        assert set(seen[agent]) - set(observation) == ({"camera"} if agent != "ad_wizard" else set())
        for name, value in observation.items():
            np.testing.assert_array_equal(seen[agent][name], value)
    assert with_camera.session_header() == without.session_header()


def test_equal_seeds_give_equal_pictures_and_copies_draw_their_own() -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    observations = played(env)
    again = played(DuoWizardEnv("brookside", config=CONFIG))
    np.testing.assert_array_equal(again["co_wizard"]["camera"], observations["co_wizard"]["camera"])
    state, copy = env.clone_state(), deepcopy(env)
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    after = [each.step(deepcopy(actions))[0]["co_wizard"]["camera"] for each in (env, copy)]
    np.testing.assert_array_equal(after[0], after[1])
    env.restore_state(state)
    assert env.session.picture is not None
    np.testing.assert_array_equal(env.session.picture.rgb, observations["co_wizard"]["camera"])


def test_a_faulty_view_blackens_the_picture_of_the_co_wizard() -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    played(env)
    world = env.session.world
    world.faults[Sensor.VIEW] = world.frame + 300
    agents = {agent: env.action_space(agent).sample() for agent in env.agents}
    dark = env.step(agents)[0]["co_wizard"]["camera"]
    assert not dark.any()


def test_a_camera_that_is_none_is_refused_with_its_type() -> None:
    with pytest.raises(ValueError, match=r"EnvConfig\.camera is a dict; it must be a CameraConfig or None"):
        EnvConfig(camera={"width": 84})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"width": 3}, r"CameraConfig\.width is 3; it must be a whole number in 8\.\.4096 pixels"),
        ({"field_of_view": "wide"}, r"CameraConfig\.field_of_view is 'wide'; it must be in 10\.\.150 degrees"),
        ({"mount": (1, 2)}, r"CameraConfig\.mount is a tuple; it must be a CameraMount"),
        ({"antialiasing": 3}, r"CameraConfig\.antialiasing is 3; it must be True or False"),
        ({"outputs": "rgb"}, r"CameraConfig\.outputs is a str; it must be a tuple"),
        ({"outputs": ("smell",)}, r"CameraConfig\.outputs contains 'smell'; it must be of rgb, depth"),
    ],
)
def test_settings_that_no_camera_has_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CameraConfig(**settings)
