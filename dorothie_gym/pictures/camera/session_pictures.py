"""Pictures of the cameras on the car of a session, for its observations and for spectators, and scans."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.range_sensors import CarState, Lidar, Radar
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import EarlierWorld, SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.providers import FIELDS, LIDAR_FIELDS, RADAR_FIELD, field_of
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.pictures.camera.first_person_camera import CameraFrame
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.sim.world import World

T = TypeVar("T")


def camera_of(town: Town, scenario: Scenario, config: CameraConfig) -> SessionCamera:
    """Returns a camera on the car of a session."""
    return SessionCamera(scene_of(town, scenario), config)


def scene_of(town: Town, scenario: Scenario) -> SessionScene:
    """Returns the scene of a session."""
    return SessionScene(town_scene(town), scenario.street_labels, scenario.storyboard.landmarks)


def windscreen_camera(town: Town, scenario: Scenario, config: EnvConfig, size: tuple[int, int]) -> SessionCamera:
    """Returns a spectators' camera of a width and height [px], otherwise like the session's camera."""
    own = config.camera or CameraConfig()
    return camera_of(town, scenario, replace(own, width=size[0], height=size[1], outputs=(CameraOutput.RGB,)))


class SessionPictures(CachedViews):
    """Pictures and scans of a session, each made at its first use from the world's state; copies make their own."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_scene", "_cameras", "_lidar", "_radar", "_taken")

    def __init__(self, world: World, scenario: Scenario, config: EnvConfig) -> None:
        self._world, self._scenario, self._config = world, scenario, config
        self._needs_before = any(CameraOutput.OPTICAL_FLOW in camera.outputs for camera in config.all_cameras.values())
        self._before: EarlierWorld | None = None

    @cached_property
    def _scene(self) -> SessionScene:
        return scene_of(self._world.town, self._scenario)

    @cached_property
    def _cameras(self) -> dict[str, SessionCamera]:
        return {name: SessionCamera(self._scene, config) for name, config in self._config.all_cameras.items()}

    @cached_property
    def _lidar(self) -> Lidar | None:
        return None if self._config.sensors.lidar is None else Lidar(self._scene, self._config.sensors.lidar)

    @cached_property
    def _radar(self) -> Radar | None:
        return None if self._config.sensors.radar is None else Radar(self._scene, self._config.sensors.radar)

    @cached_property
    def _taken(self) -> dict[str, tuple[int, Any]]:
        """Last picture of each camera, and last readings of each other sensor, with the numbers of their decisions."""
        return {}

    def begin_decision(self) -> None:
        """Notes the present, which optical flow is measured from, before the world is stepped."""
        if self._needs_before:
            self._before = EarlierWorld.of(self._world)

    def frame(self, decision: int, name: str = "") -> CameraFrame | None:
        """Returns the picture of a camera at the current decision, of this number; None for no such camera."""
        if name not in self._config.all_cameras:
            return None
        return self._read(f"camera {name}", decision, lambda: self._cameras[name].render(self._world, self._before))

    def readings(self, decision: int, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
        """Returns fields of observations at the current decision; callers must not write to them."""
        found: dict[str, NDArray[np.generic]] = {}
        for name, config in self._config.all_cameras.items():
            fields = {field_of(output, name): output for output in config.outputs if output in FIELDS}
            if any(field in names for field in fields):
                frame = self.frame(decision, name)
                found |= {field: getattr(frame, output.value) for field, output in fields.items() if field in names}
        if self._lidar is not None and any(field in names for field in LIDAR_FIELDS.values()):
            found |= self._read("lidar", decision, lambda: self._turn(decision))
        if self._radar is not None and RADAR_FIELD in names:
            found |= self._read("radar", decision, self._detect)
        return found

    def _read(self, sensor: str, decision: int, read: Callable[[], T]) -> T:
        """Returns the reading of a sensor at a decision, which is made once."""
        known = self._taken.get(sensor)
        if known is None or known[0] != decision:
            known = self._taken[sensor] = decision, read()
        reading: T = known[1]
        return reading

    def _turn(self, decision: int) -> dict[str, NDArray[np.generic]]:
        """Returns the fields of the turn of the lidar that ends at a decision."""
        lidar, world = self._lidar, self._world
        assert lidar is not None
        swept = lidar.config.rate / self._config.decision_frequency  # turns in a decision
        found = lidar.turn(
            car_state(world),
            world.actors.arrays,
            world.weather,
            faults=world.faults,
            sector=((decision - 1) * swept, decision * swept),
        )
        return {LIDAR_FIELDS[output]: getattr(found, output.value) for output in lidar.config.outputs}

    def _detect(self) -> dict[str, NDArray[np.generic]]:
        assert self._radar is not None
        world = self._world
        return {RADAR_FIELD: self._radar.detections(car_state(world), world.actors.arrays, world.weather)}


def car_state(world: World) -> CarState:
    """Returns the state of the car that its range sensors need."""
    car = world.car
    x, y = car.position.tolist()
    return CarState(x, y, float(car.height), float(car.heading), float(car.speed))
