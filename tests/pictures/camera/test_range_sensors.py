"""Lidar and radar measure the scene that the pictures show."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.ontology import ObjectClass, Sensor, WeatherParameter
from dorothie_gym.pictures.camera.pose import CameraPose, axes_of, pose_on_car
from dorothie_gym.pictures.camera.range_sensors import CarState, Lidar, Radar, RangeSensor
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.session_pictures import car_state
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.session.sensor_config import LidarConfig, RadarConfig, SensorMount
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.sensing.visibility import CLARITY
from dorothie_gym.sim.weather import Weather
from dorothie_gym.sim.world import World
from dorothie_gym.support.compilation.records import plain

# the centre of the middle pixel lies on the axis
ONE_RAY = CameraConfig(
    width=9, height=9, field_of_view=10.0, outputs=(CameraOutput.DEPTH, CameraOutput.SEMANTIC, CameraOutput.INSTANCE)
)


def on_lane(world: World, lane: int, speed: float = 0.0) -> CarState:
    place = world.town.lanes[lane]
    station = 0.5 * place.length
    x, y = place.position(station).tolist()
    return CarState(x, y, place.height_at(station), place.heading_at(station), speed)


MOUNTS = (SensorMount(), SensorMount(forward=1.2, right=-0.4, up=2.0, pitch=-5.0, yaw=70.0, roll=8.0))


@pytest.mark.parametrize("mount", MOUNTS, ids=["level", "turned"])
def test_lidar_and_depth_pictures_agree_on_every_ray(
    mount: SensorMount, engine: SessionEngine, scene: SessionScene
) -> None:
    world, rng = engine.session.world, np.random.default_rng(0)
    config = LidarConfig(channels=24, columns=500, mount=mount)
    lidar, camera = Lidar(scene, config), SessionCamera(scene, ONE_RAY)
    altitudes = np.radians(np.linspace(config.lower_fov, config.upper_fov, config.channels))
    kinds: set[int] = set()
    compared = 0
    for lane in (3, 30, 60):
        car = on_lane(world, lane)
        turn = lidar.turn(car, world.actors.arrays, world.weather)
        tilt = camera.pose_on(car.x, car.y, car.height, car.heading).tilt
        pose = pose_on_car(mount, car.x, car.y, car.height, car.heading, math.tan(tilt))
        right, up, ahead = axes_of(pose.heading, pose.pitch, pose.roll)
        for _ in range(60):
            row, column = int(rng.integers(config.channels)), int(rng.integers(config.columns))
            azimuth = 2.0 * math.pi * column / config.columns
            level = math.cos(azimuth) * ahead + math.sin(azimuth) * right
            ray = math.cos(altitudes[row]) * level + math.sin(altitudes[row]) * up
            look = CameraPose(pose.x, pose.y, pose.z, math.atan2(ray[1], ray[0]), math.asin(ray[2]))
            frame = camera.render_from(look, world.actors.arrays, world.weather, time=world.time)
            assert frame.depth is not None
            depth, point = float(frame.depth[4, 4]), turn.points[row, column].astype(np.float64)
            if depth > config.range - 0.01:
                assert not point.any() or depth < config.range + 0.01
                continue
            assert np.linalg.norm(point[:3]) == pytest.approx(depth, abs=2e-3)
            found = point[0] * ahead + point[1] * right + point[2] * up
            np.testing.assert_allclose(found, depth * ray, atol=2e-3 + 1e-4 * depth)
            assert turn.semantic[row, column] == frame.classes[4, 4]
            assert turn.instance[row, column] == frame.keys[4, 4]
            kinds.add(int(frame.classes[4, 4]))
            compared += 1
    assert compared > 120 and len(kinds) >= 3


def test_closed_ground_leaves_no_gaps_and_bodies_are_hit(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    lidar = Lidar(scene, LidarConfig(upper_fov=-12.0, lower_fov=-30.0, columns=1440))
    found: set[int] = set()
    for lane in range(0, 80, 8):
        turn = lidar.turn(on_lane(world, lane), world.actors.arrays, world.weather)
        assert (turn.points[..., 3] == 1.0).all()
        found |= set(np.unique(turn.instance).tolist())
    assert len([key for key in found if key > 0]) > 2


def test_a_scan_does_not_depend_on_earlier_ones(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    one, other = Lidar(scene, LidarConfig()), Lidar(scene, LidarConfig())
    for lane in (3, 40):
        one.turn(on_lane(world, lane), world.actors.arrays, world.weather)
    car = car_state(world)
    for part, expected in zip(
        *(lidar.turn(car, world.actors.arrays, world.weather) for lidar in (one, other)), strict=True
    ):
        np.testing.assert_array_equal(part, expected)


def test_fog_and_faults_shorten_the_range(engine: SessionEngine, scene: SessionScene) -> None:
    world, fog = engine.session.world, Weather()
    fog.set(WeatherParameter.FOG_DENSITY, 60.0)
    lidar, car = Lidar(scene, LidarConfig()), on_lane(world, 30)

    def farthest(weather: Weather, *faults: Sensor) -> float:
        turn = lidar.turn(car, world.actors.arrays, weather, faults=faults)
        distance = np.linalg.norm(turn.points[..., :3], axis=-1)
        lost = turn.points[..., 3] == 0.0
        assert not distance[lost].any() and not turn.semantic[lost].any() and not turn.instance[lost].any()
        return float(distance.max())

    clear = farthest(world.weather)
    assert clear > 60.0
    assert farthest(fog) < 0.7 * clear
    assert farthest(world.weather, Sensor.BLUR) <= lidar.config.range * math.sqrt(CLARITY[Sensor.BLUR]) < clear
    assert farthest(world.weather, Sensor.VIEW) == 0.0
    assert farthest(world.weather, Sensor.GPS) == clear


def test_slow_lidars_give_the_sector_that_was_swept(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    lidar, car = Lidar(scene, LidarConfig(columns=360)), on_lane(world, 30)
    whole = lidar.turn(car, world.actors.arrays, world.weather).points
    parts = [
        lidar.turn(car, world.actors.arrays, world.weather, sector=(k / 3.0, (k + 1) / 3.0)).points for k in (4, 5, 6)
    ]
    np.testing.assert_array_equal(sum(parts), whole)
    assert not parts[0][:, :120].any() and parts[0][:, 120:240].any()


def test_radar_measures_range_direction_and_relative_speed(engine: SessionEngine, scene: SessionScene) -> None:
    world = engine.session.world
    place = next(lane for lane in world.town.lanes if not lane.in_junction and lane.length > 60.0)
    x, y = place.position(20.0).tolist()
    heading = place.heading_at(20.0)
    arrays = world.actors.arrays.copy()
    other = plain(arrays.vehicles)[1]
    other["x"], other["y"] = x + 15.0 * math.cos(heading), y + 15.0 * math.sin(heading)
    other["heading"], other["cos"], other["sin"] = heading, math.cos(heading), math.sin(heading)
    other["speed"], other["height"] = 9.0, place.height_at(20.0)
    radar = Radar(scene, RadarConfig())
    detections = radar.detections(CarState(x, y, place.height_at(20.0), heading, 5.0), arrays, world.weather)
    ahead = detections[(detections[:, 0] > 0.0) & (np.abs(detections[:, 1]) < 0.02)]
    body = ahead[ahead[:, 3] > 0.0]
    assert len(body) and body[:, 3] == pytest.approx(4.0, abs=0.05)  # it drives away
    assert (body[:, 0] > 9.0).all() and (body[:, 0] < 14.0).all()
    road = detections[(detections[:, 0] > 0.0) & (detections[:, 2] < 0.0)]
    still = road[road[:, 3] < 0.0]  # the road comes nearer by the speed of the car
    expected = -5.0 * np.cos(still[:, 1]) * np.cos(still[:, 2])
    assert (np.abs(still[:, 3] - expected) < 0.05).mean() > 0.95  # the others see other bodies
    first = int((detections[:, 0] > 0.0).sum())
    assert detections.shape == (8 * 64, 4) and not detections[first:].any()


def test_ranges_of_all_rows_are_those_of_the_scan(engine: SessionEngine, scene: SessionScene) -> None:
    world, config = engine.session.world, RadarConfig(rows=1, columns=1, vertical_fov=0.0)
    radar = Radar(scene, config)
    wide = RangeSensor(scene, config.mount, Radar(scene, replace(config, columns=3)).grid)
    car = car_state(world)
    detection = radar.detections(car, world.actors.arrays, world.weather)[0]
    middle = wide.scan(car, world.actors.arrays, world.weather).points[0, 1, 3]
    assert detection[0] == pytest.approx(middle, rel=1e-6)
    assert ObjectClass(int(wide.scan(car, world.actors.arrays, world.weather).semantic[0, 1]))
