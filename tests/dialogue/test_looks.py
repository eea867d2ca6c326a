"""Looks are stated by what distinguishes them, and read back from the words."""

from __future__ import annotations

import itertools

import pytest

from dorothie_gym.dialogue.looks import COLOURS, Appearance, distinguishing, read_look

GARDENS = ("tree", "hedge", "fence", "flowers", None)
HOUSES = [
    Appearance(facade=facade, storeys=storeys, roof=roof, garden=garden)
    for facade, storeys, roof, garden in itertools.product(("yellow", "blue"), (1, 2, 3), ("red", "black"), GARDENS)
]


@pytest.mark.parametrize("house", HOUSES)
def test_what_is_stated_tells_the_house_from_the_others(house: Appearance) -> None:
    others = [other for other in HOUSES if other != house and not (other.garden and house.garden is None)]
    stated = distinguishing(house, others)
    assert stated.fits(house)
    assert not any(stated.fits(other) for other in others)


def test_nothing_is_stated_that_rules_nobody_out() -> None:
    house = Appearance(facade="yellow", storeys=2, roof="red", frames="white")
    assert distinguishing(house, []) == Appearance(facade="yellow")
    assert distinguishing(house, [Appearance(facade="blue", storeys=2, roof="red")]) == Appearance(facade="yellow")
    same_colour = Appearance(facade="yellow", storeys=2, roof="black", frames="white")
    assert distinguishing(house, [same_colour]) == Appearance(facade="yellow", roof="red")


@pytest.mark.parametrize("house", HOUSES)
def test_words_are_read_as_they_are_meant(house: Appearance) -> None:
    assert read_look(f"it has {house.listed}") == house
    assert read_look(f"you want {house.house}") == house


@pytest.mark.parametrize("colour", COLOURS)
def test_clothes_are_read(colour: str) -> None:
    person = Appearance(coat=colour, trousers="gray")
    assert read_look(f"look out for somebody in {person.listed}") == person


@pytest.mark.parametrize(
    ("words", "look"),
    [
        ("the house is green", Appearance(facade="green")),
        ("it's the blue one", Appearance(facade="blue")),
        ("a grey two-story building with a tree in front", Appearance(facade="gray", storeys=2, garden="tree")),
        ("it has three floors and a white fence", Appearance(storeys=3, garden="fence")),
        ("the one with the hedge", Appearance(garden="hedge")),
        ("there are flowers in the front", Appearance(garden="flowers")),
        ("i bought her some flowers", Appearance()),
        ("turn left at the red light", Appearance()),
        ("the second house on the left", Appearance()),
        ("is he in the red jacket?", Appearance(coat="red")),
    ],
)
def test_other_words_for_looks(words: str, look: Appearance) -> None:
    assert read_look(words) == look


def test_later_words_correct_earlier_ones() -> None:
    assert Appearance(facade="green", storeys=1).joined(Appearance(facade="blue")) == Appearance(
        facade="blue", storeys=1
    )
    assert Appearance(facade="green").contradicts(Appearance(facade="blue", roof="red"))
    assert not Appearance(facade="green").contradicts(Appearance(roof="red"))
