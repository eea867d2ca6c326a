"""Small pictures that are kept: `python -m tests.pictures.camera.golden_images` draws them again after a wanted change.

The scenes depend on the towns and the camera only, not on the simulation: bodies and landmarks are placed by hand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dorothie_gym.maps import load_town
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology import LandmarkName, Sensor, WeatherParameter
from dorothie_gym.pictures.camera.pose import pose_on_car
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.session.config import CameraConfig
from dorothie_gym.sim.state.codes import Kind, Walk
from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.compilation.records import RecordArray, empty_records
from dorothie_gym.tasks import Landmark

FOLDER = Path(__file__).with_name("golden")
SIZE = CameraConfig(width=240, height=160)
_BRANDS = {9: LandmarkName.PANERA, 22: LandmarkName.IKEA, 19: LandmarkName.KFC, 21: LandmarkName.HOUSE}
"""Landmarks by sites of brookside."""


@dataclass(frozen=True, kw_only=True)
class GoldenImage:
    """A picture: a town, a place on a lane of it, and the weather by names of `WeatherParameter`."""

    town: str = "brookside"
    lane: int = 25
    station: float = 44.0
    time: float = 12.0
    weather: dict[str, float] = field(default_factory=dict)
    head_lights: bool = False
    faults: tuple[Sensor, ...] = ()


IMAGES = {
    "day": GoldenImage(weather={"sun_azimuth_angle": 300.0, "sun_altitude_angle": 40.0}),
    "dusk": GoldenImage(weather={"sun_altitude_angle": 4.5, "sun_azimuth_angle": 250.0}, head_lights=True),
    "night": GoldenImage(weather={"sun_altitude_angle": -30.0}, head_lights=True),
    "rain": GoldenImage(
        weather={"precipitation": 80.0, "cloudiness": 90.0, "wetness": 80.0, "precipitation_deposits": 60.0}
    ),
    "fog": GoldenImage(weather={"fog_density": 60.0, "cloudiness": 60.0}),
    "blur": GoldenImage(faults=(Sensor.BLUR,)),
    "view": GoldenImage(faults=(Sensor.VIEW,)),
    "tunnel": GoldenImage(town="midtown", lane=117, station=60.0),
}
"""Kept pictures by the names of their files."""


@dataclass(frozen=True)
class _Bodies:
    vehicles: RecordArray[VehicleRecord]
    pedestrians: RecordArray[PedestrianRecord]
    props: RecordArray[PropRecord]


def _bodies(town: Town, image: GoldenImage) -> _Bodies:
    """Returns a car that brakes and a cyclist ahead, an oncoming car, and a person on the pavement."""
    lane = town.lanes[image.lane]
    bodies = _Bodies(empty_records(VehicleRecord, 3), empty_records(PedestrianRecord, 1), empty_records(PropRecord, 0))
    places = (
        (bodies.vehicles[0], 11.0, 0.0, 0.0),
        (bodies.vehicles[1], 6.5, 1.3, 0.0),
        (bodies.vehicles[2], 9.0, -3.5, math.pi),
        (bodies.pedestrians[0], 8.0, 3.4, 0.4),
    )
    for key, (body, ahead, aside, turn) in enumerate(places):
        station = min(image.station + ahead, lane.length)
        body.x, body.y = lane.position(station, aside).tolist()
        body.heading = lane.heading_at(station) + turn
        body.cos, body.sin, body.height = math.cos(body.heading), math.sin(body.heading), lane.height_at(station)
        body.key, body.speed = key + 2, 1.2
    for row, (kind, acceleration) in enumerate(((Kind.CAR, -3.0), (Kind.CYCLIST, 0.0), (Kind.CAR, 0.0))):
        bodies.vehicles[row].kind, bodies.vehicles[row].acceleration = int(kind), acceleration
    bodies.pedestrians[0].state = int(Walk.WALKING)
    return bodies


def _landmarks(town: Town) -> list[Landmark]:
    sites = {site.id: site for site in town.sites}
    return [
        Landmark(
            index=k, name=name, label=name.value, category="", site=site, lane=sites[site].lane,
            station=sites[site].station, position=sites[site].position, waypoint=sites[site].waypoint, street=0,
            hidden=False,
        )
        for k, (site, name) in enumerate(_BRANDS.items())
    ]  # fmt: skip


def draw(image: GoldenImage) -> NDArray[np.uint8]:
    """Returns the picture (160, 240, 3)."""
    town = load_town(image.town)
    names = [street.name for street in town.streets]
    camera = SessionCamera(SessionScene(town_scene(town), names, _landmarks(town)), SIZE)
    weather = Weather()
    for name, value in image.weather.items():
        weather.set(WeatherParameter[name.upper()], value)
    lane = town.lanes[image.lane]
    x, y = lane.position(image.station).tolist()
    pose = pose_on_car(SIZE.mount, x, y, lane.height_at(image.station), lane.heading_at(image.station))
    picture = camera.render_from(
        pose, _bodies(town, image), weather, time=image.time, head_lights=image.head_lights, faults=image.faults
    ).rgb
    assert picture is not None
    return picture


def kept(name: str) -> NDArray[np.uint8]:
    """Returns a picture (160, 240, 3) as it was kept."""
    with Image.open(FOLDER / f"{name}.png") as picture:
        return np.asarray(picture.convert("RGB"))


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for file, image in IMAGES.items():
        Image.fromarray(draw(image)).save(FOLDER / f"{file}.png", optimize=True)
        print(FOLDER / f"{file}.png", (FOLDER / f"{file}.png").stat().st_size)
