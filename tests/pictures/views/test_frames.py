from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import Role
from dorothie_gym.pictures import palette
from dorothie_gym.pictures.views.frames import HumanWindow, SceneRenderer
from dorothie_gym.pictures.views.scene import Actor, CarView, Pin, Scene, SpokenLine

SIZE = (1280, 800)


@pytest.fixture(scope="module")
def town() -> Town:
    return load_town("brookside")


@pytest.fixture(scope="module")
def renderer() -> SceneRenderer:
    return SceneRenderer(SIZE)


@pytest.fixture
def scene(town: Town) -> Scene:
    lane = max((lane for lane in town.lanes if not lane.in_junction), key=lambda lane: lane.length)
    trail = np.array([lane.position(s) for s in np.arange(0.0, lane.length * 0.6, 0.3)])
    way = np.array([lane.position(s) for s in np.arange(lane.length * 0.6, lane.length, 1.0)])
    heading = lane.heading_at(lane.length * 0.6)
    site = town.sites[0]
    return Scene(
        time=75.0,
        town=town,
        car=CarView(x=trail[-1, 0], y=trail[-1, 1], heading=heading, speed=5.0, lights=True),
        trail=trail,
        waypoints=way,
        others=[
            Actor(kind="vehicle", x=way[-1, 0], y=way[-1, 1]),
            Actor(kind="cyclist", x=way[-3, 0], y=way[-3, 1], length=1.8, width=0.6),
            Actor(kind="pedestrian", x=way[-5, 0], y=way[-5, 1], length=0.6, width=0.6),
            Actor(kind="prop", x=way[-7, 0], y=way[-7, 1], length=1.0, width=1.0),
        ],
        landmarks=[Pin(label="KFC", x=site.position[0], y=site.position[1], waypoint=site.waypoint, state="ongoing")],
        subgoals=[("Fetch lunch at the KFC.", "ongoing")],
        utterances=[
            SpokenLine(time=3.0, speaker=Role.PARTICIPANT, text="To the KFC, please.", acts="Instruct(KFC)"),
            SpokenLine(time=5.0, speaker=Role.CO_WIZARD, text="Okay.", acts="Acknowledge"),
            SpokenLine(time=60.0, speaker=Role.AD_WIZARD, text="It starts to rain."),
            SpokenLine(time=70.0, speaker=Role.AGENT, text="Stopped for a pedestrian."),
        ],
        notes=["Hazard stop"],
        caption="Lunch",
    )


def count(frame: np.ndarray, colour: tuple[int, int, int]) -> int:
    return int((frame == np.array(colour, dtype=np.uint8)).all(axis=-1).sum())


@pytest.mark.parametrize("follow", [True, False])
def test_frame_has_shape_and_type(renderer: SceneRenderer, scene: Scene, follow: bool) -> None:
    frame = renderer.draw(scene, follow)
    assert frame.shape == (800, 1280, 3)
    assert frame.dtype == np.uint8
    assert frame.flags.c_contiguous


@pytest.mark.parametrize("follow", [True, False])
def test_trail_is_painted_where_the_car_drove(renderer: SceneRenderer, scene: Scene, follow: bool) -> None:
    frame = renderer.draw(scene, follow)
    without = renderer.draw(dataclasses.replace(scene, trail=np.zeros((0, 2))), follow)
    assert count(frame, palette.TRAIL) > 100
    assert count(without, palette.TRAIL) == 0


def test_trail_lies_behind_the_car_in_the_following_view(renderer: SceneRenderer, scene: Scene) -> None:
    frame = renderer.draw(scene, follow=True)
    scale = 800 / 160.0
    x, y = np.round(np.array([440, 400]) + (scene.trail[-40] - scene.trail[-1]) * scale).astype(int)
    assert tuple(frame[y, x]) == palette.TRAIL


def test_car_is_in_the_middle_of_the_following_view(renderer: SceneRenderer, scene: Scene) -> None:
    frame = renderer.draw(scene, follow=True)
    assert count(frame[390:410, 430:450], palette.CAR) > 40


def test_all_road_users_are_shown(renderer: SceneRenderer, scene: Scene) -> None:
    close = dataclasses.replace(
        scene,
        others=[
            dataclasses.replace(actor, x=scene.car.x + 12.0 * k, y=scene.car.y + 15.0)
            for k, actor in enumerate(scene.others)
        ],
    )
    frame = renderer.draw(close, follow=True)
    for colour in (palette.VEHICLE, palette.CYCLIST, palette.PEDESTRIAN, palette.PROP):
        assert count(frame[:, :880], colour) > 4


