from collections import Counter

import numpy as np
import pytest

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.tasks import StoryboardError
from dorothie_gym.tasks.casting import cast

from .builders import parse, plain


def variables(*categories):
    return [[f"V{k}", category] for k, category in enumerate(categories)]


def cast_of(*categories, seed=0, dependents=(), subgoals=({}, {})):
    fields = plain(*subgoals, variables=variables(*categories), dependents=list(dependents))
    return cast(parse(fields), np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(30))
def test_a_wide_category_leaves_what_a_narrow_one_needs(seed):
    parts = cast_of("places", "places.cafe", "places.stores", seed=seed, subgoals=({"destination": "House"}, {}))
    assert parts["$V1"] is LandmarkName.COCO
    assert len(set(parts.values())) == len(parts)


def test_every_kind_that_fits_is_drawn():
    drawn = Counter(
        cast_of("places.restaurants", seed=seed, subgoals=({"destination": "Coco"}, {}))["$V0"] for seed in range(200)
    )
    assert sorted(name.label for name in drawn if name is not LandmarkName.KFC) == ["BurgerKing", "Panera", "Qdoba"]
    assert min(drawn.values()) > 25


def test_houses_and_people_are_repeated():
    parts = cast_of(*["places.residential"] * 3, *["people"] * 2)
    assert Counter(parts.values())[LandmarkName.HOUSE] == 3
    assert Counter(parts.values())[LandmarkName.PERSON] == 2


def test_a_landmark_named_outright_is_not_given_to_a_variable():
    for seed in range(20):
        parts = cast_of("places.stores", subgoals=({"destination": "Ikea"}, {}), seed=seed)
        assert parts["$V0"] is LandmarkName.SEVEN_ELEVEN


def test_a_dependent_narrows_a_wide_category_to_what_has_the_attribute():
    for seed in range(20):
        parts = cast_of("places", seed=seed, dependents=[["A", "V0.actions"]], subgoals=({"destination": "KFC"}, {}))
        assert parts["$V0"].label in ("Ikea", "SevenEleven")  # Shell is named outright


REFUSED = {
    "more names than landmarks": (
        {"variables": variables(*["places.stores"] * 3)},
        r"variables: there are not enough different landmarks for V0 .places.stores.*besides KFC, Shell",
    ),
    "named and wanted": ({"variables": variables("places.gasstation")}, "variables: there are not enough"),
    "attribute that none has": (
        {"variables": variables("places.residential"), "dependents": [["I", "V0.items"]]},
        r"dependents\.I: no landmark of 'places.residential' has the attribute 'items'; it has: none",
    ),
    "other attribute": (
        {"variables": variables("places.cafe"), "dependents": [["I", "V0.items"]]},
        r"dependents\.I: no landmark of 'places.cafe' has the attribute 'items'; it has: menuitems",
    ),
    "too few values": (
        {"variables": variables("places.cafe"), "dependents": [[f"I{k}", "V0.menuitems"] for k in range(6)]},
        r"dependents\.I0: 6 different V0.menuitems are asked for, but there are 5; ask for fewer",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_the_catalogue_cannot_serve_is_refused(case):
    fields, message = REFUSED[case]
    with pytest.raises(StoryboardError, match="^storyboard test: " + message):
        parse(plain({}, {}, **fields))
