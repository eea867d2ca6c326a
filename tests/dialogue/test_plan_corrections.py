"""Refused opportunities, doings that are to end, and corrections within an utterance, by kind."""

import pytest

from dorothie_gym.dialogue import guess_spans, understand
from dorothie_gym.ontology import ActionValue
from tests.dialogue.plan_steps import AT, IKEA, KFC, LIGHTS, SHELL, matches, planned, step


@pytest.mark.parametrize(
    ("text", "direction", "ordinal"),
    [
        ("don't go left here, go left at the one after", "left", 2),
        ("not the second right, the one after that", "right", 3),
        ("leave this right alone, I mean, not this right, the next", "right", 2),
        ("skip the next right and take the one after it", "right", 2),
        ("let the next turning go by and then take the next left", "left", 2),
        ("ignore this street, take the following one, on the right", "right", 2),
        ("there's a left coming up, skip that, take the one after that", "left", 2),
        ("take the right after next", "right", 2),
    ],
)
def test_the_next_opportunity_is_counted_from_the_refused_one(text, direction, ordinal):
    last = planned(text).steps[-1]
    assert (last.direction, last.ordinal) == (direction, ordinal), planned(text).describe()


def test_a_refused_turn_to_one_side_does_not_count_those_to_the_other():
    matches("not this left, the next right", step("turn", direction="right", ordinal=1))


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("stop crawling", [step("speed", change="faster")]),
        ("would you please stop racing", [step("speed", change="slower")]),
        ("stop braking all the time", [step("straight")]),
        ("stop nagging", []),
        ("stop, we're here", [step("stop")]),
        ("stop facing the Shell", [step("stop", "opposite", SHELL)]),
    ],
)
def test_stop_before_a_doing_ends_the_doing_and_not_the_drive(text, steps):
    matches(text, *steps)
    stops = ActionValue.STOP in understand(text).values
    assert stops is (bool(steps) and (steps[0]["action"] == "stop" or "braking" in text))


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("faster, oh sorry, slower", [step("speed", change="slower")]),
        ("first left, erm, second left", [step("turn", direction="left", ordinal=2)]),
        ("third right, I believe, yes, third right", [step("turn", direction="right", ordinal=3)]),
        ("use Beal, ah no, Beal is shut, use Fuller", [step("follow", place={"street": "Fuller"})]),
        ("not Beal, Fuller", [step("follow", place={"street": "Fuller"})]),
        ("we want the left turn up there, the second one", [step("turn", direction="left", ordinal=2)]),
        ("take the second one, left", [step("turn", direction="left", ordinal=2)]),
    ],
)
def test_what_is_said_last_counts(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        # a stretch and the stop at its end are one
        ("carry on to the lights and stop there", [step("stop", AT, LIGHTS)]),
        # numbers without their noun
        (
            "right at the first lights, left at the second",
            [
                step("turn", AT, {**LIGHTS, "ordinal": 1}, direction="right"),
                step("turn", AT, {**LIGHTS, "ordinal": 2}, direction="left"),
            ],
        ),
        # a place to look out for is that of the step
        ("watch out for the Ikea, we turn right there", [step("turn", AT, IKEA, direction="right")]),
        ("as soon as you're beyond the KFC slow down", [step("speed", "past", KFC, change="slower")]),
        # lanes and sides
        ("come over to the right when you can", [step("lane", direction="right")]),
        ("get out of this lane", [step("lane")]),
        ("let us out on the left, right beside the Shell", [step("stop", "beside", SHELL, side="left")]),
        # distances
        ("a quarter of a mile further on make a left", [step("turn", direction="left", distance=402)]),
        ("in one mile move to the right lane", [step("lane", direction="right", distance=1609)]),
        # pauses and hurry
        (
            "left at the KFC, then hang on, then right",
            [step("turn", AT, KFC, direction="left"), step("turn", direction="right")],
        ),
        ("left, quick quick", [step("turn", direction="left")]),
        # what has been done, and what comes next
        ("the KFC is done, next up is the Ikea", [step("visit", place=IKEA)]),
        ("that's the KFC finished now for the Ikea", [step("visit", place=IKEA)]),
        ("just go a bit lighter on the gas", [step("speed", change="slower")]),
    ],
)
def test_more_wordings_of_passengers(text, steps):
    matches(text, *steps)


def test_go_ahead_alone_sends_the_car_on():
    assert planned("okay, go ahead").steps[0].action == "go"
    assert planned("go ahead to the lights").steps[0].action != "go"


def test_an_errand_that_is_done_already_is_complete():
    (span,) = guess_spans("we have been to the Shell already, haven't we?")
    assert "Complete" in str(span.act)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("first right, no, second", [step("turn", direction="right", ordinal=2)]),
        ("past two streets, then at the third, right", [step("turn", direction="right", ordinal=3)]),
        ("the third, not the second", [step("turn", ordinal=3)]),
        ("don't turn before Beal, go right there", [step("turn", AT, {"street": "Beal"}, direction="right")]),
        ("if you see the Shell coming up, stop", [step("stop", "seen", SHELL)]),
        ("take the same way back", [step("follow", place={"reference": "way_we_came"})]),
        ("follow that white van", [step("follow", place={"object": "Vehicles"})]),
        ("it could be clever to slow down", [step("speed", change="slower")]),
        ("the Shell, right", [step("visit", place=SHELL)]),
    ],
)
def test_numbers_and_places_that_refer_to_what_was_said(text, steps):
    matches(text, *steps)
