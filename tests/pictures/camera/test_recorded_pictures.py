"""Pictures of a recorded session look as those of the session when it was played."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.archive import read_session
from dorothie_gym.archive.sdn import write_sdn
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import Town, load_town
from dorothie_gym.ontology import AGENT_ROLES, ExceptionKind, PropKind, Role, Sensor, WeatherParameter
from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
from dorothie_gym.pictures.camera.pose import pose_on_car
from dorothie_gym.pictures.camera.range_sensors import Lidar, Radar
from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.recording import EventType, Session, Surroundings
from dorothie_gym.session.sensor_config import LidarConfig, RadarConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import ActionDict, AdWizardAction, LanePosition, ObservationMapping
from dorothie_gym.sim.config import WorldConfig
from tests.maps.opendrive_text import shared_map

CONFIG = CameraConfig(width=120, height=80, outputs=tuple(CameraOutput))
FRAMES = 15
"""Frames between two decisions."""

CONE_LANES = [lane.id for lane in load_town("brookside").lanes if not lane.in_junction and lane.length > 60.0][:15]


class Script(Policy[int]):
    """Ad-Wizard that blurs the view for a while, places a cone, and lets night fall."""

    def initial_state(self, seed: int, town: Town) -> int:
        return 0

    def step(self, observation: ObservationMapping, state: int) -> tuple[ActionDict, int]:
        if 5 <= state < 20:  # until there is room for one
            place = LanePosition(lane=CONE_LANES[state - 5], metres=30)
            action = AdWizardAction(exception=ExceptionKind.PLACE_PROP, prop=PropKind.TRAFFIC_CONE, place=place)
            return action.encode(self.limits), state + 1
        actions = {
            30: AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=Sensor.BLUR, on=True),
            36: AdWizardAction(exception=ExceptionKind.SENSOR_FAULT, sensor=Sensor.BLUR, on=False),
            44: AdWizardAction(exception=ExceptionKind.WEATHER, weather=WeatherParameter.SUN_ALTITUDE_ANGLE, share=0.3),
        }
        return actions.get(state, AdWizardAction()).encode(self.limits), state + 1


class Played(NamedTuple):
    session: Session
    folder: Path
    pictures: dict[int, CameraFrame]


@pytest.fixture(scope="module")
def town() -> Town:
    return load_town("brookside")


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Played:
    """A session of half a minute, and the pictures of its decisions by frame."""
    folder, pictures = tmp_path_factory.mktemp("played") / "one", {}
    config = EnvConfig(max_seconds=30.0, camera=CONFIG, world=WorldConfig(vehicles=60, pedestrians=60))
    engine = SessionEngine("brookside", config=config)

    def look(engine: SessionEngine) -> None:
        if (picture := engine.session.picture) is not None:
            pictures[engine.session.world.frame] = picture

    engine.reset(seed=4)
    policies = {role: make_policy("scripted", role, engine.limits) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
    play_session(
        engine, {**policies, Role.AD_WIZARD: Script(Role.AD_WIZARD, engine.limits)}, seed=4, folder=folder, on_step=look
    )
    return Played(Session.load(folder), folder, pictures)


@pytest.fixture(scope="module")
def recorded(played: Played, town: Town) -> RecordedPictures:
    return RecordedPictures(played.session, town, CONFIG)


def rgb(frame: CameraFrame) -> NDArray[np.int64]:
    assert frame.rgb is not None
    return frame.rgb.astype(np.int64)


def keys(frame: CameraFrame, least: int = 1) -> set[int]:
    assert frame.boxes is not None
    return {
        key
        for key, pixels in zip(frame.boxes.keys.tolist(), frame.boxes.pixels.tolist(), strict=True)
        if pixels >= least
    }


def test_a_recorded_picture_equals_the_live_one_but_for_gait_and_brake_lights(
    played: Played, recorded: RecordedPictures
) -> None:
    bodies: set[int] = set()
    equal: list[float] = []
    decisions = [frame for frame in played.pictures if frame > 0]
    assert len(decisions) == 60
    for frame in decisions:
        live, again = played.pictures[frame], recorded.picture(frame)
        assert live.instance is not None and again.instance is not None
        assert (rgb(live) == rgb(again)).all(axis=-1).mean() >= 0.99
        equal.append((live.instance == again.instance).mean())
        assert equal[-1] >= 0.99
        assert keys(live, 20) <= keys(again) and keys(again, 20) <= keys(live)
        bodies |= keys(again)
    assert np.mean(equal) >= 0.999
    assert len([key for key in bodies if key > 0]) > 10 and any(key < 0 for key in bodies)


def test_recorded_flow_and_turns_of_the_lidar_are_those_of_the_session(
    played: Played, recorded: RecordedPictures, town: Town
) -> None:
    flow: list[float] = []
    for frame in [frame for frame in played.pictures if frame > FRAMES][::6]:
        live, again = played.pictures[frame], recorded.picture(frame, since=frame - FRAMES)
        assert live.optical_flow is not None and again.optical_flow is not None
        flow.append(float((np.abs(live.optical_flow - again.optical_flow).max(axis=-1) < 0.05).mean()))
    assert min(flow) > 0.95 and np.mean(flow) > 0.98
    still = recorded.picture(450)
    assert still.optical_flow is not None and not still.optical_flow.any()
    lidar, car = Lidar(recorded.camera.scene, LidarConfig(columns=180)), recorded.car(450)
    turn = recorded.lidar_turn(450, lidar)
    np.testing.assert_array_equal(turn.points, recorded.lidar_turn(450, lidar).points)
    assert (turn.points[..., 3] > 0.0).mean() > 0.5
    radar = Radar(recorded.camera.scene, RadarConfig())
    detections = recorded.radar_detections(450, radar)
    moving = detections[detections[:, 0] > 0.0]
    assert np.median(moving[:, 3]) == pytest.approx(-car.speed, abs=0.2)  # most of them see the town


def test_pictures_do_not_depend_on_those_drawn_before(played: Played, recorded: RecordedPictures, town: Town) -> None:
    other = RecordedPictures(played.session, town, CONFIG)
    for frame in (450, 7, 452, 450, 901):
        np.testing.assert_array_equal(rgb(recorded.picture(frame)), rgb(other.picture(frame)))
        other.picture(frame // 2)


def test_between_two_records_bodies_are_between_their_places(recorded: RecordedPictures) -> None:
    moved = 0
    for frame in range(150, 600, FRAMES):
        tables = [
            {int(body.key): (float(body.x), float(body.y)) for body in recorded.bodies(frame + step).vehicles}
            for step in (0, 5, FRAMES)
        ]
        for key in set.intersection(*(set(table) for table in tables)):
            first, between, last = (np.array(table[key]) for table in tables)
            np.testing.assert_allclose(between, first + (last - first) / 3.0, atol=1e-9)
            moved += bool(np.hypot(*(last - first)) > 1.0)
    assert moved > 50


def test_the_camera_follows_the_car_frame_by_frame(played: Played, recorded: RecordedPictures) -> None:
    rows = played.session.trajectory
    for frame in (31, 200, 451):
        row = rows[np.searchsorted(rows["frame"], frame)]
        pose = recorded.pose(frame)
        expected = pose_on_car(CONFIG.mount, float(row["x"]), float(row["y"]), 0.0, float(row["heading"]))
        assert (pose.x, pose.y, pose.z, pose.heading) == pytest.approx(
            (expected.x, expected.y, expected.z, expected.heading), abs=1e-9
        )


def test_exceptions_show_from_the_frame_after_them(played: Played, recorded: RecordedPictures) -> None:
    """The blur, the cone and the night."""
    sharp, blurred = (float(np.abs(np.diff(rgb(recorded.picture(frame)), axis=1)).mean()) for frame in (450, 451))
    assert blurred < 0.7 * sharp
    placed = next(event.frame for event in played.session.of_type(EventType.EXCEPTION) if event.data.get("prop"))
    assert not len(recorded.bodies(placed).props) and len(recorded.bodies(placed + FRAMES).props)
    assert rgb(recorded.picture(675)).mean() < 0.6 * rgb(recorded.picture(660)).mean()


def test_frames_keep_their_rate(recorded: RecordedPictures) -> None:
    assert (recorded.first_frame, recorded.last_frame) == (1, 900)
    for rate, step in ((30.0, 1), (10.0, 3), (2.0, 15), (100.0, 1)):
        frames = list(recorded.frames(rate))
        assert frames[0] == step and frames[1] - frames[0] == step and frames[-1] == 900
    assert list(recorded.frames(0.02)) == [1], "the first where there is no such frame"
    numbers = [frame for frame, _ in recorded.pictures(0.1)]
    assert numbers == [300, 600, 900]


def test_a_session_of_sdns_layout_shows_its_surroundings(played: Played, tmp_path: Path, town: Town) -> None:
    """At ten frames a second, with everything else as in the native recording."""
    imported = read_session(write_sdn(played.session, tmp_path / "sdn"))
    again = RecordedPictures(imported, town, CONFIG)
    native = RecordedPictures(played.session, town, CONFIG)
    shift = native.last_frame - again.last_frame
    compared = 0
    for frame in range(90, 880, 90):
        one, other = native.picture(frame), again.picture(frame - shift)
        assert one.instance is not None and other.instance is not None
        assert (one.instance == other.instance).mean() > 0.98
        compared += bool(keys(one))
    assert compared > 5


@pytest.mark.slow
def test_bodies_on_hills_and_bridges_are_as_high_as_they_were(tmp_path: Path) -> None:
    """Also with a road above or below."""
    map_ = load_town(shared_map("Town05"))
    engine = SessionEngine(map_, config=EnvConfig(max_seconds=5.0, world=WorldConfig(vehicles=100, pedestrians=100)))
    live: dict[int, dict[int, float]] = {}

    def look(engine: SessionEngine) -> None:
        world = engine.session.world
        driving = {int(body.key): float(body.height) for body in world.actors.vehicles}
        walking = {int(body.key): float(body.height) for body in world.actors.pedestrians}
        live[world.frame] = {**driving, **walking, 0: float(world.car.height)}

    policies = {role: make_policy("silent", role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=3, folder=tmp_path / "s", on_step=look)
    again = RecordedPictures(Session.load(tmp_path / "s"), map_, CONFIG)
    gaps: list[float] = []
    for frame in (15, 60, 150):
        bodies = again.bodies(frame)
        assert again.pose(frame).z - CONFIG.mount.up == pytest.approx(live[frame][0], abs=0.05)
        for body in bodies.vehicles:
            assert float(body.height) == pytest.approx(live[frame][int(body.key)], abs=1e-9)
        gaps += [abs(float(body.height) - live[frame][int(body.key)]) for body in bodies.pedestrians]
    assert max(live[150].values()) > 5.0
    assert np.mean(np.array(gaps) < 0.1) > 0.98


def test_keys_that_are_no_instances_are_numbered(played: Played, town: Town) -> None:
    table = played.session.scene.actors
    rows = table.rows.copy()
    rows["key"] += 2**40
    scene = dataclasses.replace(played.session.scene, actors=dataclasses.replace(table, rows=rows))
    changed = RecordedPictures(dataclasses.replace(played.session, scene=scene), town, CONFIG)
    numbers = {int(body.key) for body in changed.bodies(450).vehicles}
    assert len(numbers) == len(changed.bodies(450).vehicles) and min(numbers) > 0 and max(numbers) <= len(rows)


def test_a_session_without_surroundings_or_frames_is_refused(played: Played, town: Town) -> None:
    bare = dataclasses.replace(played.session, scene=Surroundings())
    with pytest.raises(SessionError, match=r"one: has no recorded surroundings \(actors\)"):
        RecordedPictures(bare, town, CONFIG)
    still = dataclasses.replace(played.session, trajectory=played.session.trajectory[:0])
    with pytest.raises(SessionError, match="one: has no frames of the car"):
        RecordedPictures(still, town, CONFIG)
