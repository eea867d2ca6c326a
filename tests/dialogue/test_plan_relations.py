"""Relations and references: what the car waits for, where a stretch ends, and places of the drive so far."""

import pytest

from dorothie_gym.dialogue import guess_spans
from dorothie_gym.ontology import ActionValue, Slot
from tests.dialogue.plan_steps import AT, BRIDGE, IKEA, KFC, LIGHTS, SHELL, matches, step

VEHICLE, PEOPLE, TREES = {"object": "Vehicles"}, {"object": "Pedestrian"}, {"object": "Vegetation"}
BUILDING, STATIC = {"object": "Building"}, {"object": "Static"}
BEAL, FULLER, MURFIN = {"street": "Beal"}, {"street": "Fuller"}, {"street": "Murfin"}
WAY, START, LAST_STOP = {"reference": "way_we_came"}, {"reference": "start"}, {"reference": "last_stop"}
THERE = {"reference": "there"}


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("hold on until that lorry is past, then drive", [step("wait", "until", VEHICLE), step("go")]),
        ("wait till those kids have finished crossing", [step("wait", "until", PEOPLE)]),
        ("wait for the cyclist to get by", [step("wait", "until", VEHICLE)]),
        ("wait for the lights to change", [step("wait", "until", LIGHTS)]),
        ("let that taxi go past first", [step("wait", "until", VEHICLE)]),
        ("don't set off before the tram has passed", [step("wait", "until", VEHICLE)]),
        ("don't move until all these people are across", [step("wait", "until", PEOPLE)]),
    ],
)
def test_the_car_waits_until_something_has_gone(text, steps):
    matches(text, *steps)


def test_a_forbidden_start_is_named_as_a_start():
    (span,) = guess_spans("don't pull away until the lorry has gone")
    assert span.act.values(Slot.ACTION) == (ActionValue.START,)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("up to the Shell and turn left", [step("straight", "until", SHELL), step("turn", direction="left")]),
        ("as far as the bridge, then right", [step("straight", "until", BRIDGE), step("turn", direction="right")]),
        (
            "Beal down to Fuller, left",
            [step("follow", "until", FULLER, place=BEAL), step("turn", direction="left")],
        ),
        ("Murfin to the end, then right", [step("follow", place=MURFIN), step("turn", direction="right")]),
        (
            "you go along Beal, right past the Ikea, and then it's a left",
            [step("follow", "past", IKEA, place=BEAL), step("turn", direction="left")],
        ),
        (
            "carry on past the Shell and take the right after",
            [step("straight", "past", SHELL), step("turn", "after", SHELL, direction="right")],
        ),
        ("in ninety feet take the street on the left", [step("turn", direction="left", distance=27)]),
        ("get over to the left after the van", [step("lane", "after", VEHICLE, direction="left")]),
    ],
)
def test_a_stretch_ends_at_its_place(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("park where you parked last time", [step("stop", AT, LAST_STOP)]),
        ("drop me at the same place as before", [step("stop", AT, LAST_STOP)]),
        ("take me back to the previous pickup", [step("visit", place=LAST_STOP)]),
        ("back to where we dropped the old man off", [step("visit", place=LAST_STOP)]),
        ("take me back to where I got in", [step("visit", place=START)]),
        ("back to where you fetched me", [step("visit", place=START)]),
        ("same road back, please", [step("follow", place=WAY)]),
        ("bring us back along the route we took coming here", [step("follow", place=WAY)]),
        ("go home the way we came", [step("follow", place=WAY), step("visit", place={"landmark": "House"})]),
    ],
)
def test_places_of_the_drive_so_far(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("stop there, beside the bench", [step("stop", "beside", STATIC)]),
        ("don't stop here, over there by the bench", [step("stop", "beside", STATIC)]),
        ("let me off by the willow", [step("stop", "beside", TREES)]),
        ("pull in level with the postbox", [step("stop", "beside", STATIC)]),
        ("stop here, no, not here, down there", [step("stop", AT, THERE)]),
        ("next to the fence, please", [step("stop", "beside", {"object": "Fence"})]),
        ("hold the car there", [step("wait", AT, THERE)]),
        ("turn right by the theater", [step("turn", AT, BUILDING, direction="right")]),
    ],
)
def test_a_stop_is_beside_the_place_that_says_most(text, steps):
    matches(text, *steps)


def test_another_vehicle_is_what_a_stop_comes_before_or_behind():
    matches("stop before that bus", step("stop", "before", VEHICLE))
    matches("where is the KFC? by the trees")
    matches("do the KFC before that", step("visit", place=KFC))
