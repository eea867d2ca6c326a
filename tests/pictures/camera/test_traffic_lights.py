"""Each lane with a light sees its own light from its stop line, and small pictures show its state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.catalogue import town_names
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology import WeatherParameter
from dorothie_gym.pictures.camera.body_snapshots import BodySnapshot
from dorothie_gym.pictures.camera.pose import CameraPose
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.scenery.lenses import lit_lenses
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.pictures.maps.markings import stop_stations
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support.compilation.records import empty_records
from tests.maps.opendrive_text import shared_map

EYE_BACK = 2.0
"""Distance from the eye of the first driver to the stop line [m]."""

LEAST = 6
"""Pixels of its own light that a lane must see."""

CHANGED = 24
"""Difference of a pixel, 0..255, that counts."""

NOBODY = BodySnapshot(empty_records(VehicleRecord, 0), empty_records(PedestrianRecord, 0), empty_records(PropRecord, 0))


@dataclass(frozen=True, eq=False)
class Stage:
    """A town with the signals of its lanes."""

    town: Town
    scene: SessionScene
    signals: dict[int, list[int]]
    stops: dict[int, float]

    def camera(self, width: int, height: int, *outputs: CameraOutput) -> SessionCamera:
        return SessionCamera(
            self.scene, CameraConfig(width=width, height=height, outputs=outputs or (CameraOutput.RGB,))
        )

    def pose(self, camera: SessionCamera, lane_id: int, back: float) -> CameraPose:
        lane = self.town.lanes[lane_id]
        station = max(0.0, self.stops.get(lane_id, lane.length) - back)
        x, y = lane.position(station).tolist()
        return camera.pose_on(x, y, lane.height_at(station), lane.heading_at(station))

    def picture(
        self, camera: SessionCamera, lane: int, back: float, colour: LightColour, sky: Weather, *, lights: bool = False
    ) -> NDArray[np.uint8]:
        """Returns a picture in which the lane's own lights have a colour, and all others are red."""
        states = {number: LightColour.RED for numbers in self.signals.values() for number in numbers}
        states |= dict.fromkeys(self.signals[lane], colour)
        frame = camera.render_from(
            self.pose(camera, lane, back), NOBODY, sky, time=0.0, head_lights=lights, traffic_lights=states
        )
        return frame.colours


@cache
def stage_of(name: str) -> Stage:
    town = load_town(name)
    ruled = {number for programme in town.programmes for number in programme.signals}
    signals: dict[int, list[int]] = {}
    for signal in town.signals:
        if signal.kind is SignalKind.TRAFFIC_LIGHT and signal.id in ruled:
            for lane in signal.lanes:
                if not town.lanes[lane].in_junction:
                    signals.setdefault(lane, []).append(signal.id)
    return Stage(town, SessionScene(town_scene(town)), signals, stop_stations(town))


def night() -> Weather:
    sky = Weather()
    sky.set(WeatherParameter.SUN_ALTITUDE_ANGLE, -30.0)
    return sky


def lanes_that_see_too_little(stage: Stage) -> Iterator[tuple[int, int, str, int]]:
    for width, height in ((480, 270), (240, 160)):
        camera = stage.camera(width, height)
        for time, sky, lights in (("noon", Weather(), False), ("night", night(), True)):
            for lane in stage.signals:
                red, green = (
                    stage.picture(camera, lane, EYE_BACK, colour, sky, lights=lights).astype(np.int64)
                    for colour in (LightColour.RED, LightColour.GREEN)
                )
                pixels = int((np.abs(red - green).max(axis=2) >= CHANGED).sum())
                if pixels < LEAST:
                    yield lane, width, time, pixels


@pytest.mark.long
@pytest.mark.parametrize("name", ["midtown", pytest.param("generated:2", marks=pytest.mark.slow)])
def test_each_lane_sees_its_own_light_from_its_stop_line(name: str) -> None:
    stage = stage_of(name)
    assert len(stage.signals) > 20
    assert list(lanes_that_see_too_little(stage)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", [*town_names(), *(f"generated:{seed}" for seed in range(40, 60))])
def test_lanes_of_many_towns_see_their_own_lights(name: str) -> None:
    assert list(lanes_that_see_too_little(stage_of(name))) == []


@pytest.mark.slow
@pytest.mark.parametrize(("name", "lights"), [("Town02", ""), ("Town05", ",lights=default")])
def test_lanes_of_imported_towns_see_their_own_lights(name: str, lights: str) -> None:
    stage = stage_of(f"{shared_map(name)}{lights}")
    assert stage.signals
    assert list(lanes_that_see_too_little(stage)) == []


def around_own_light(stage: Stage, camera: SessionCamera, lane: int, picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Returns the 9 by 9 pixels around the light of a lane that is nearest to its stop line."""
    lenses = stage.scene.town.lenses
    places = lit_lenses(lenses, stage.scene.town.signals).centres
    own = np.isin(lenses.signals, stage.signals[lane])
    pixels, depths = camera.camera.view_of(stage.pose(camera, lane, 30.0)).project(places[own])
    column, row = np.floor(pixels[np.argmin(np.where(depths > 5.0, depths, np.inf))]).astype(int).tolist()
    padded = np.pad(picture, ((4, 4), (4, 4), (0, 0)), mode="edge")
    return padded[row : row + 9, column : column + 9].astype(np.float64).ravel() / 255.0


@pytest.mark.long
def test_the_state_of_a_light_at_30_metres_is_read_from_84_by_84_pixels() -> None:
    """A linear probe that is trained on half of the lanes reads the state on the others."""
    samples: list[tuple[int, NDArray[np.float64], float]] = []
    number = 0
    for name in ("midtown", "generated:2"):
        stage = stage_of(name)
        camera = stage.camera(84, 84)
        for lane in stage.signals:
            if stage.stops.get(lane, 0.0) < 30.0:
                continue
            number += 1
            for colour, label in ((LightColour.RED, -1.0), (LightColour.GREEN, 1.0)):
                picture = stage.picture(camera, lane, 30.0, colour, Weather())
                samples.append((number, around_own_light(stage, camera, lane, picture), label))
    assert number > 60
    lanes, features, labels = (np.array(column) for column in zip(*samples, strict=True))
    features = np.column_stack((features, np.ones(len(features))))
    trained = lanes % 2 == 0
    known = features[trained]
    weights = np.linalg.solve(known.T @ known + np.eye(known.shape[1]), known.T @ labels[trained])
    assert np.mean(np.sign(features[~trained] @ weights) == labels[~trained]) >= 0.95
