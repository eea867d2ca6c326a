"""Pictures, and what the roles see by them, tell nothing of hidden landmarks that are out of view."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import DEVELOPMENT_TOWNS, SEEN_TOWNS, load_town
from dorothie_gym.pictures.camera.camera_perception import CameraPerception
from dorothie_gym.pictures.camera.scenery import landmarks as landmark_models
from dorothie_gym.session.config import CameraConfig, CameraMount, CameraOutput, EnvConfig, PerceptionModel
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.sensor_config import LidarConfig, LidarOutput, RadarConfig, SensorConfig
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.testing.leaks import check_hidden_landmarks, check_observations_do_not_leak
from dorothie_gym.testing.playing import play_scripted

ALL = tuple(output for output in CameraOutput if output is not CameraOutput.BOXES)
IN_VIEW = tuple(output for output in ALL if output is not CameraOutput.BIRDS_EYE)
CONFIG = EnvConfig(
    camera=CameraConfig(width=120, height=80, outputs=IN_VIEW),
    perception=PerceptionModel.CAMERA,
    world=WorldConfig(vehicles=6, pedestrians=4),
)
SYMBOLIC = EnvConfig(camera=CONFIG.camera, world=CONFIG.world)
FROM_ABOVE = EnvConfig(camera=CameraConfig(width=120, height=80, outputs=ALL), world=CONFIG.world)
SENSORS = EnvConfig(
    cameras={
        "left": CameraConfig(width=60, height=40, mount=CameraMount(yaw=-90.0), outputs=IN_VIEW),
        "rear": CameraConfig(width=60, height=40, mount=CameraMount(yaw=180.0)),
    },
    sensors=SensorConfig(
        lidar=LidarConfig(channels=16, columns=180, range=40.0, outputs=tuple(LidarOutput)),
        radar=RadarConfig(), imu=True, gnss=True, lane_invasion=True, collision=True,
    ),
    world=CONFIG.world,
)  # fmt: skip


def has_hidden(town: str, seed: int) -> bool:
    return any(landmark.hidden for landmark in draw_scenario(load_town(town), None, seed).storyboard.landmarks)


@pytest.mark.long
def test_pictures_and_what_is_seen_by_them_do_not_leak() -> None:
    check_observations_do_not_leak(DuoWizardEnv("brookside", config=CONFIG), seed=2, decisions=16)


@pytest.mark.long
@pytest.mark.parametrize(
    ("town", "config"),
    [
        ("brookside", CONFIG),
        ("midtown", CONFIG),
        ("brookside", SYMBOLIC),
        ("brookside", SENSORS),
        ("midtown", SENSORS),
        ("brookside", FROM_ABOVE),
    ],
    ids=["brookside", "midtown", "symbolic", "sensors", "sensors-midtown", "from-above"],
)
def test_hidden_landmarks_change_no_picture_while_out_of_view(town: str, config: EnvConfig) -> None:
    env, pictures = DuoWizardEnv(town, config=config), 0
    for seed in [seed for seed in range(30) if has_hidden(town, seed)][:2]:
        pictures += check_hidden_landmarks(env, play_scripted, seed, 30).pictures
    assert pictures > 8


@pytest.mark.slow
@pytest.mark.parametrize("town", [*DEVELOPMENT_TOWNS, *SEEN_TOWNS])
@pytest.mark.parametrize("config", [CONFIG, SYMBOLIC, SENSORS], ids=["camera", "symbolic", "sensors"])
def test_hidden_landmarks_change_no_picture_in_many_sessions(town: str, config: EnvConfig) -> None:
    env = DuoWizardEnv(town, config=config)
    compared = [
        check_hidden_landmarks(env, play_scripted, seed, 200)
        for seed in [seed for seed in range(500, 600) if has_hidden(town, seed)][:6]
    ]
    assert sum(pair.in_view for pair in compared) > 0
    assert sum(pair.pictures for pair in compared) > 50


# --- Leaks that are planted are found ---------------------------------------------------------------------------------


class HintingEnv(DuoWizardEnv):
    """Changes a pixel of a field of both roles by the place of the first hidden landmark."""

    field = "camera"

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        observations, infos = super().reset(seed, options)
        return self._hint(observations), infos

    def step(self, actions: Any) -> Any:
        observations, *rest = super().step(actions)
        return (self._hint(observations), *rest)

    def _hint(self, observations: Any) -> Any:
        hidden = next(landmark for landmark in self.scenario.storyboard.landmarks if landmark.hidden)
        for agent in ("participant", "co_wizard"):
            if self.field in observations.get(agent, {}):
                observations[agent][self.field].flat[0] = int(abs(hidden.position[0]) * 7) % 100
        return observations


@pytest.mark.parametrize(
    ("config", "field"),
    [(SYMBOLIC, "camera"), (SYMBOLIC, "semantic"), (SYMBOLIC, "normals"), (SENSORS, "left_camera")],
)
def test_a_pixel_that_tells_the_place_is_found(config: EnvConfig, field: str) -> None:
    env = HintingEnv("brookside", config=config)
    env.field = field
    with pytest.raises(AssertionError, match=f"the picture {field} of participant differs"):
        check_hidden_landmarks(env, play_scripted, out_of_view(env), 3)


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ("lidar", "the picture lidar of co_wizard"),
        ("radar", "the picture radar of co_wizard"),
        ("accelerometer", "observation accelerometer"),
        ("gnss", "observation gnss"),
    ],
)
def test_a_reading_that_tells_the_place_is_found(field: str, message: str) -> None:
    env = HintingEnv("brookside", config=SENSORS)
    env.field = field
    with pytest.raises(AssertionError, match=message):
        check_hidden_landmarks(env, play_scripted, out_of_view(env), 3)


def test_a_shadow_of_a_landmark_would_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A landmark that the picture shows without its key is as good as one that is out of view."""
    form = landmark_models.landmark_form

    def unnamed(landmarks: Any, lots: Any, ground: Any) -> Any:
        return landmark_models.joined([form(mark.name, lots[mark.site], ground) for mark in landmarks])

    monkeypatch.setattr("dorothie_gym.pictures.camera.town_scene.build_landmarks", unnamed)
    env = DuoWizardEnv("brookside", config=SYMBOLIC)
    with pytest.raises(AssertionError, match=r"the picture \w+ of participant differs"):
        check_hidden_landmarks(env, play_scripted, 1, 60)


