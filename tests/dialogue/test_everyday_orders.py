"""Everyday orders: moves to a side, counts of turns, places behind words of speed, relatives, and news."""

import pytest

from dorothie_gym.dialogue import guess_spans, understand
from dorothie_gym.dialogue.propositions import Predicate
from dorothie_gym.ontology import ActionValue, DialogueMove, GoalStatus, LandmarkName
from tests.dialogue.plan_steps import AT, IKEA, KFC, LIGHTS, PERSON, matches, planned, step

HOUSE = {"landmark": "House"}
LEFT, RIGHT = step("turn", direction="left"), step("turn", direction="right")


@pytest.mark.parametrize(
    ("text", "side"),
    [
        ("move left a little", "left"),
        ("could you shift right a bit?", "right"),
        ("edge over to the left a touch", "left"),
        ("drift to the right", "right"),
        ("keep left", "left"),
        ("keep a bit more to the left", "left"),
        ("a little to the right, please", "right"),
        ("go a little to the left", "left"),
        ("keep to the right here", "right"),
    ],
)
def test_move_to_a_side_is_a_change_of_lane(text: str, side: str) -> None:
    first = planned(text).to_json()[0]
    assert (first["action"], first["direction"]) == ("lane", side)
    assert guess_spans(text)[0].act.slots & set(ActionValue) == {ActionValue.LANE_SWITCH}


def test_stretch_on_a_side_ends_where_it_is_said_to() -> None:
    lane, ahead = planned("stay on the right until the lights").to_json()
    assert lane == {"action": "lane", "direction": "right"}
    assert ahead == {"action": "straight", "condition": {"relation": "until", "place": {"object": "TrafficLight"}}}


@pytest.mark.parametrize(
    "text", ["keep left at the fork", "bear right", "turn left a bit after the KFC", "go right just past the KFC"]
)
def test_turn_with_a_degree_stays_a_turn(text: str) -> None:
    assert [one["action"] for one in planned(text).to_json()] == ["turn"]


@pytest.mark.parametrize("text", ["keep right on going", "stay right where you are", "stop right here"])
def test_right_that_only_stresses_is_no_side(text: str) -> None:
    assert all("direction" not in one for one in planned(text).to_json())
    assert planned(text)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("two rights and we're there", [RIGHT, RIGHT]),
        ("three lefts and you're home", [LEFT, LEFT, LEFT]),
        ("a couple of lefts, then stop", [LEFT, LEFT, step("stop")]),
        ("a couple more rights and we're done", [RIGHT, RIGHT]),
        ("it's just a couple of lefts", [LEFT, LEFT]),
        ("turn left three times", [LEFT, LEFT, LEFT]),
        ("right twice", [RIGHT, RIGHT]),
        ("left, left again and we're there", [LEFT, LEFT]),
        ("two lefts after the KFC", [step("turn", "after", KFC, direction="left"), LEFT]),
        ("stay on this road for a couple of blocks", [step("straight", ordinal=2)]),
    ],
)
def test_counted_turns_are_steps(text: str, steps: list[dict[str, object]]) -> None:
    matches(text, *steps)
    act = guess_spans(text)[0].act
    assert act.move is DialogueMove.INSTRUCT
    assert not act.slots & {GoalStatus.COMPLETE, LandmarkName.HOUSE}


@pytest.mark.parametrize("text", ["is it two lefts?", "it was two lefts last time", "we made three rights already"])
def test_counted_turns_of_questions_and_reports_are_no_steps(text: str) -> None:
    assert not planned(text)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("take it down to Ikea", [step("visit", place=IKEA)]),
        ("bring it up to the lights", [step("straight", "until", LIGHTS)]),
        ("could you bring her up to the lights and go left", [step("straight", "until", LIGHTS), LEFT]),
        ("take it up to Murfin", [step("straight", "until", {"street": "Murfin"})]),
        ("drop down to the KFC", [step("visit", place=KFC)]),
        ("take it down to 20", [step("speed", speed=20, change="slower")]),
        ("bring it up to fifty", [step("speed", speed=50, change="faster")]),
        ("get it down to about thirty", [step("speed", speed=30, change="slower")]),
        ("take it down a notch", [step("speed", change="slower")]),
        ("drop it down to the limit", [step("speed", change="slower")]),
    ],
)
def test_words_of_speed_with_a_place_drive_there(text: str, steps: list[dict[str, object]]) -> None:
    matches(text, *steps)
    speeds = any(one["action"] == "speed" for one in steps)
    assert (ActionValue.SPEED_CHANGE in guess_spans(text)[0].act.slots) == speeds


@pytest.mark.parametrize(
    "text",
    [
        "we're getting Nana",
        "gotta grab my brother",
        "let's go get my wife",
        "time to get the kids",
        "we're off to get my boss",
        "need to scoop up my cousin",
        "swing by for my sister",
        "next we're fetching auntie Jo",
    ],
)
def test_relative_who_is_fetched_is_the_goal(text: str) -> None:
    matches(text, step("visit", place=PERSON))
    act = guess_spans(text)[0].act
    assert act.move is DialogueMove.INSTRUCT
    assert LandmarkName.PERSON in act.slots


@pytest.mark.parametrize(
    "text", ["we picked up Nana", "I'm getting hungry", "we're getting close", "let's get mum a present"]
)
def test_nobody_is_fetched(text: str) -> None:
    assert PERSON not in [one.get("place") for one in planned(text).to_json()]


def test_relative_at_a_place() -> None:
    matches("we're collecting my nephew from the KFC", step("visit", AT, KFC, place=PERSON))
    matches("get my sister home", step("visit", place=HOUSE))


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("the wedding's off, now home please", HOUSE),
        ("the wedding's off, home please", HOUSE),
        ("dinner got cancelled, so just home", HOUSE),
        ("I'm tired, home please", HOUSE),
        ("my sister called it off, now the KFC", KFC),
        ("we're done, now the Ikea please", IKEA),
    ],
)
def test_errand_behind_news_is_kept(text: str, place: dict[str, str]) -> None:
    matches(text, step("visit", place=place))
    assert guess_spans(text)[-1].act.move is DialogueMove.INSTRUCT


@pytest.mark.parametrize("text", ["it's next to the lights, the KFC", "he lives on Beal, the yellow house"])
def test_place_behind_where_it_is_orders_nothing(text: str) -> None:
    assert not planned(text)


@pytest.mark.parametrize(
    ("text", "predicate"),
    [
        ("so you see anything?", Predicate.VISIBILITY),
        ("do you see anything?", Predicate.VISIBILITY),
        ("due you see much?", Predicate.VISIBILITY),
        ("so you know where we are?", Predicate.LOCALISED),
        ("or we there yet?", Predicate.ARRIVED),
        ("his it raining?", Predicate.WEATHER),
        ("is the traffic bad today?", Predicate.CROWDED),
        ("what's the traffic like?", Predicate.CROWDED),
        ("heavy traffic?", Predicate.CROWDED),
        ("are the roads busy?", Predicate.CROWDED),
    ],
)
def test_question_is_read_without_its_first_word(text: str, predicate: Predicate) -> None:
    asked = understand(text).asked
    assert asked is not None
    assert asked.predicate is predicate
