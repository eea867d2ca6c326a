"""Landmarks are described as the camera draws them."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.tasks.landmark_designs import (
    STORES,
    colour_name,
    features_of,
    house_design,
    person_design,
    site_key,
)

NAMELESS = (LandmarkName.UNKNOWN, LandmarkName.QUERIED)
INDIVIDUAL = (LandmarkName.HOUSE, LandmarkName.PERSON)


@pytest.mark.parametrize("name", STORES, ids=str)
def test_every_brand_has_features_with_colours(name):
    features = features_of(name)
    assert features
    assert len(set(features)) == len(features)
    assert all(feature.isascii() and feature == feature.lower() for feature in features)


@pytest.mark.parametrize("name", [*NAMELESS, *INDIVIDUAL], ids=str)
def test_places_without_a_design_of_their_name_have_no_features(name):
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


def test_neighbours_differ_in_every_colour():
    for key in range(120):
        house, beside = house_design(key), house_design(key + 1)
        assert house.wall != beside.wall
        assert house.roof != beside.roof
        assert house.garden is not beside.garden
        assert house.storeys != beside.storeys
        person, next_one = person_design(key), person_design(key + 1)
        assert person.coat != next_one.coat
        assert person.trousers != next_one.trousers
        assert colour_name(house.wall) != colour_name(house.roof)


def test_two_of_sixty_houses_differ_in_two_of_colour_storeys_roof_and_garden():
    for first in (0, 31, 170):
        looks = [
            (colour_name(house.wall), house.storeys, colour_name(house.roof), house.garden)
            for house in map(house_design, range(first, first + 60))
        ]
        for one, other in itertools.combinations(looks, 2):
            assert sum(a != b for a, b in zip(one, other, strict=True)) >= 2


def test_designs_of_a_kind_are_equally_frequent():
    for attribute in ("wall", "roof", "storeys", "garden", "trim"):
        counts = Counter(getattr(house_design(key), attribute) for key in range(180))
        assert len(set(counts.values())) == 1
    assert len({(design.coat, design.trousers) for design in map(person_design, range(30))}) == 30


def test_towns_differ_in_the_designs_of_their_first_site():
    assert len({house_design(site_key(f"generated:{seed}", 0)).wall for seed in range(30)}) == 5
    assert site_key("midtown", 3) == site_key("midtown", 0) + 3
