"""Compilation of the camera ahead of its use, see `session.warm_up`."""

from __future__ import annotations

from typing import Final

from dorothie_gym.ontology.world_exceptions import Sensor, WeatherParameter
from dorothie_gym.pictures.camera.labels import write_labels
from dorothie_gym.pictures.camera.range_sensors import Lidar
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import EarlierWorld, SessionCamera
from dorothie_gym.pictures.camera.session_pictures import car_state
from dorothie_gym.pictures.camera.shading import shade
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.sensor_config import LidarConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.warm_up import TOWN, Progress, reporting
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.compilation.dispatcher import CompiledFunction

RARE: Final = CameraOutput.OPTICAL_FLOW, CameraOutput.NORMALS, CameraOutput.BIRDS_EYE
"""Outputs that no command draws: videos, frames for vision models and perception by the camera do without."""


def is_warm() -> bool:
    """Returns whether pictures need no compilation."""
    stages = shade, write_labels
    return all(not isinstance(stage, CompiledFunction) or stage.is_cached() for stage in stages)


def warm_up(progress: Progress | None = None, *, rare: bool = True) -> None:
    """Compiles the functions of pictures, and caches one town's scene.

    Args:
        progress: as in `session.warm_up.warm_up`.
        rare: whether to compile also the outputs `RARE`, lidar and radar.
    """
    with reporting(progress):
        engine = SessionEngine(TOWN, config=EnvConfig(world=WorldConfig(vehicles=3, pedestrians=3)))
        engine.reset(seed=0)
        world, rain = engine.session.world, Weather()
        rain.set(WeatherParameter.PRECIPITATION, 80.0)
        scene = SessionScene(town_scene(world.town), landmarks=engine.session.task.storyboard.landmarks)
        outputs = tuple(output for output in CameraOutput if rare or output not in RARE)
        camera = SessionCamera(scene, CameraConfig(width=16, height=16, outputs=outputs))
        camera.render(world)
        x, y = world.car.position.tolist()
        pose = camera.pose_on(x, y, float(world.car.height), 0.0)
        camera.render_from(pose, world.actors.arrays, rain, time=0.0, head_lights=True, faults=(Sensor.BLUR,))
        if not rare:
            return
        camera.render(world, EarlierWorld.of(world))
        Lidar(scene, LidarConfig(channels=2, columns=8)).turn(car_state(world), world.actors.arrays, world.weather)
