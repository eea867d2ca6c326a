"""Arguments, reset options and specifications of the environments, through `gymnasium.make`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from gymnasium.envs.registration import EnvSpec

import dorothie_gym
from dorothie_gym import CameraConfig, CameraOutput, EnvConfig, NavigationWeights, SpaceLimits, WorldConfig
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("CoWizard-v0", {"config": {"a": 1}}, "config, field 'a': is unknown in this version"),
        ("Participant-v0", {"config": "fast"}, r"config is a str; it must be EnvConfig\(...\), or a mapping"),
        ("AdWizard-v0", {"storyboard": 3}, "storyboard is a int; it must be a name, a path or a StoryboardTemplate"),
        ("Navigation-v0", {"storyboard": ["x"]}, "storyboard is a list"),
        ("CoWizard-v0", {"town": "Brooksid"}, "did you mean 'brookside'"),
        ("Town-v0", {"config": 7}, "config is a int; it must be a dictionary"),
        ("Town-v0", {"town": "midtown", "config": {"town": "brookside"}}, "town is 'midtown', but config has the town"),
    ],
)
def test_wrong_argument_is_named(name: str, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gym.make(f"dorothie_gym/{name}", **arguments)


def test_duo_wizard_names_a_wrong_config() -> None:
    with pytest.raises(ValueError, match="config, field 'a': is unknown"):
        dorothie_gym.DuoWizardEnv("brookside", config={"a": 1})  # type: ignore[arg-type]  # a user's mistake


def test_town_is_an_argument_of_the_plain_environment() -> None:
    by_argument = gym.make("dorothie_gym/Town-v0", town="midtown")
    by_setting = gym.make("dorothie_gym/Town-v0", config={"town": "midtown"})
    (first, _), (second, _) = by_argument.reset(seed=3), by_setting.reset(seed=3)
    assert (first == second).all()
    assert by_argument.unwrapped.config["town"] == "midtown"  # type: ignore[attr-defined]  # of highway-env


@pytest.mark.parametrize("name", ["CoWizard-v0", "Navigation-v0", "Navigation-continuous-v0", "Town-v0"])
def test_unknown_reset_option_causes_a_warning(name: str) -> None:
    env = gym.make(f"dorothie_gym/{name}")
    with pytest.warns(UserWarning, match="reset option 'scenaro' is unknown and ignored"):
        env.reset(seed=0, options={"scenaro": 1})
    env.reset(seed=0, options={})


@pytest.mark.parametrize(
    ("name", "arguments", "steps"),
    [
        ("CoWizard-v0", {}, 1800),
        ("CoWizard-v0", {"max_cycles": 7}, 7),
        ("CoWizard-v0", {"config": EnvConfig(max_seconds=3000.0)}, 6000),
        ("Navigation-v0", {}, 1200),
        ("Navigation-v0", {"max_seconds": 900.0}, 1800),
        ("Navigation-continuous-v0", {}, 6000),
        ("Town-v0", {}, 60),
        ("Town-v0", {"config": {"policy_frequency": 5, "duration": 3.1}}, 16),
        ("UfN-v0", {"corpus": "x"}, None),
    ],
)
def test_specification_has_the_limit_of_the_episodes(name: str, arguments: dict[str, Any], steps: int | None) -> None:
    if "corpus" in arguments:
        assert gym.spec(f"dorothie_gym/{name}").max_episode_steps is None
        return
    env = gym.make(f"dorothie_gym/{name}", **arguments)
    assert env.spec is not None and env.spec.max_episode_steps == steps
    assert "TimeLimit" not in str(env), "the environment truncates its episodes itself"
    again = gym.make(env.spec)
    assert again.spec is not None and again.spec.max_episode_steps == steps


def test_episode_ends_at_the_limit_of_the_specification() -> None:
    env = gym.make(
        "dorothie_gym/CoWizard-v0",
        max_cycles=5,
        partners={"participant": "silent", "ad_wizard": "silent"},
        town="brookside",
    )
    env.reset(seed=0)
    ends = [env.step(env.unwrapped.noop_action)[3] for _ in range(5)]  # type: ignore[attr-defined]  # of SingleRole
    assert ends == [False] * 4 + [True]


@pytest.mark.parametrize(("frequency", "duration"), [(1, 3), (5, 2.0), (15, 0.7)])
def test_town_is_truncated_at_the_limit_of_its_specification(frequency: int, duration: float) -> None:
    settings = {"policy_frequency": frequency, "duration": duration, "vehicles": 0}
    env = gym.make("dorothie_gym/Town-v0", config=settings, town="brookside")
    assert env.spec is not None and env.spec.max_episode_steps is not None
    env.reset(seed=0)
    ends = [env.step(1)[3] for _ in range(env.spec.max_episode_steps)]
    assert ends == [False] * (len(ends) - 1) + [True]


def test_a_limit_given_to_make_is_kept() -> None:
    env = gym.make("dorothie_gym/Navigation-v0", max_episode_steps=50, town="brookside")
    assert env.spec is not None and env.spec.max_episode_steps == 50


def test_driving_has_a_reward_threshold() -> None:
    assert gym.spec("dorothie_gym/Navigation-v0").reward_threshold == 20.0


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("CoWizard-v0", {"config": EnvConfig(max_seconds=30.0, world=WorldConfig(vehicles=3), observe_acts=False)}),
        ("Participant-v0", {"config": EnvConfig(camera=CameraConfig(width=64, outputs=(CameraOutput.RGB,)))}),
        ("Navigation-v0", {"reward": NavigationWeights(time=-0.5), "guidance": "goals"}),
        ("Navigation-v0", {"observation": "camera", "camera": CameraConfig(width=64, height=64)}),
        ("UfN-v0", {"corpus": "corpus", "limits": SpaceLimits(objects=3)}),
    ],
)
def test_environment_is_made_again_from_the_json_of_its_spec(
    name: str, arguments: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    session(talk()).save(tmp_path / "corpus" / "one")
    env = gym.make(f"dorothie_gym/{name}", **arguments)
    assert env.spec is not None
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert (again.observation_space, again.action_space) == (env.observation_space, env.action_space)
    assert again.unwrapped.compatibility() == env.unwrapped.compatibility()  # type: ignore[attr-defined]
