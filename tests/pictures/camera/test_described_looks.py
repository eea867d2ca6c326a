"""What speakers say of the look of a place is what its pixels show, by day."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.dialogue.looks import COLOURS, Appearance
from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.ontology import LandmarkName, ObjectClass
from dorothie_gym.pictures.camera.pose import CameraPose
from dorothie_gym.pictures.camera.scene_cache import town_scene
from dorothie_gym.pictures.camera.scenery.landmarks import landmark_key
from dorothie_gym.pictures.camera.scenery.placing import feet_on
from dorothie_gym.pictures.camera.session_camera import SessionCamera
from dorothie_gym.pictures.camera.town_scene import SessionScene
from dorothie_gym.policies.place_looks import look_at
from dorothie_gym.session.config import CameraConfig, CameraOutput
from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
from dorothie_gym.sim.weather import Weather
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation.records import RecordArray, empty_records
from dorothie_gym.tasks.landmark_designs import STORES, colour_name, features_of
from dorothie_gym.tasks.storyboard import Landmark

OUTPUTS = (CameraOutput.RGB, CameraOutput.SEMANTIC, CameraOutput.INSTANCE)
TOWNS = [*town_names(), "generated:2"]
LEAST = {ObjectClass.BUILDING: 400, ObjectClass.PEDESTRIAN: 300}
"""Number of pixels below which a place is hidden by something."""

IN_SUN_AND_SHADE = {
    "black": {"black", "gray"},
    "white": {"white", "gray"},
    "brown": {"brown", "orange", "black"},
    "beige": {"beige", "brown", "white"},
    "red": {"red", "brown"},
    "blue": {"blue", "black"},
}
"""Names that a colour takes in the sun and in the shade."""


@dataclass
class Nobody:
    """A world without bodies."""

    vehicles: RecordArray[VehicleRecord]
    pedestrians: RecordArray[PedestrianRecord]
    props: RecordArray[PropRecord]


@cache
def nobody() -> Nobody:
    return Nobody(empty_records(VehicleRecord, 1), empty_records(PedestrianRecord, 1), empty_records(PropRecord, 1))


@dataclass(frozen=True)
class Shown:
    """What a picture of a place shows.

    Attributes:
        colours: number of its pixels by the everyday name of their colour, in the order of their number.
        look: its look as speakers know it; None for brands.
        name: name of the landmark.
    """

    colours: dict[str, int]
    look: Appearance | None
    name: LandmarkName

    def share(self, names: set[str]) -> float:
        return sum(self.colours.get(name, 0) for name in names) / sum(self.colours.values())


@cache
def shown_in(town: str, name: LandmarkName) -> list[Shown]:
    """Returns what pictures show of a landmark at each site of a town, if anything is in the way of less than half."""
    loaded = load_town(town)
    marks = [
        Landmark(
            index=k, name=name, label="", category="", site=site.id, lane=site.lane, station=site.station,
            position=site.position, waypoint=site.waypoint, street=0, hidden=False,
        )
        for k, site in enumerate(loaded.sites)
    ]  # fmt: skip
    kind = ObjectClass.PEDESTRIAN if name is LandmarkName.PERSON else ObjectClass.BUILDING
    scene = SessionScene(town_scene(loaded), (), marks)
    camera = SessionCamera(scene, CameraConfig(width=320, height=240, outputs=OUTPUTS))
    found = []
    for mark in marks:
        frame = camera.render_from(pose_before(scene, mark), nobody(), Weather(), time=0.0)
        classes = np.asarray(frame.semantic)
        mask = (np.asarray(frame.instance) == landmark_key(mark.index)) & (classes == kind.value)
        if mask.sum() < LEAST[kind]:
            continue
        rgb = np.asarray(frame.rgb)
        scenery = rgb[(classes != ObjectClass.SKY.value)].max(axis=1)
        look = look_at(loaded, name, *mark.position)
        found.append(Shown(named(rgb[mask], float(np.quantile(scenery, 0.98))), look, name))
    return found


def pose_before(scene: SessionScene, mark: Landmark) -> CameraPose:
    """Returns a pose in the street, which looks at a landmark."""
    lot = scene.town.lots[mark.site]
    if mark.name is LandmarkName.PERSON:
        x, y = np.array(lot.place) - 5.0 * np.array([pm.cos(lot.heading), pm.sin(lot.heading)])
    else:
        x, y = lot.at(-18.0, 0.0)
    ground = float(feet_on(scene.town.ground, np.array([lot.place]))[0])
    return CameraPose(float(x), float(y), ground + 1.6, lot.heading, 0.0)


def named(pixels: NDArray[np.uint8], white: float) -> dict[str, int]:
    """Returns how many colours (n, 3) have each everyday name, as an eye sees them to which `white` is white."""
    adapted = np.clip(pixels.astype(float) * (250.0 / max(white, 1.0)), 0, 255).astype(int)
    total: Counter[str] = Counter()
    for value, count in zip(*(each.tolist() for each in np.unique(adapted, axis=0, return_counts=True)), strict=True):
        total[colour_name(tuple(value))] += count
    return dict(total.most_common())


def dominant(shown: Shown) -> str:
    return next(iter(shown.colours))


@pytest.mark.long
@pytest.mark.parametrize("name", [LandmarkName.HOUSE, LandmarkName.PERSON], ids=str)
def test_the_dominant_colour_of_a_house_or_person_is_the_one_that_speakers_state(name: LandmarkName) -> None:
    places = [shown for town in TOWNS for shown in shown_in(town, name)]
    stated = [shown.look.facade or shown.look.coat for shown in places if shown.look is not None]
    assert len(places) == len(stated) > 100
    wrong = [(look, shown) for look, shown in zip(stated, places, strict=True) if look != dominant(shown)]
    assert len(wrong) <= 0.01 * len(places), wrong


@pytest.mark.long
def test_the_second_colour_is_there_too() -> None:
    """In sun or shade, the roof of a house and the trousers of a person."""
    for name in (LandmarkName.HOUSE, LandmarkName.PERSON):
        places = [shown for town in TOWNS for shown in shown_in(town, name)]
        seen = [shown.share(IN_SUN_AND_SHADE[shown.look.roof or shown.look.trousers]) for shown in places]
        assert np.mean(np.array(seen) > 0.04) > 0.95


@pytest.mark.long
def test_brands_have_the_colours_of_their_features() -> None:
    right = []
    for name in STORES:
        words = " ".join(features_of(name)).split()
        said = [colour for colour in COLOURS if colour in words]
        for shown in shown_in("midtown", name):
            seen = [shown.share(IN_SUN_AND_SHADE.get(colour, {colour})) > 0.02 for colour in said]
            right.append(np.mean(seen) >= 0.5)
    assert len(right) > 150
    assert np.mean(right) > 0.95
