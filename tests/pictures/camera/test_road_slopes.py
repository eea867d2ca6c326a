"""Bodies stand on the ground: vehicles tilted on slopes, people on kerbs, also where there are tunnels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.pictures.camera.ground.lookup import material_at
from dorothie_gym.pictures.camera.ground.materials import KERB_HEIGHT, LOOKS, Material, Relief
from dorothie_gym.pictures.camera.pose import CameraPose
from dorothie_gym.pictures.camera.road_slopes import rise_at, road_slopes
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.support.compilation.records import plain


@pytest.mark.parametrize("name", ["midtown", "northgate"])
def test_the_rise_is_that_of_the_lane(name: str) -> None:
    town = load_town(name)
    slopes = road_slopes(town)
    rng, steep = np.random.default_rng(0), 0
    lengths = np.array([lane.length for lane in town.lanes])
    for number in rng.choice(len(lengths), 800, p=lengths / lengths.sum()).tolist():
        lane = town.lanes[number]
        if lane.length < 8.0:
            continue
        station = float(rng.uniform(3.0, lane.length - 3.0))
        x, y = lane.position(station, float(rng.uniform(-1.0, 1.0))).tolist()
        heading = lane.heading_at(station)
        expected = (lane.height_at(station + 1.3) - lane.height_at(station - 1.3)) / 2.6
        for sign in (1.0, -1.0):  # also for who drives the other way
            way = sign * math.cos(heading), sign * math.sin(heading)
            assert rise_at(slopes, x, y, lane.height_at(station), *way) == pytest.approx(sign * expected, abs=0.03)
        steep += abs(expected) > 0.03
    assert steep > 3
    assert rise_at(slopes, 1e5, -1e5, 0.0, 1.0, 0.0) == 0.0


def test_level_towns_have_no_slopes() -> None:
    slopes = road_slopes(load_town("brookside"))
    assert len(slopes.places) == 0
    assert rise_at(slopes, 0.0, 0.0, 0.0, 1.0, 0.0) == 0.0


@pytest.mark.long
def test_the_camera_is_fixed_to_a_car_on_a_slope() -> None:
    town = load_town("northgate")
    camera = SessionCamera(SessionScene(town_scene(town)), CameraConfig(width=16, height=16))
    mount = camera.config.mount
    lane = max(town.lanes, key=lambda row: abs(row.points[-1, 2] - row.points[0, 2]))
    stations = np.arange(2.0, lane.length - 2.0, 0.5)
    poses = []
    for station in stations.tolist():
        x, y = lane.position(station).tolist()
        poses.append(camera.pose_on(x, y, lane.height_at(station), lane.heading_at(station)))
    rises = np.array([(lane.height_at(s + 1.3) - lane.height_at(s - 1.3)) / 2.6 for s in stations.tolist()])
    pitches = np.array([pose.pitch for pose in poses])
    assert np.abs(rises).max() > 0.04
    assert np.quantile(np.abs(pitches - math.radians(mount.pitch) - np.arctan(rises)), 0.95) < 0.01
    assert np.abs(np.diff(pitches)).max() < 0.015  # without steps
    # the way from the road below the middle of the car to the camera keeps its length
    feet = np.array([(*lane.position(s).tolist(), lane.height_at(s)) for s in stations.tolist()])
    away = np.array([(pose.x, pose.y, pose.z) for pose in poses]) - feet
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), math.hypot(mount.forward, mount.up), rtol=1e-9)


def test_people_walk_on_top_of_the_pavements_of_a_town_with_a_tunnel() -> None:
    engine = SessionEngine("midtown", config=EnvConfig(world=WorldConfig(vehicles=20, pedestrians=60)))
    engine.reset(seed=2)
    world = engine.session.world
    world.step(60)
    scene = town_scene(world.town)
    camera = SessionCamera(SessionScene(scene), CameraConfig(width=16, height=16))
    x, y = world.car.position.tolist()
    placed = plain(camera.placed(CameraPose(x, y, 1.4, 0.0), world.actors.arrays, world.weather))
    heights = {walker.key: walker.height for walker in world.actors.pedestrians}
    lifted = 0
    for body in placed[np.isin(placed["key"], list(heights))]:
        kind = Material(material_at(scene.ground.arrays, 0, float(body["x"]), float(body["y"])))
        raised = LOOKS[kind].relief in (Relief.RAISED, Relief.SLOPE)
        assert body["z"] - heights[int(body["key"])] == pytest.approx(KERB_HEIGHT if raised else 0.0)
        lifted += raised
    assert lifted > 5
