"""Wordings of passengers, by kind: each orders the steps that it means."""

import pytest

from dorothie_gym.dialogue import guess_spans
from dorothie_gym.ontology import DialogueMove
from tests.dialogue.plan_steps import AT, BRIDGE, IKEA, KFC, PERSON, SHELL, matches, planned, step

BEAL, FULLER = {"street": "Beal"}, {"street": "Fuller"}


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        # a street is followed up to a place
        ("take Beal down to the bridge", [step("follow", "until", BRIDGE, place=BEAL)]),
        ("straight on Beal until the Shell", [step("follow", "until", SHELL, place=BEAL)]),
        ("go along Beal all the way up to Fuller", [step("follow", "until", FULLER, place=BEAL)]),
        ("keep going down Beal to where it meets Fuller", [step("follow", "until", FULLER, place=BEAL)]),
        ("straight past the KFC", [step("straight", "past", KFC)]),
        # a place that is told is that of the step
        ("you'll see a Shell, that's where you go left", [step("turn", AT, SHELL, direction="left")]),
        ("there's a Shell coming up, turn right just before it", [step("turn", "before", SHELL, direction="right")]),
        ("once you're off the bridge it's a left", [step("turn", "after", BRIDGE, direction="left")]),
        # lanes and sides
        ("get into the lane on your right", [step("lane", direction="right")]),
        ("Change lanes. The left one.", [step("lane", direction="left")]),
        ("out of the right lane and into the left one", [step("lane", direction="left")]),
        ("go into the left lane, then turn left", [step("lane", direction="left"), step("turn", direction="left")]),
        ("stop to the left", [step("stop", side="left")]),
        ("let us out by the right-hand kerb", [step("stop", side="right")]),
        # waiting
        ("don't move until the bridge is clear", [step("wait", "until", BRIDGE)]),
        ("don't set off yet", [step("wait")]),
        # negation and comparison
        ("don't turn into Beal", [step("avoid", place=BEAL)]),
        ("Beal is quicker, take that", [step("follow", place=BEAL)]),
        ("no faster than thirty kilometres an hour", [step("speed", speed=30)]),
        ("twenty kilometres an hour is plenty", [step("speed", speed=20)]),
        ("the limit is forty, stick to it", [step("speed", speed=40)]),
        # people and errands
        ("pick my aunt up at the KFC", [step("visit", AT, KFC, place={"landmark": "Person"})]),
        (
            "I need to do the KFC but not till we've been to the Ikea",
            [step("visit", place=IKEA), step("visit", place=KFC)],
        ),
        ("leave the KFC for last, the Ikea first", [step("visit", place=IKEA), step("visit", place=KFC)]),
        # repairs
        ("go to the KFC, hang on, make that the Ikea", [step("visit", place=IKEA)]),
        ("Left! left left", [step("turn", direction="left")]),
        # indirect
        ("it might be wiser to slow down", [step("speed", change="slower")]),
        ("we'd be grateful to be dropped at the KFC", [step("stop", AT, KFC)]),
        ("this is me, thanks", [step("stop", AT, {"reference": "here"})]),
        ("turn around whenever you get a chance", [step("u_turn")]),
        ("I was kinda hoping you'd drive to the Ikea", [step("visit", place=IKEA)]),
        ("you wouldn't happen to be heading to the KFC?", [step("visit", place=KFC)]),
        ("it's high time we slowed down", [step("speed", change="slower")]),
        # one errand, said twice or with its street behind
        ("I have to pick up Anna, so take me to our passenger Anna on Beal", [step("visit", place={**PERSON, **BEAL})]),
        ("head to my friend on Beal. I have to pick her up.", [step("visit", place={**PERSON, **BEAL})]),
        ("take me to the house um Beal", [step("visit", place={"landmark": "House", **BEAL})]),
        ("the house on Beal, uh no, Fuller", [step("visit", place={"landmark": "House", "street": "Fuller"})]),
        # a place named before
        ("the KFC on Beal, go there", [step("visit", place={**KFC, **BEAL})]),
        ("there's the KFC, on Beal, go there", [step("visit", place={**KFC, **BEAL})]),
    ],
)
def test_wordings_of_passengers(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("we need the Ikea, but first the KFC", ["KFC", "Ikea"]),
        ("take me to the Shell, but before that to the Panera", ["Panera", "Shell"]),
        ("drive to the Ikea once we've been to the Shell", ["Shell", "Ikea"]),
        ("Drive to the Ikea. Once we've been to the Shell, drive to the KFC.", ["Ikea", "Shell", "KFC"]),
    ],
)
def test_errands_told_in_reverse_are_put_in_order(text, names):
    assert [each.place.landmark.label for each in planned(text).steps] == names


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("turn right, three blocks, then left", ["right", 3, "left"]),
        ("another block and then right", [1, "right"]),
        ("it is four blocks to the lake", []),
    ],
)
def test_blocks_between_turns_are_driven_straight(text, steps):
    said = [each.direction.value if each.direction else each.ordinal for each in planned(text).steps]
    assert said == steps


def test_a_turn_behind_a_change_of_lane_is_no_side_of_the_lane():
    matches("get into the left lane, take the left", step("lane", direction="left"), step("turn", direction="left"))
    matches("the left lane, the left", step("lane", direction="left"))


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("we want the right-hand kerb by the Shell", [step("stop", "beside", SHELL, side="right")]),
        ("I wouldn't go near Fuller today", [step("avoid", place={"street": "Fuller"})]),
        ("is it necessary to drive so quickly?", [step("speed", change="slower")]),
        ("this is where we leave you", [step("stop", AT, {"reference": "here"})]),
    ],
)
def test_wishes_and_refusals_order_what_they_mean(text, steps):
    matches(text, *steps)
    assert guess_spans(text)[0].act.move is DialogueMove.INSTRUCT


def test_a_reminder_of_an_errand_is_no_end_of_it():
    (span,) = guess_spans("don't forget the Ikea")
    assert "Abandoned" not in str(span.act)
    matches("don't forget the Ikea", step("visit", place=IKEA))
    assert "Abandoned" in str(guess_spans("forget the Ikea")[0].act)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("I feel ill stop the car", [step("stop")]),
        ("not over forty k please", [step("speed", speed=40)]),
        ("draw up on the right by the trees", [step("stop", "beside", {"object": "Vegetation"}, side="right")]),
        ("left at the following junction", [step("turn", direction="left", ordinal=1)]),
        ("hold it, stop", [step("stop")]),
        ("hang on, it's the second right", [step("turn", direction="right", ordinal=2)]),
        ("I'd keep on Beal if I were you", [step("follow", place={"street": "Beal"})]),
        ("your lights are off, you know", [step("lights", change="on")]),
        ("my back doesn't like this speed", [step("speed", change="slower")]),
        ("we'll never get there at this pace", [step("speed", change="faster")]),
    ],
)
def test_run_on_speech_and_hints_order_what_they_mean(text, steps):
    matches(text, *steps)
