"""Houses and people are described as the camera draws them, and by what tells them apart."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from dorothie_gym.dialogue.looks import COLOURS
from dorothie_gym.maps.catalogue import load_town, town_names
from dorothie_gym.ontology import LandmarkName, ObjectClass, StreetName
from dorothie_gym.pictures.camera.scenery.landmarks import landmark_form
from dorothie_gym.pictures.camera.scenery.lots import Lot
from dorothie_gym.pictures.camera.scenery.placing import FlatGround
from dorothie_gym.policies.observation_parser import SeenLandmark
from dorothie_gym.policies.place_looks import distinguishing_look, look_at, look_of
from dorothie_gym.tasks.landmark_designs import colour_name, house_design, site_key

PARTS = ("facade", "storeys", "roof", "garden")
KINDS = (LandmarkName.HOUSE, LandmarkName.PERSON)


def marks(town, name: LandmarkName) -> list[SeenLandmark]:
    return [
        SeenLandmark(
            row=row,
            name=name,
            x=site.position[0],
            y=site.position[1],
            lane=site.lane,
            station=site.station,
            street=StreetName.UNKNOWN,
        )
        for row, site in enumerate(town.sites)
    ]


@pytest.mark.parametrize("name", KINDS, ids=str)
@pytest.mark.parametrize("town", town_names())
def test_no_two_sites_of_a_town_look_alike(town: str, name: LandmarkName) -> None:
    loaded = load_town(town)
    looks = [look_of(loaded, mark) for mark in marks(loaded, name)]
    assert None not in looks
    assert all(one != other for one, other in itertools.combinations(looks, 2))


@pytest.mark.parametrize("name", KINDS, ids=str)
def test_descriptions_tell_one_from_all_others(name: LandmarkName) -> None:
    town = load_town("brookside")
    every = marks(town, name)
    for mark in every:
        said = distinguishing_look(town, mark, every)
        assert said is not None
        assert [other.row for other in every if said.fits(look_of(town, other))] == [mark.row]


@pytest.mark.parametrize("name", KINDS, ids=str)
def test_the_camera_draws_what_is_said(name: LandmarkName) -> None:
    town = load_town("brookside")
    for site in town.sites:
        look = look_at(town, name, *site.position)
        key = site_key(town.name, site.id)
        form = landmark_form(name, Lot(site.id, site.position, 0.0, site.position, 20.0, 15.0, key), FlatGround())
        drawn = {colour_name(tuple(colour)) for colour in np.unique(form.colours.reshape(-1, 3), axis=0).tolist()}
        assert {value for value in look.stated.values() if value in COLOURS} <= drawn
        if name is LandmarkName.HOUSE:
            walls = form.corners[(form.colours == house_design(key).wall).all(axis=1)]
            assert 3.0 * look.storeys < float(walls[..., 2].max()) < 3.0 * look.storeys + 6.0
            classes = set(form.classes.tolist())
            assert (ObjectClass.FENCE.value in classes) is (look.garden == "fence")
            assert (ObjectClass.VEGETATION.value in classes) is (look.garden != "fence")


def test_two_houses_of_a_street_differ_in_two_of_colour_storeys_roof_and_garden() -> None:
    alike = count = 0
    for name in (*town_names(), *(f"generated:{seed}" for seed in (3, 11, 19))):
        town = load_town(name)
        streets = [town.lanes[site.lane].street for site in town.sites]
        looks = [look_at(town, LandmarkName.HOUSE, *site.position) for site in town.sites]
        for k, i in itertools.combinations(range(len(looks)), 2):
            if streets[k] == streets[i]:
                one, other = looks[k], looks[i]
                differing = sum(getattr(one, part) != getattr(other, part) for part in PARTS)
                alike, count = alike + (differing < 2), count + 1
    assert count > 100
    assert alike <= 0.05 * count


def test_brands_and_other_places_have_no_individual_look() -> None:
    town = load_town("brookside")
    x, y = town.sites[0].position
    assert look_at(town, LandmarkName.KFC, x, y) is None
    assert look_at(town, LandmarkName.HOUSE, x + 50.0, y + 50.0) is None
