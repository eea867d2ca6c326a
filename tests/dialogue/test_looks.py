"""Looks are stated by what distinguishes them, and read back from the words."""

from __future__ import annotations

import itertools

import pytest

from dorothie_gym.dialogue.looks import COLOURS, Look, distinguishing, read_look

HOUSES = [
    Look(facade=facade, storeys=storeys, roof=roof, tree=tree)
    for facade, storeys, roof, tree in itertools.product(("yellow", "blue"), (1, 2), ("red", "black"), (True, None))
]


@pytest.mark.parametrize("house", HOUSES)
def test_what_is_stated_tells_the_house_from_the_others(house: Look) -> None:
    others = [other for other in HOUSES if other != house and not (other.tree and house.tree is None)]
    stated = distinguishing(house, others)
    assert stated.fits(house)
    assert not any(stated.fits(other) for other in others)


def test_nothing_is_stated_that_rules_nobody_out() -> None:
    house = Look(facade="yellow", storeys=2, roof="red", frames="white")
    assert distinguishing(house, []) == Look(facade="yellow")
    assert distinguishing(house, [Look(facade="blue", storeys=2, roof="red")]) == Look(facade="yellow")
    same_colour = Look(facade="yellow", storeys=2, roof="black", frames="white")
    assert distinguishing(house, [same_colour]) == Look(facade="yellow", roof="red")


@pytest.mark.parametrize("house", HOUSES)
def test_words_are_read_as_they_are_meant(house: Look) -> None:
    assert read_look(f"it has {house.listed}") == house
    assert read_look(f"you want {house.house}") == house


@pytest.mark.parametrize("colour", COLOURS)
def test_clothes_are_read(colour: str) -> None:
    person = Look(coat=colour, trousers="gray")
    assert read_look(f"look out for somebody in {person.listed}") == person


@pytest.mark.parametrize(
    ("words", "look"),
    [
        ("the house is green", Look(facade="green")),
        ("it's the blue one", Look(facade="blue")),
        ("a grey two-story building with a tree in front", Look(facade="gray", storeys=2, tree=True)),
        ("turn left at the red light", Look()),
        ("the second house on the left", Look()),
        ("is he in the red jacket?", Look(coat="red")),
    ],
)
def test_other_words_for_looks(words: str, look: Look) -> None:
    assert read_look(words) == look


def test_later_words_correct_earlier_ones() -> None:
    assert Look(facade="green", storeys=1).joined(Look(facade="blue")) == Look(facade="blue", storeys=1)
    assert Look(facade="green").contradicts(Look(facade="blue", roof="red"))
    assert not Look(facade="green").contradicts(Look(roof="red"))