def test_a_task_turns_green_when_it_is_complete(renderer: SceneRenderer, scene: Scene) -> None:
    panel = renderer.draw(dataclasses.replace(scene, subgoals=[("Fetch lunch.", "none")]), False)[:, 880:]
    done = renderer.draw(dataclasses.replace(scene, subgoals=[("Fetch lunch.", "complete")]), False)[:, 880:]
    assert count(panel, palette.STATE["complete"]) == 0
    assert count(done, palette.STATE["complete"]) > 50


def test_a_hidden_landmark_is_drawn_hollow(renderer: SceneRenderer, scene: Scene) -> None:
    filled = renderer.draw(scene, follow=False)[:, :880]
    pin = dataclasses.replace(scene.landmarks[0], hidden=True)
    hollow = renderer.draw(dataclasses.replace(scene, landmarks=[pin]), follow=False)[:, :880]
    assert count(hollow, palette.STATE["ongoing"]) < count(filled, palette.STATE["ongoing"]) - 80


def test_speakers_have_their_own_bubbles(renderer: SceneRenderer, scene: Scene) -> None:
    panel = renderer.draw(scene, follow=False)[:, 880:]
    left, right = panel[:, :60], panel[:, 340:]
    assert count(left, palette.BUBBLE_PARTICIPANT) > 200 and count(right, palette.BUBBLE_PARTICIPANT) == 0
    assert count(right, palette.BUBBLE_CO_WIZARD) > 200 and count(left, palette.BUBBLE_CO_WIZARD) == 0
    assert count(panel, palette.BUBBLE_AD_WIZARD) > 200


def test_a_long_conversation_keeps_its_end(renderer: SceneRenderer, scene: Scene) -> None:
    talk = [SpokenLine(time=float(k), speaker=Role.CO_WIZARD, text=f"Message number {k}, " * 6) for k in range(60)]
    last = SpokenLine(time=61.0, speaker=Role.PARTICIPANT, text="Stop here.")
    panel = renderer.draw(dataclasses.replace(scene, utterances=[*talk, last]), follow=False)[:, 880:]
    assert count(panel[700:, :60], palette.BUBBLE_PARTICIPANT) > 200


def test_night_is_darker_and_fog_is_greyer(renderer: SceneRenderer, scene: Scene) -> None:
    def view(**weather: float) -> np.ndarray:
        return renderer.draw(dataclasses.replace(scene, weather=weather), follow=True)[:, :880].astype(float)

    day = view()
    assert view(sun_altitude_angle=-30.0).mean() < 0.75 * day.mean()
    assert view(fog_density=90.0).std() < 0.8 * day.std()
    assert not np.array_equal(view(precipitation=90.0), day)


def test_same_scene_gives_the_same_pixels(scene: Scene) -> None:
    rainy = dataclasses.replace(scene, weather={"precipitation": 60.0})
    first, second = (SceneRenderer((640, 400)).draw(rainy, follow=True) for _ in range(2))
    assert np.array_equal(first, second)


def test_picture_is_saved(renderer: SceneRenderer, scene: Scene, tmp_path: Path) -> None:
    renderer.save(scene, tmp_path / "scene.png")
    assert (tmp_path / "scene.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(FileNotFoundError, match="make it first"):
        renderer.save(scene, tmp_path / "missing" / "scene.png")


def test_nothing_but_a_town_and_a_car_is_needed(renderer: SceneRenderer, town: Town) -> None:
    frame = renderer.draw(Scene(time=0.0, town=town, car=CarView(x=1e4, y=-1e4, heading=0.0)), follow=True)
    assert frame.shape == (800, 1280, 3)


def test_window_shows_frames_and_is_closed_by_its_user(
    renderer: SceneRenderer, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = HumanWindow(SIZE)
    frame = renderer.draw(scene, follow=True)
    window.show(frame)
    assert tuple(pygame.display.get_surface().get_at((440, 400)))[:3] == tuple(frame[400, 440])
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.show(frame)
    assert window.closed
    window.show(frame)
    window.close()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda town: Actor(kind="boat", x=0.0, y=0.0), "Actor.kind"),
        (lambda town: Pin(label="KFC", x=0.0, y=0.0, waypoint=(0.0, 0.0), state="lost"), "Pin.state"),
        (
            lambda town: Scene(time=0.0, town=town, car=CarView(x=0.0, y=0.0, heading=0.0), trail=np.zeros(4)),
            "Scene.trail",
        ),
        (lambda town: SceneRenderer((100, 100)), "size"),
    ],
)
def test_invalid_scenes_are_refused(town: Town, make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make(town)  # type: ignore[operator]  # declared as object, because the functions differ
