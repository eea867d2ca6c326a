"""Errands, other vehicles and manners of driving: kinds of wordings and the steps that they order."""

import pytest

from dorothie_gym.dialogue import guess_spans, understand
from dorothie_gym.ontology import GoalStatus, LandmarkName, ObjectClass
from tests.dialogue.plan_steps import IKEA, KFC, LIGHTS, PERSON, SHELL, matches, planned, step

COCO, PANERA, HOUSE = {"landmark": "Coco"}, {"landmark": "Panera"}, {"landmark": "House"}
VEHICLE, BEAL = {"object": "Vehicles"}, {"street": "Beal"}


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("take us home by way of the Panera", [PANERA, HOUSE]),
        ("the list for now is the Shell, then Ikea, then home", [SHELL, IKEA, HOUSE]),
        ("first stop is the KFC, second call the Coco", [KFC, COCO]),
        ("I need the Coco and after the KFC", [COCO, KFC]),
        ("can we squeeze in a quick KFC run", [KFC]),
        ("I could use a coffee from the Shell", [SHELL]),
        ("collect the next customer first, then head to the Coco", [PERSON, COCO]),
        ("could we collect our nanny first and do the Shell afterwards", [PERSON, SHELL]),
        ("pick up my sister and then we're both going to the Ikea", [PERSON, IKEA]),
        ("take me to the Shell, no, not the Shell, the KFC", [KFC]),
        ("just go on home, please", [HOUSE]),
    ],
)
def test_errands_are_ordered_as_they_are_meant(text, places):
    matches(text, *(step("visit", place=place) for place in places))


@pytest.mark.parametrize("text", ["let's take the KFC off the list", "let us abandon the KFC"])
def test_errands_are_given_up(text):
    assert not planned(text).steps
    assert GoalStatus.ABANDONED in guess_spans(text)[0].act.slots


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("overtake that tractor", [step("lane", "past", VEHICLE)]),
        ("can we get past this lorry", [step("lane", "past", VEHICLE)]),
        ("overtake that tractor on the left", [step("lane", direction="left")]),
        ("stay behind it", [step("follow", place=VEHICLE)]),
        ("give that bike more room", [step("avoid", place=VEHICLE)]),
        ("not so close to the wall", [step("avoid", place={"object": "Wall"})]),
        ("leave a bit more space behind that lorry", [step("speed", change="slower")]),
        ("stay in lane", [step("straight")]),
    ],
)
def test_other_vehicles_are_passed_followed_or_given_room(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("I don't suppose you could drive a bit slower", [step("speed", change="slower")]),
        ("a rather brisker pace would be welcome", [step("speed", change="faster")]),
        ("a little less quickly, please", [step("speed", change="slower")]),
        ("do twenty, er, twenty five", [step("speed", speed=25)]),
        ("thirty kilometres in one hour", [step("speed", speed=30)]),
        ("bring her up to forty kilometres an hour", [step("speed", speed=40, change="faster")]),
        ("lights", [step("lights", change="on")]),
        ("park by the pole, hazards on", [step("stop", "beside", {"object": "Pole"}), step("lights", change="on")]),
        ("the headlights might be useful in this fog", [step("lights", change="on")]),
        ("the traffic lights on Beal are broken again", []),
        ("no Beal today, please", [step("avoid", place=BEAL)]),
        ("not that exit, the one after", [step("turn", ordinal=2)]),
    ],
)
def test_manners_of_driving(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("turn left at the Shell, left at the Shell", [step("turn", "at", SHELL, direction="left")]),
        ("right at the lights ... yeah, right", [step("turn", "at", LIGHTS, direction="right")]),
        ("it's like a left and a right", [step("turn", direction="left"), step("turn", direction="right")]),
        ("cut left after the Ikea", [step("turn", "after", IKEA, direction="left")]),
        ("cancel the Coco, go right to my house", [step("visit", place=HOUSE)]),
    ],
)
def test_turns_are_counted_once_and_right_may_mean_directly(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("there's a willow by the road", ObjectClass.VEGETATION),
        ("we just passed the theater", ObjectClass.BUILDING),
        ("is that a post box ahead?", ObjectClass.STATIC),
        ("a tow truck is in front of us", ObjectClass.VEHICLES),
        ("what a big old oak", ObjectClass.VEGETATION),
    ],
)
def test_names_of_things_in_the_street(text, value):
    assert value in understand(text).values


@pytest.mark.parametrize("text", ["well done", "no harm done", "she's dropped her bear", "see you later"])
def test_phrases_that_say_nothing_of_errands(text):
    assert not understand(text).statuses
    assert not any(
        isinstance(value, LandmarkName | ObjectClass) for value in understand("just wait while I post this").values
    )