def plant_clairvoyance(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CameraPerception, "_recognises", lambda self, landmark, pixels: True)


def plant_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = CameraPerception.pixels

    def fewer(self: CameraPerception, key: int) -> int:
        hidden = next(mark for mark in self._scenario.storyboard.landmarks if mark.hidden)
        return pixels(self, key) if key < 0 or key % 2 == int(hidden.position[0]) % 2 else 0

    monkeypatch.setattr(CameraPerception, "pixels", fewer)


@pytest.mark.parametrize(
    ("plant", "message"),
    [(plant_clairvoyance, "the Co-Wizard's observation landmarks"), (plant_objects, "observation objects differs")],
)
def test_perception_that_knows_more_than_the_picture_is_found(
    plant: Callable[[pytest.MonkeyPatch], None], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    env = DuoWizardEnv("brookside", config=CONFIG)
    seeds = [seed for seed in range(40) if has_hidden("brookside", seed)][:6]
    plant(monkeypatch)
    with pytest.raises(AssertionError, match=message):
        assert [check_hidden_landmarks(env, play_scripted, seed, 12) for seed in seeds]


def out_of_view(env: DuoWizardEnv) -> int:
    """Returns a seed whose session begins without a hidden landmark in view, before and after it is moved."""
    plain = DuoWizardEnv(env.town, config=env.config)
    for seed in range(100):
        if has_hidden("brookside", seed) and not check_hidden_landmarks(plain, play_scripted, seed, 1).in_view:
            return seed
    raise AssertionError("a hidden landmark is always in view")


def test_moved_landmarks_come_into_view_sometimes() -> None:
    """The check stops to compare where it should, and only there."""
    env = DuoWizardEnv("brookside", config=SYMBOLIC)
    checks = (
        check_hidden_landmarks(env, play_scripted, seed, 60) for seed in range(40) if has_hidden("brookside", seed)
    )
    compared = next(check for check in checks if 0 < check.in_view < check.decisions)
    assert compared.pictures == compared.decisions - compared.in_view
