"""Orders in forms that differ in words only."""

from __future__ import annotations

import itertools

import pytest

from dorothie_gym.dialogue import guess_spans, understand
from dorothie_gym.dialogue.turn_phrases import plain_orders
from dorothie_gym.ontology import DialogueMove
from tests.dialogue.plan_steps import matches, step

BISHOP = {"street": "Bishop"}
VERBS = ("take", "make", "hang", "do", "hit", "pull", "grab", "bang", "hook", "catch", "throw", "give me", "hang us")
MANNERS = ("", "quick ", "easy ", "gentle ", "nice ", "little ", "immediate ")
WAYS = ("on", "onto", "into", "down", "up", "along", "at")


@pytest.mark.parametrize("verb", VERBS)
def test_a_turn_into_a_street_is_one_step_in_any_words(verb):
    for manner, noun, way in itertools.product(MANNERS, ("", " turn"), WAYS):
        said = f"{verb} a {manner}right{noun} {way} Bishop"
        matches(said, step("turn", direction="right", condition={"relation": "at", "place": BISHOP}))
        (span,) = guess_spans(said)
        assert span.act.move is DialogueMove.INSTRUCT, said
        assert {value.label for value in span.act.slots} == {"JTurn", "Bishop"}, said


@pytest.mark.parametrize("verb", ["do", "hang", "take", "give us"])
def test_a_counted_turn_keeps_its_number(verb):
    matches(f"{verb} the second easy left down Bishop", step(
        "turn", direction="left", ordinal=2, condition={"relation": "at", "place": BISHOP}
    ))  # fmt: skip


@pytest.mark.parametrize(
    "said",
    [
        "get in the nice left lane",
        "do the right thing",
        "pull over on the right-hand side",
        "there's a house right here",
    ],
)
def test_other_senses_of_left_and_right_stay(said):
    assert plain_orders(said.split()) == said.split()


@pytest.mark.parametrize("rest", ["turn left", "get in the left lane", "slow down", "pull over"])
def test_right_before_a_place_of_another_order_is_directly(rest):
    assert understand(f"right after the Shell, {rest}").plan == understand(f"after the Shell, {rest}").plan


def test_right_after_a_place_alone_is_a_turn():
    matches("right after the Shell", step(
        "turn", direction="right", condition={"relation": "after", "place": {"landmark": "Shell"}}
    ))  # fmt: skip


ORDERS = (
    "turn right", "hang a left at the lights", "follow Hubbard", "slow down a bit", "get in the left lane",
    "turn around", "take me to the KFC", "wait for that truck to move", "stay on Murfin until the lights",
)  # fmt: skip


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(
    "frame",
    [
        "why don't you {}", "your best bet is to {}", "do you think you could {}", "let's {}", "we're going to {}",
        "my dear boy, {}", "{}, my good man", "what do you say we {}", "it'd be great if you could {}",
    ],
)  # fmt: skip
def test_frames_of_requests_change_no_step(frame, order):
    assert understand(order).plan.steps
    assert understand(frame.format(order)).plan == understand(order).plan


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("I'd rather you took Beal", "take Beal"),
        ("I'd appreciate it if you slowed down a bit", "slow down a bit"),
        ("it'd be good if you just stopped here", "stop here"),
        ("by the Shell, turn left", "turn left at the Shell"),
        ("after three hundred feet turn left", "in three hundred feet turn left"),
        ("turn left and after that stop by the KFC", "turn left, then stop by the KFC"),
        ("pick up Tom and after that it's the Coco", "pick up Tom, then the Coco"),
        ("go straight for two blocks after that turn left", "go straight for two blocks then turn left"),
        ("go straight through two junctions", "go straight two blocks"),
    ],
)
def test_forms_of_one_order(said, plain):
    assert understand(plain).plan.steps
    assert understand(said).plan == understand(plain).plan


@pytest.mark.parametrize("said", ["the Ikea shuts at eight", "do you know how to get to Upland"])
def test_what_is_told_or_asked_orders_nothing(said):
    assert not understand(said).plan.steps
    assert guess_spans(said)[0].act.move in (DialogueMove.EXPLAIN, DialogueMove.QUERY_YN)


@pytest.mark.parametrize("order", ["stop by the Shell", "drop in at the Shell"])
def test_an_errand_on_the_way_to_another_is_an_order(order):
    said = f"{order} on the way to the KFC"
    assert guess_spans(said)[0].act.move is DialogueMove.INSTRUCT
    first, second = understand(said).plan.steps
    assert first == understand(order).plan.steps[0]
    assert second == understand("take me to the KFC").plan.steps[0]
