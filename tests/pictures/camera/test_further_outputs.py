"""Cameras in any direction, optical flow, normals, and the view from above."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.ontology import ObjectClass, WeatherParameter
from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
from dorothie_gym.pictures.camera.pose import CameraPose, axes_of, pose_on_car
from dorothie_gym.pictures.camera.session_camera import EarlierWorld, SessionCamera
from dorothie_gym.pictures.camera.session_pictures import scene_of
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, CameraMount, CameraOutput, EnvConfig
from dorothie_gym.session.sensor_config import SensorMount
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.weather import Weather

CONFIG = CameraConfig(width=160, height=120, outputs=tuple(CameraOutput), antialiasing=False)
FLAT_CLASSES = [ObjectClass.ROAD.value, ObjectClass.ROAD_LINE.value, ObjectClass.SIDE_WALK.value]


def points_of(frame: CameraFrame) -> NDArray[np.float64]:
    """Returns the positions (h, w, 3) [m] of the surfaces of a picture."""
    assert frame.depth is not None
    return np.asarray(frame.view.origin + frame.view.rays() * frame.depth[..., None].astype(np.float64))


# --- Mounts -----------------------------------------------------------------------------------------------------------


def turned(yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    """Returns the rotation of (forward, right, up) by roll, then pitch, then yaw [degrees]."""
    y, p, r = (math.radians(angle) for angle in (yaw, pitch, roll))
    about_forward = [[1, 0, 0], [0, math.cos(r), math.sin(r)], [0, -math.sin(r), math.cos(r)]]
    about_right = [[math.cos(p), 0, -math.sin(p)], [0, 1, 0], [math.sin(p), 0, math.cos(p)]]
    about_up = [[math.cos(y), -math.sin(y), 0], [math.sin(y), math.cos(y), 0], [0, 0, 1]]
    return np.array(about_up) @ np.array(about_right) @ np.array(about_forward)


@pytest.mark.parametrize("angles", [(90.0, 0.0, 0.0), (180.0, -5.0, 0.0), (-40.0, 12.0, 25.0), (0.0, 3.0, -170.0)])
@pytest.mark.parametrize("rise", [0.0, 0.11])
def test_mounts_turn_the_axes_of_the_car(angles: tuple[float, float, float], rise: float) -> None:
    yaw, pitch, roll = angles
    pose = pose_on_car(SensorMount(yaw=yaw, pitch=pitch, roll=roll, right=0.5, up=1.5), 3.0, -2.0, 1.0, 0.7, rise)
    right, up, forward = axes_of(0.7, math.atan(rise))
    car = np.stack((forward, right, up), axis=-1)
    expected = car @ turned(yaw, pitch, roll)
    found = axes_of(pose.heading, pose.pitch, pose.roll)
    np.testing.assert_allclose(np.stack((found[2], found[0], found[1]), axis=-1), expected, atol=1e-12)
    np.testing.assert_allclose([pose.x, pose.y, pose.z], [3.0, -2.0, 1.0] + 0.5 * right + 1.5 * up, atol=1e-12)
    assert math.cos(pose.heading - pose.yaw) == pytest.approx(math.cos(0.7))


def test_straight_mounts_do_not_roll() -> None:
    pose = pose_on_car(CameraMount(), 3.0, -2.0, 1.0, 0.7, 0.1)
    assert (pose.heading, pose.roll, pose.yaw) == (0.7, 0.0, 0.0)


def test_a_picture_to_the_side_is_that_of_a_turned_car(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    config = CameraConfig(width=120, height=80)
    camera = SessionCamera(scene, config)
    lane = world.town.lanes[30]
    x, y = lane.position(1.0).tolist()
    height, heading = lane.height_at(1.0), lane.heading_at(1.0)
    side = pose_on_car(CameraMount(forward=0.0, yaw=90.0), x, y, height, heading)
    around = pose_on_car(CameraMount(forward=0.0), x, y, height, heading + 0.5 * math.pi)
    pictures = [
        camera.render_from(pose, world.actors.arrays, world.weather, time=world.time).colours.astype(int)
        for pose in (side, around)
    ]
    assert (np.abs(pictures[0] - pictures[1]).max(axis=-1) > 8).mean() < 0.01


def test_headlights_shine_ahead_of_the_car_in_pictures_to_the_side(engine: SessionEngine, scene: SessionScene) -> None:
    world, night = engine.session.world, Weather()
    night.set(WeatherParameter.SUN_ALTITUDE_ANGLE, -60.0)
    lane = world.town.lanes[30]
    x, y = lane.position(1.0).tolist()
    camera = SessionCamera(scene, CameraConfig(width=120, height=80))

    def gain(yaw: float) -> float:
        pose = pose_on_car(CameraMount(yaw=yaw, pitch=-20.0), x, y, lane.height_at(1.0), lane.heading_at(1.0))
        on, off = (
            camera.render_from(pose, world.actors.arrays, night, time=0.0, head_lights=lights).colours.astype(int)
            for lights in (True, False)
        )
        return float((on - off).sum())

    assert gain(0.0) > 1e4
    assert abs(gain(180.0)) < 0.02 * gain(0.0)


# --- Normals ----------------------------------------------------------------------------------------------------------


def test_normals_stand_on_the_surface_and_face_the_camera(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    frame = SessionCamera(scene, CONFIG).render(world)
    assert frame.normals is not None and frame.depth is not None
    normals = frame.normals.astype(np.float64)
    sky = ~np.isfinite(frame.depth)
    assert not normals[sky].any()
    np.testing.assert_allclose(np.linalg.norm(normals[~sky], axis=-1), 1.0, atol=1e-5)
    right = (np.arange(CONFIG.width) + 0.5 - 0.5 * CONFIG.width) / frame.view.focal
    down = (np.arange(CONFIG.height) + 0.5 - 0.5 * CONFIG.height) / frame.view.focal
    rays = np.stack((*np.broadcast_arrays(right[None], down[:, None]), np.ones((CONFIG.height, CONFIG.width))), axis=-1)
    assert (((normals * rays).sum(axis=-1))[~sky] < 0.0).all()
    points = rays * np.where(sky, 0.0, frame.depth.astype(np.float64))[..., None]
    flat = (normals[:, :-1] == normals[:, 1:]).all(axis=-1) & ~sky[:, :-1] & (frame.keys[:, :-1] == 0)
    step = points[:, 1:] - points[:, :-1]
    off = np.abs((step * normals[:, :-1]).sum(axis=-1)) / np.maximum(np.linalg.norm(step, axis=-1), 1e-9)
    assert (off[flat] < 0.02).mean() > 0.97  # neighbours of equal normals may lie on two levels


# --- Optical flow -----------------------------------------------------------------------------------------------------


def test_flow_leads_from_the_earlier_picture_to_this_one() -> None:
    engine = SessionEngine("brookside", config=EnvConfig(world=WorldConfig(vehicles=40, pedestrians=30)))
    engine.reset(seed=3)
    world = engine.session.world
    camera = SessionCamera(scene_of(engine.town, engine.scenario), CONFIG)
    moved = False
    for _ in range(12):
        world.step(20)
        before, earlier = EarlierWorld.of(world), camera.render(world)
        assert earlier.optical_flow is not None and not earlier.optical_flow.any()
        world.step(6)
        frame = camera.render(world, before)
        flow, points = frame.optical_flow, points_of(frame)
        assert flow is not None and frame.depth is not None
        rows, columns = np.indices(frame.depth.shape)
        placed = np.stack((columns + 0.5, rows + 0.5), axis=-1) - flow
        static = np.isfinite(frame.depth) & (frame.keys <= 0)
        where, depth = earlier.view.project(points[static])
        seen = depth > 0.05
        np.testing.assert_allclose(placed[static][seen], where[seen], atol=2e-3 + 1e-5 * np.abs(where[seen]).max())
        inside = static & (placed > 1.0).all(axis=-1) & (placed[..., 0] < 159.0) & (placed[..., 1] < 119.0)
        at = np.floor(placed[inside]).astype(int)
        assert (earlier.classes[at[:, 1], at[:, 0]] == frame.classes[inside]).mean() > 0.9
        for key in set(np.unique(frame.keys[frame.keys > 0]).tolist()) & set(np.unique(earlier.keys).tolist()):
            now, then = (np.argwhere(picture.keys == key)[:, ::-1] + 0.5 for picture in (frame, earlier))
            if min(len(now), len(then)) < 60 or now.min() < 3 or then.min() < 3 or now[:, 0].max() > 157:
                continue
            shift = flow[frame.keys == key].mean(axis=0)
            assert np.linalg.norm(now.mean(axis=0) - shift - then.mean(axis=0)) < 4.0
            moved |= bool(np.linalg.norm(shift) > 2.0)
    assert moved


# --- From above -------------------------------------------------------------------------------------------------------


def test_the_view_from_above_has_the_classes_of_the_picture(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    camera = SessionCamera(scene, CONFIG)
    agree: list[float] = []
    for lane in (3, 30, 60):
        place = world.town.lanes[lane]
        x, y = place.position(1.0).tolist()
        pose = pose_on_car(CONFIG.mount, x, y, place.height_at(1.0), place.heading_at(1.0))
        frame = camera.render_from(pose, world.actors.arrays, world.weather, time=world.time)
        assert frame.birds_eye is not None
        points = points_of(frame)[np.isin(frame.classes, FLAT_CLASSES)]
        classes = frame.classes[np.isin(frame.classes, FLAT_CLASSES)]
        ahead, aside = _along(points, pose)
        rows = np.floor(0.5 * CONFIG.height - ahead / CONFIG.metres_per_pixel).astype(int)
        columns = np.floor(0.5 * CONFIG.width + aside / CONFIG.metres_per_pixel).astype(int)
        inside = (rows >= 0) & (rows < CONFIG.height) & (columns >= 0) & (columns < CONFIG.width)
        assert inside.sum() > 1000
        agree.append(float((frame.birds_eye[rows[inside], columns[inside]] == classes[inside]).mean()))
    assert min(agree) > 0.9, agree  # lines are narrower than a square


def _along(points: NDArray[np.float64], pose: CameraPose) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    dx, dy = points[:, 0] - pose.x, points[:, 1] - pose.y
    c, s = math.cos(pose.heading), math.sin(pose.heading)
    return dx * c + dy * s, dy * c - dx * s


def test_bodies_are_seen_from_above_at_their_places(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    camera, found = SessionCamera(scene, CONFIG), 0
    for vehicle in world.actors.vehicles[:12]:
        x, y = vehicle.position.tolist()
        pose = CameraPose(x - 6.0, y, float(vehicle.height) + 1.5, 0.0)
        picture = camera.render_from(pose, world.actors.arrays, world.weather, time=world.time).birds_eye
        assert picture is not None
        row = round(0.5 * CONFIG.height - 6.0 / CONFIG.metres_per_pixel)
        found += picture[row, CONFIG.width // 2] == ObjectClass.VEHICLES.value
    assert found >= 8  # a cyclist is narrower than a square
