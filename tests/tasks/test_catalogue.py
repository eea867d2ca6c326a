import pytest

from dorothie_gym.ontology import LandmarkName
from dorothie_gym.tasks.catalogue import LandmarkKind, catalogue, find_kind, kinds_in

CATEGORIES = {
    "BurgerKing": ("places.restaurants", {"menuitems"}),
    "KFC": ("places.restaurants", {"menuitems"}),
    "Panera": ("places.restaurants", {"menuitems"}),
    "Qdoba": ("places.restaurants", {"menuitems"}),
    "Coco": ("places.cafe", {"menuitems"}),
    "Ikea": ("places.stores", {"items", "actions"}),
    "SevenEleven": ("places.stores", {"items", "actions"}),
    "Shell": ("places.gasstation", {"items", "actions"}),
    "House": ("places.residential", set()),
    "Person": ("people", set()),
}


def test_every_landmark_has_the_category_and_attributes_of_the_specification():
    found = {kind.name.label: (kind.category, set(kind.attributes)) for kind in catalogue().values()}
    assert found == CATEGORIES


def test_kinds_come_in_the_order_of_the_ontology():
    assert [name.value for name in catalogue()] == list(range(1, 11))


def test_places_matches_everything_but_people():
    assert {kind.name for kind in kinds_in("places")} == set(catalogue()) - {LandmarkName.PERSON}


def test_only_houses_and_people_may_be_repeated():
    assert {kind.name.label for kind in catalogue().values() if kind.repeatable} == {"House", "Person"}


def test_no_value_belongs_to_two_landmarks():
    values = [value for kind in catalogue().values() for row in kind.attributes.values() for value in row]
    assert len(values) == len(set(values))


@pytest.mark.parametrize("spelling", ["SevenEleven", "Seven Eleven", "seveneleven"])
def test_landmarks_are_found_in_any_spelling(spelling):
    kind = find_kind(spelling)
    assert kind is not None and kind.name is LandmarkName.SEVEN_ELEVEN


@pytest.mark.parametrize("text", ["Unknown", "Queried", "hospital"])
def test_unknown_landmarks_are_not_found(text):
    assert find_kind(text) is None


def test_duplicate_value_raises_error():
    with pytest.raises(ValueError, match=r"KFC.menuitems"):
        LandmarkKind(
            name=LandmarkName.KFC,
            category="c",
            label="KFC",
            noun="KFC",
            repeatable=False,
            attributes={"menuitems": ("a", "a")},
        )
