"""The camera of a session shows its world: lights, signs, bodies, landmarks, and nothing that it must not know."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology import ObjectClass, WeatherParameter
from dorothie_gym.pictures.camera.body_placing import REACH, SHADED
from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
from dorothie_gym.pictures.camera.pose import CameraPose, pose_on_car
from dorothie_gym.pictures.camera.scene_building import build_town_scene
from dorothie_gym.pictures.camera.scenery.landmarks import landmark_key
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene, TownScene
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.state.codes import Colour
from dorothie_gym.sim.weather import Weather
from dorothie_gym.sim.world import World
from dorothie_gym.support.compilation.records import plain

SMALL = CameraConfig(width=240, height=160, outputs=tuple(CameraOutput))


@pytest.fixture(scope="module")
def town() -> Town:
    return load_town("brookside")


@pytest.fixture(scope="module")
def town_scene(town: Town) -> TownScene:
    return build_town_scene(town)


@pytest.fixture(scope="module")
def engine() -> SessionEngine:
    engine = SessionEngine("brookside", config=EnvConfig(world=WorldConfig(vehicles=40, pedestrians=40)))
    engine.reset(seed=3)
    engine.session.world.step(150)
    return engine


def scene_of(engine: SessionEngine, town_scene: TownScene) -> SessionScene:
    session = engine.session
    names = [name.label for name in session.scenario.street_names]
    return SessionScene(town_scene, names, session.task.storyboard.landmarks)


def frame_of(
    camera: SessionCamera, world: World, lane: int, station: float, weather: Weather | None = None
) -> CameraFrame:
    """Returns the picture of a camera on a car at a station of a lane."""
    place = world.town.lanes[lane]
    x, y = place.position(station).tolist()
    pose = pose_on_car(camera.config.mount, x, y, place.height_at(station), place.heading_at(station))
    return camera.render_from(pose, world.actors.arrays, weather or world.weather, time=world.time)


def parts(frame: CameraFrame) -> tuple[NDArray[np.generic], ...]:
    assert frame.rgb is not None and frame.depth is not None
    assert frame.semantic is not None and frame.instance is not None
    return frame.rgb, frame.depth, frame.semantic, frame.instance


def test_two_cameras_take_equal_pictures_whatever_they_drew_before(
    engine: SessionEngine, town_scene: TownScene
) -> None:
    world = engine.session.world
    first, second = (SessionCamera(scene_of(engine, town_scene), SMALL) for _ in range(2))
    for lane in range(0, len(world.town.lanes), 9):
        frame_of(second, world, lane, 1.0)
    for column, expected in zip(parts(second.render(world)), parts(first.render(world)), strict=True):
        np.testing.assert_array_equal(column, expected)


def test_lamp_pixels_show_the_state_of_the_traffic_lights(
    engine: SessionEngine, town_scene: TownScene, town: Town
) -> None:
    camera, world = SessionCamera(scene_of(engine, town_scene), SMALL), engine.session.world
    lanes = {signal.id: signal.lanes[0] for signal in town.signals if signal.lanes}
    shown = {LightColour.RED: Colour.RED, LightColour.YELLOW: Colour.YELLOW, LightColour.GREEN: Colour.GREEN}
    lenses, mesh = town_scene.lenses, town_scene.signals
    seen = set()
    for k in range(0, len(lenses.signals), 3):  # the three lenses of a light follow each other
        for time in (0.0, 11.0, 23.0, 26.0, 29.0):
            light = town.light(lanes[int(lenses.signals[k])], time)
            assert light is not None
            pixels = []
            for lens in (k, k + 1, k + 2):
                corners = mesh.corners[slice(*lenses.ranges[lens].tolist())].reshape(-1, 3).astype(float)
                x, y, z = corners.mean(axis=0).tolist()
                way = -mesh.normals[lenses.ranges[lens, 0]]
                pose = CameraPose(x - 1.5 * float(way[0]), y - 1.5 * float(way[1]), z, math.atan2(way[1], way[0]))
                picture = camera.render_from(pose, world.actors.arrays, world.weather, time=time).rgb
                assert picture is not None
                pixels.append(picture[80, 120].astype(int))
            brightest = int(np.argmax([pixel.max() for pixel in pixels]))
            assert lenses.colours[k + brightest] == shown[light]
            red, green, _ = pixels[brightest].tolist()
            assert {Colour.RED: red > 2 * green, Colour.GREEN: green > 2 * red}.get(shown[light], red > green > 100)
            seen.add(light)
    assert len(seen) == 3


def test_blades_without_a_name_are_empty(engine: SessionEngine, town_scene: TownScene) -> None:
    """Records of other corpora have no names."""
    whole, world = scene_of(engine, town_scene), engine.session.world
    mesh = town_scene.mesh
    row = int(np.argmax(mesh.textures))  # the blade of the last street that has one
    x, y, z = mesh.corners[row].mean(axis=0).tolist()
    way = -mesh.normals[row]
    pose = CameraPose(x - 0.6 * float(way[0]), y - 0.6 * float(way[1]), z, math.atan2(way[1], way[0]))
    pictures = []
    for names in (whole.street_names, whole.street_names[:2], ()):
        camera = SessionCamera(SessionScene(town_scene, names), SMALL)
        picture = camera.render_from(pose, world.actors.arrays, world.weather, time=0.0).rgb
        assert picture is not None
        pictures.append(picture.astype(int))
    named, few, none = pictures
    np.testing.assert_array_equal(few, none)
    assert np.abs(named - none).max() > 60  # letters


def test_bodies_are_listed_that_may_be_seen_or_cast_shadows(engine: SessionEngine, town_scene: TownScene) -> None:
    world = engine.session.world
    camera = SessionCamera(scene_of(engine, town_scene), SMALL)
    bodies = [*world.actors.vehicles, *world.actors.pedestrians]
    left_out = 0
    for lane in range(0, len(world.town.lanes), 6):
        x, y = world.town.lanes[lane].position(0.0).tolist()
        pose = pose_on_car(camera.config.mount, x, y, 0.0, world.town.lanes[lane].heading_at(0.0))
        view = camera.camera.view_of(pose)
        listed = set(plain(camera.placed(pose, world.actors.arrays, world.weather))["key"].tolist())
        for body in bodies:
            away = math.dist(body.position, (x, y))
            (column, _), depth = (part[0] for part in view.project(np.array([[*body.position, 1.0]])))
            if away <= SHADED or (depth > 0.0 and away < REACH and 0.0 <= column <= SMALL.width):
                assert body.key in listed
            elif depth < -20.0:
                assert body.key not in listed
                left_out += 1
    assert left_out > 20


def test_bodies_have_their_keys_as_instances(engine: SessionEngine, town_scene: TownScene) -> None:
    world = engine.session.world
    camera = SessionCamera(scene_of(engine, town_scene), SMALL)
    keys = {vehicle.key for vehicle in world.actors.vehicles} | {walker.key for walker in world.actors.pedestrians}
    found: set[int] = set()
    for lane in range(0, len(world.town.lanes), 4):
        frame = frame_of(camera, world, lane, 0.5 * world.town.lanes[lane].length)
        assert frame.instance is not None and frame.semantic is not None and frame.boxes is not None
        moving = np.isin(frame.semantic, [ObjectClass.VEHICLES.value, ObjectClass.PEDESTRIAN.value])
        found |= set(np.unique(frame.instance[moving & (frame.instance > 0)]).tolist()) & keys
        for key, (left, top, right, bottom), pixels in zip(
            frame.boxes.keys.tolist(), frame.boxes.limits.tolist(), frame.boxes.pixels.tolist(), strict=True
        ):
            mask = frame.instance == key
            rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
            assert (left, top, right, bottom) == (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1)
            assert pixels == mask.sum()
    assert len(found) > 20


def test_a_landmark_changes_no_picture_before_it_is_in_view(engine: SessionEngine, town_scene: TownScene) -> None:
    """Two sessions that differ in the place of a hidden landmark look alike where neither place is seen."""
    world, here = engine.session.world, scene_of(engine, town_scene)
    taken = {landmark.site for landmark in here.landmarks}
    free = next(lot.site for lot in town_scene.lots if lot.site not in taken)
    hidden = next(k for k, landmark in enumerate(here.landmarks) if landmark.hidden)
    moved = [replace(mark, site=free) if k == hidden else mark for k, mark in enumerate(here.landmarks)]
    plain = replace(SMALL, antialiasing=False)  # the samples of RGB are then those of the instances
    cameras = [SessionCamera(scene, plain) for scene in (here, replace(here, landmarks=moved))]
    key = landmark_key(here.landmarks[hidden].index)
    evening = Weather()
    evening.set(WeatherParameter.SUN_ALTITUDE_ANGLE, 10.0)  # long shadows
    unseen = seen = 0
    for lane in range(0, len(world.town.lanes), 2):
        frames = [frame_of(camera, world, lane, 1.0, evening) for camera in cameras]
        if any(key in np.unique(parts(frame)[3]) for frame in frames):
            seen += 1
            continue
        unseen += 1
        for column, expected in zip(*map(parts, frames), strict=True):
            np.testing.assert_array_equal(column, expected)
    assert unseen > 10 and seen > 0
