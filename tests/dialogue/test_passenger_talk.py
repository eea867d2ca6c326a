"""Forms of orders, greetings and remarks of passengers, by the rules alone."""

from __future__ import annotations

import pytest

from dorothie_gym.dialogue import understand
from dorothie_gym.dialogue.dialogue_act_classifier import rule_spans
from dorothie_gym.ontology import DialogueMove, ObjectClass

M = DialogueMove


@pytest.mark.parametrize(
    ("text", "plan"),
    [
        ("go around this garbage truck", "change lanes"),
        ("get around these cones", "change lanes"),
        ("can we overtake him on the left", "change to the left lane"),
        ("lane change, left, now", "change to the left lane"),
        ("hug the right side", "change to the right lane"),
        ("get back in the left lane after the van", "change to the left lane after that car"),
        ("this would be my stop", "stop here"),
        ("I'm good right here, thanks", "stop here"),
        ("close enough", "stop"),
        ("over there by the fence is where I want out", "stop next to the fence"),
        ("are you able to let us down at the bridge", "stop at the bridge"),
        ("right side's better for the pram", "stop on the right-hand side"),
        ("pull up by the mailbox", "stop next to the obstacle"),
        ("I told you right", "turn right"),
        ("kill the brights", "switch the lights off"),
        ("shall we turn left here", "turn left here"),
        ("and where the wall ends, turn left", "turn left at the wall"),
        ("it wouldn't hurt you to put the lights on", "switch the lights on"),
    ],
)
def test_what_a_passenger_asks_for_is_planned(text: str, plan: str) -> None:
    assert understand(text).plan.describe() == plan
    assert rule_spans(text)[0].act.move is M.INSTRUCT


@pytest.mark.parametrize(
    ("before", "text", "move"),
    [
        ("", "good evening, driver", M.IRRELEVANT),
        ("", "hey, how's it going", M.IRRELEVANT),
        ("There's a jam ahead.", "ugh, okay", M.ACKNOWLEDGE),
        ("The road is closed.", "oh no, alright then", M.ACKNOWLEDGE),
        ("We're coming up on Broadway.", "yeah so go left on Broadway", M.INSTRUCT),
        ("Turn onto Hubbard.", "onto where?", M.CONFUSE),
        ("", "used to be a lovely shop there where the KFC is now", M.EXPLAIN),
        ("", "right, that's the shopping done at Ikea", M.EXPLAIN),
        ("Are you all right?", "yes, but the sun is in my eyes", M.REPLY_Y),
        ("", "shall we go to the Ikea?", M.QUERY_YN),
    ],
)
def test_first_move(before: str, text: str, move: DialogueMove) -> None:
    after = rule_spans(before)[-1].act.move if before else None
    assert rule_spans(text, after)[0].act.move is move


@pytest.mark.parametrize(
    ("text", "objects"),
    [
        ("you're too close to the car in front", {ObjectClass.VEHICLES}),
        ("the car behind us is honking", {ObjectClass.VEHICLES}),
        ("the car is dirty", set()),
        ("stop short of the hydrant", {ObjectClass.STATIC}),
        ("I've got the walker with me", set()),
        ("why have we stopped, is something wrong", set()),
    ],
)
def test_things_that_are_spoken_of(text: str, objects: set[ObjectClass]) -> None:
    assert {value for span in rule_spans(text) for value in span.act.slots if isinstance(value, ObjectClass)} == objects


def test_an_order_that_is_told_again_is_planned_again() -> None:
    after = rule_spans("Could you repeat that?")[-1].act.move
    for text in ("I said make a left at the light", "I told you to turn left at the light"):
        assert understand(text).plan.describe() == "turn left at the traffic light"
        assert rule_spans(text, after)[0].act.move is M.CLARIFY


def test_marks_that_stand_alone_lose_no_words() -> None:
    for text in ("hold on , wait now", "no , left at the light please", "stop here . thanks !", "um ... left"):
        assert " ".join(span.text for span in rule_spans(text)) == text


def test_right_now_is_no_turn() -> None:
    assert not understand("how fast are you going right now").turns
