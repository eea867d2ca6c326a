"""`render()` of an environment of one role shows what the role observes, and nothing else."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pettingzoo
import pytest
from numpy.typing import NDArray

import dorothie_gym
from dorothie_gym import EnvConfig, WorldConfig, make_policy
from dorothie_gym.engine.scenario import Scenario, draw_scenario
from dorothie_gym.ontology import Role
from dorothie_gym.testing.leaks import with_hidden_landmarks_moved, with_other_tasks

CONFIG = EnvConfig(world=WorldConfig(vehicles=4, pedestrians=2))
SILENT = {"participant": "silent", "ad_wizard": "silent"}


@pytest.fixture(autouse=True)
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def co_wizard(view: str) -> gym.Env[Any, Any]:
    return gym.make(
        "dorothie_gym/CoWizard-v0", render_mode="rgb_array", config=CONFIG, partners=SILENT, view=view
    ).unwrapped


def frames(env: gym.Env[Any, Any], scenario: Scenario, decisions: int = 24) -> list[NDArray[np.uint8]]:
    """Plays the scripted Co-Wizard among silent partners, and returns a frame of every eighth decision."""
    limits = env.get_wrapper_attr("engine").limits
    policy: Any = make_policy("scripted", Role.CO_WIZARD, limits)
    state = policy.initial_state(0, env.get_wrapper_attr("engine").town)
    seen, _ = env.reset(options={"scenario": scenario})
    drawn: list[Any] = [env.render()]
    for k in range(decisions):
        action, state = policy.step(seen, state)
        seen, *_ = env.step(action)
        if k % 8 == 7:
            drawn.append(env.render())
    return drawn


def scenario_with_hidden_landmark() -> Scenario:
    town = dorothie_gym.load_town("brookside")
    drawn = (draw_scenario(town, None, seed) for seed in range(1000))
    return next(scenario for scenario in drawn if any(mark.hidden for mark in scenario.storyboard.landmarks))


def altered(scenario: Scenario) -> list[Scenario]:
    town = dorothie_gym.load_town("brookside")
    return [with_hidden_landmarks_moved(scenario, town, np.random.default_rng(3)), with_other_tasks(scenario)]


def test_picture_of_the_co_wizard_does_not_show_hidden_landmarks_and_tasks() -> None:
    env, scenario = co_wizard("role"), scenario_with_hidden_landmark()
    shown = frames(env, scenario)
    for other in altered(scenario):
        for k, (frame, same) in enumerate(zip(shown, frames(env, other), strict=True)):
            np.testing.assert_array_equal(frame, same, err_msg=f"frame {k}")
    assert not np.array_equal(shown[0], shown[-1])


def test_picture_of_the_session_is_asked_for_by_name_and_shows_them() -> None:
    env, scenario = co_wizard("session"), scenario_with_hidden_landmark()
    shown = frames(env, scenario, decisions=0)
    for other in altered(scenario):
        assert not np.array_equal(shown[0], frames(env, other, decisions=0)[0])


def test_the_three_roles_see_different_pictures_of_one_session() -> None:
    drawn = []
    for name in ("Participant", "CoWizard", "AdWizard"):
        env = gym.make(f"dorothie_gym/{name}-v0", render_mode="rgb_array", config=CONFIG)
        env.reset(seed=7)
        frame: Any = env.render()
        assert frame.shape == (800, 1280, 3) and frame.dtype == np.uint8
        drawn.append(frame)
    assert not np.array_equal(drawn[0], drawn[1])
    assert not np.array_equal(drawn[1], drawn[2])
    assert not np.array_equal(drawn[0], drawn[2])


def test_participant_sees_its_tasks_and_the_co_wizard_has_none() -> None:
    from dorothie_gym.engine.role_scene import RoleView

    env = pettingzoo.make("parallel", "dorothie_gym/DuoWizard-v0")
    observations, _ = env.reset(seed=7)
    scenes = {}
    for role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD):
        view = RoleView(role, env.unwrapped.town)  # type: ignore[attr-defined]  # of this package's class
        view.note(observations[str(role)])
        scenes[role] = view.scene()
    texts = [text for text, _ in scenes[Role.PARTICIPANT].subgoals]
    assert texts == observations["participant"]["tasks"].split("\n")
    assert not scenes[Role.CO_WIZARD].subgoals
    assert len(scenes[Role.AD_WIZARD].subgoals) == len(texts)
    assert len(scenes[Role.CO_WIZARD].landmarks) < len(scenes[Role.PARTICIPANT].landmarks)
    assert "7-Eleven" in [pin.label for pin in scenes[Role.PARTICIPANT].landmarks]


@pytest.mark.parametrize("name", ["CoWizard-v0", "Navigation-v0", "Navigation-continuous-v0"])
def test_unknown_view_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="view is 'all'; it must be one of role, session"):
        gym.make(f"dorothie_gym/{name}", view="all")


@pytest.mark.parametrize("view", ["role", "session"])
def test_picture_of_a_navigation_shows_the_instruction(view: str) -> None:
    drawn = []
    for guidance in ("turns", "goals"):
        env = gym.make("dorothie_gym/Navigation-v0", render_mode="rgb_array", guidance=guidance, view=view)
        env.reset(seed=3)
        drawn.append(np.asarray(env.render())[:, 900:])  # the panel
    assert not np.array_equal(*drawn)


@pytest.mark.parametrize(
    ("name", "arguments", "rate"),
    [
        ("CoWizard-v0", {}, 2),
        ("CoWizard-v0", {"config": EnvConfig(decision_frequency=5.0)}, 5),
        ("Navigation-v0", {}, 2),
        ("Navigation-continuous-v0", {}, 10),
        ("Navigation-continuous-v0", {"decision_frequency": 15.0}, 15),
    ],
)
def test_declared_frame_rate_is_that_of_the_decisions(name: str, arguments: dict[str, Any], rate: int) -> None:
    assert gym.make(f"dorothie_gym/{name}", **arguments).metadata["render_fps"] == rate


def test_window_is_paced_at_the_frame_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    from dorothie_gym.rendering import frames

    rates = []
    monkeypatch.setattr(frames.HumanWindow, "show", lambda self, frame, rate=0.0: rates.append(rate))
    env = gym.make("dorothie_gym/Navigation-continuous-v0", render_mode="human", decision_frequency=15.0)
    env.reset(seed=0)
    env.step(np.zeros(3, dtype=np.float32))
    env.close()
    assert rates == [15.0, 15.0]
