"""`render()` of an environment of one role shows what the role observes, and nothing else; and the windscreen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pettingzoo
import pytest
from numpy.typing import NDArray

import dorothie_gym
from dorothie_gym import EnvConfig, WorldConfig, make_policy
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.palette import Colour
from dorothie_gym.session.config import CameraConfig, CameraMount
from dorothie_gym.session.scenario import Scenario, draw_scenario
from dorothie_gym.session.spaces import ParticipantAction, Speech, noop
from dorothie_gym.testing.leaks import with_hidden_landmarks_moved, with_other_tasks

CONFIG = EnvConfig(world=WorldConfig(vehicles=4, pedestrians=2))
SILENT = {"participant": "silent", "ad_wizard": "silent"}


@pytest.fixture(autouse=True)
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def co_wizard(view: str) -> gym.Env[Any, Any]:
    return gym.make(
        "dorothie_gym/CoWizard-v0", render_mode="rgb_array", config=CONFIG, partners=SILENT, view=view, town="brookside"
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
    from dorothie_gym.pictures.views.role_scene import RoleView

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
        env = gym.make(
            "dorothie_gym/Navigation-v0", render_mode="rgb_array", guidance=guidance, view=view, town="brookside"
        )
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
    from dorothie_gym.pictures.views import frames

    rates = []
    monkeypatch.setattr(frames.HumanWindow, "show", lambda self, frame, rate=0.0: rates.append(rate))
    env = gym.make(
        "dorothie_gym/Navigation-continuous-v0", render_mode="human", decision_frequency=15.0, town="brookside"
    )
    env.reset(seed=0)
    env.step(np.zeros(3, dtype=np.float32))
    env.close()
    assert rates == [15.0, 15.0]


# --- Views through the windscreen -------------------------------------------------------------------------------------

LEFT, TOP = 832, 540
"""Width and height of the windscreen of the view "both" [px]."""

SMALL_TOWN: dict[str, Any] = {"town": "brookside", "render_mode": "rgb_array"}
DRIVEN = ["dorothie_gym/CoWizard-v0", "dorothie_gym/Navigation-v0", "dorothie_gym/Navigation-continuous-v0"]


def duo(render_view: str, camera: CameraConfig | None = None) -> dorothie_gym.DuoWizardEnv:
    return dorothie_gym.DuoWizardEnv(**SMALL_TOWN, config=replace(CONFIG, camera=camera), render_view=render_view)


@pytest.mark.parametrize("name", DRIVEN)
def test_every_environment_with_a_car_shows_its_windscreen(name: str) -> None:
    frames = {}
    for view in ("map", "camera", "both"):
        env = gym.make(name, **SMALL_TOWN, render_view=view).unwrapped
        env.reset(seed=2)
        env.step(env.action_space.sample() if "continuous" in name else getattr(env, "noop_action", 0))
        picture: Any = env.render()
        frames[view] = picture
        env.close()
    assert {view: frame.shape for view, frame in frames.items()} == {
        "map": (800, 1280, 3),
        "camera": (720, 1280, 3),
        "both": (720, 1280, 3),
    }
    assert all(frame.dtype == np.uint8 for frame in frames.values())
    sky = frames["both"][: TOP // 6, :LEFT].astype(int)
    assert (sky[..., 2] >= sky[..., 0]).mean() > 0.5, "the sky is above"


def test_the_windscreen_is_the_picture_of_the_sessions_camera() -> None:
    """Also where the session has no camera of its own; with one, its mount and angle count."""
    for own in (CameraConfig(), CameraConfig(field_of_view=60.0, mount=CameraMount(pitch=-8.0))):
        seen = duo("both", replace(own, width=LEFT, height=TOP))
        shown = duo("both") if own == CameraConfig() else duo("both", replace(own, width=40, height=24))
        for seed in (1, 2):
            observations, _ = seen.reset(seed=seed)
            shown.reset(seed=seed)
            picture = shown.render()
            assert picture is not None
            np.testing.assert_array_equal(picture[:TOP, :LEFT], observations["co_wizard"]["camera"])


def test_rendering_with_a_camera_changes_nothing_in_the_session() -> None:
    one, other = duo("both"), duo("map")
    for env in (one, other):
        env.reset(seed=4)
    for _ in range(3):
        actions = {agent: noop(Role(agent), one.limits) for agent in one.agents}
        observations, expected = one.step(actions)[0], other.step(actions)[0]
        one.render()
        for agent, fields in expected.items():
            assert list(observations[agent]) == list(fields)
            for name, value in fields.items():
                np.testing.assert_array_equal(observations[agent][name], value)


def test_subtitles_show_what_is_said_in_the_colour_of_its_speaker() -> None:
    env = duo("both")
    env.reset(seed=4)

    def inks() -> set[Colour]:
        picture = env.render()
        assert picture is not None
        found = np.unique(picture[TOP:, :LEFT].reshape(-1, 3), axis=0)
        return {(int(red), int(green), int(blue)) for red, green, blue in found}

    assert inks() == {palette.SUBTITLE_GROUND}
    words = "Please go to the red house over there."
    speech = ParticipantAction(speech=Speech(act=DialogueAct(move=DialogueMove.INSTRUCT), text=words))
    env.step(
        {
            "participant": speech.encode(env.limits),
            "co_wizard": noop(Role.CO_WIZARD, env.limits),
            "ad_wizard": noop(Role.AD_WIZARD, env.limits),
        }
    )
    assert palette.SUBTITLE_PARTICIPANT in inks() and palette.SUBTITLE_CO_WIZARD not in inks()
    for _ in range(14):  # until it was said, and some time ago
        env.step({agent: noop(Role(agent), env.limits) for agent in env.agents})
    assert palette.SUBTITLE_PARTICIPANT not in inks() and len(inks()) > 2


def test_an_unknown_view_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match="render_view is 'side'; it must be one of map, camera, both"):
        duo("side")
    with pytest.raises(ValueError, match="it must be one of map, camera, both"):
        gym.make("dorothie_gym/Navigation-v0", render_view="windscreen", town="brookside")


@pytest.mark.long
@pytest.mark.parametrize("name", ["Navigation-v0", "Navigation-continuous-v0"])
def test_batches_show_the_windscreens_of_their_environments(name: str) -> None:
    batch: Any = gym.make_vec(
        f"dorothie_gym/{name}", num_envs=2, town="brookside", render_mode="rgb_array", render_view="both", threads=1
    )
    batch.reset(seed=[3, 4])
    for number, seed in enumerate((3, 4)):
        env = gym.make(f"dorothie_gym/{name}", **SMALL_TOWN, render_view="both")
        env.reset(seed=seed)
        np.testing.assert_array_equal(batch.render_one(number), env.render())
    with pytest.raises(ValueError, match="render_view is 'side'; it must be one of map, camera, both"):
        gym.make_vec(f"dorothie_gym/{name}", num_envs=2, render_view="side")


def test_a_batch_of_sessions_shows_their_windscreens() -> None:
    batch = dorothie_gym.DuoWizardVectorEnv(
        2, "brookside", config=CONFIG, render_mode="rgb_array", render_view="camera"
    )
    batch.reset(seed=[3, 4])
    for number, seed in enumerate((3, 4)):
        single = duo("camera")
        single.reset(seed=seed)
        np.testing.assert_array_equal(batch.render_one(number), single.render())
