"""Landmarks are described as the camera draws them."""

from __future__ import annotations

import pytest

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.tasks.landmark_designs import HOUSE, STORES, colour_name, features_of

NAMELESS = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)


@pytest.mark.parametrize("name", [name for name in LandmarkName if name not in NAMELESS], ids=str)
def test_every_landmark_has_features_with_colours(name):
    features = features_of(name)
    assert features
    assert len(set(features)) == len(features)
    assert all(feature.isascii() and feature == feature.lower() for feature in features)


@pytest.mark.parametrize("name", NAMELESS, ids=str)
def test_places_without_a_building_have_no_features(name):
    assert features_of(name) == ()


@pytest.mark.parametrize(
    ("colour", "name"),
    [
        ((196, 16, 40), "red"), ((0, 78, 158), "blue"), ((240, 238, 234), "white"), ((112, 56, 28), "brown"),
        ((250, 216, 30), "yellow"), ((246, 150, 36), "orange"), ((0, 126, 84), "green"), ((8, 8, 8), "black"),
        ((128, 128, 128), "gray"), ((232, 218, 186), "beige"), ((46, 178, 184), "turquoise"), ((112, 26, 78), "purple"),
    ],
)  # fmt: skip
def test_colours_have_everyday_names(colour, name):
    assert colour_name(colour) == name


def test_brands_differ_in_what_they_look_like():
    assert len({features_of(name) for name in STORES}) == len(STORES)
    assert colour_name(HOUSE.roof) in " ".join(features_of(LandmarkName.HOUSE))
