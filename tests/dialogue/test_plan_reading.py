import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import AsrChannel, DrivingPlan, guess_spans, understand
from dorothie_gym.dialogue.route_grammar import PhraseIndex, route_grammar
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName
from tests.dialogue.plan_steps import AT, BRIDGE, IKEA, KFC, LIGHTS, SHELL, matches, planned, step


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        (
            "right, then left at the lights, and then stop",
            [
                step("turn", direction="right"),
                step("turn", AT, LIGHTS, direction="left"),
                step("stop"),
            ],
        ),
        (
            "carry straight on until you reach the Ikea, then right onto Fuller",
            [
                step("straight", "until", IKEA),
                step("turn", AT, {"street": "Fuller"}, direction="right"),
            ],
        ),
        (
            "take the third right and then the next left",
            [
                step("turn", direction="right", ordinal=3),
                step("turn", direction="left", ordinal=1),
            ],
        ),
        ("three rights", [step("turn", direction="right")] * 3),
        (
            "follow Hubbard for half a mile, then pull over",
            [
                step("follow", place={"street": "Hubbard"}, distance=805),
                step("stop"),
            ],
        ),
        (
            "straight across two lights, then turn around",
            [
                step("straight", "past", {**LIGHTS, "ordinal": 2}),
                step("u_turn"),
            ],
        ),
    ],
)
def test_a_way_over_several_junctions_keeps_all_its_steps(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("go left once you've passed the Shell", [step("turn", "after", SHELL, direction="left")]),
        ("at the bridge, hang a right", [step("turn", AT, BRIDGE, direction="right")]),
        ("as soon as you spot the KFC, pull over", [step("stop", "seen", KFC)]),
        ("stop just short of the lights", [step("stop", "before", LIGHTS)]),
        ("park opposite the Ikea", [step("stop", "opposite", IKEA)]),
        ("turn right after the third junction", [step("turn", "after", {"ordinal": 3}, direction="right")]),
        ("left at the second set of lights", [step("turn", AT, {**LIGHTS, "ordinal": 2}, direction="left")]),
        (
            "drive past the KFC and turn left there",
            [
                step("straight", "past", KFC),
                step("turn", AT, KFC, direction="left"),
            ],
        ),
    ],
)
def test_an_action_waits_for_the_place_that_is_named_with_it(text, steps):
    matches(text, *steps)
    assert guess_spans(text)[0].act.move is DialogueMove.INSTRUCT


@pytest.mark.parametrize(
    ("text", "side"),
    [
        ("my house is on the right", "right"),
        ("there's the bakery, on your left", "left"),
        ("it's the tall building on the left-hand side", "left"),
        ("the Shell is at the right side of the street", "right"),
    ],
)
def test_a_side_of_the_street_is_no_turn(text, side):
    heard = understand(text)
    assert ActionValue.J_TURN not in heard.actions
    assert heard.turns == ()
    assert heard.plan.steps == ()
    assert ActionValue.J_TURN not in guess_spans(text)[0].act.slots


def test_a_side_says_where_to_stop_and_which_street_to_take():
    matches("let me out on the right, please", step("stop", side="right"))
    matches("the house is on the left, stop there", step("stop", AT, {"landmark": "House"}, side="left"))
    matches("the second street on the left", step("turn", direction="left", ordinal=2))


@pytest.mark.parametrize(
    ("text", "kilometres_per_hour"),
    [
        ("forty miles an hour, please", 64),
        ("keep it under twenty mph", 32),
        ("fifteen metres per second", 54),
        ("could you do thirty-five kilometres an hour?", 35),
        ("drop it to twenty", 20),
        ("twenty-five. miles.", 40),
    ],
)
def test_speeds_are_converted(text, kilometres_per_hour):
    heard = understand(text)
    assert [one.speed for one in heard.plan] == [kilometres_per_hour]
    assert heard.speed == kilometres_per_hour
    assert heard.distance is None
    assert guess_spans(text)[0].act.move is DialogueMove.INSTRUCT
    assert ActionValue.SPEED_CHANGE in guess_spans(text)[0].act.slots


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("turn left in two hundred yards", 183),
        ("in a mile, turn left", 1609),
        ("turn left in three hundred feet", 91),
        ("turn left after one hundred and fifty metres", 150),
    ],
)
def test_distances_are_converted(text, metres):
    matches(text, step("turn", direction="left", distance=metres))


def test_minutes_are_no_distance():
    assert understand("turn left in five minutes").distance is None


@pytest.mark.parametrize(
    ("text", "faster"),
    [
        ("please stop driving so slowly", True),
        ("the bus ahead is slow, go faster", True),
        ("less slowly please", True),
        ("you're too slow, speed up", True),
        ("don't go so fast", False),
        ("a little less fast", False),
        ("not so quick", False),
    ],
)
def test_negated_and_compared_speeds_are_understood(text, faster):
    assert understand(text).faster is faster


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("left, no wait, right", [step("turn", direction="right")]),
        ("turn right, sorry, left at the KFC", [step("turn", AT, KFC, direction="left")]),
        ("go right rather than left", [step("turn", direction="right")]),
        ("take me to the KFC, no, the Ikea", [step("visit", place=IKEA)]),
        ("the second left, I mean the third left", [step("turn", direction="left", ordinal=3)]),
        (
            "not Hubbard, take Fuller",
            [
                step("avoid", place={"street": "Hubbard"}),
                step("follow", place={"street": "Fuller"}),
            ],
        ),
    ],
)
def test_a_correction_replaces_what_was_said_before(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("would you mind pulling over here?", [step("stop", AT, {"reference": "here"})]),
        ("I'd love to hop out at the Ikea", [step("stop", AT, IKEA)]),
        ("we ought to turn left at the bridge", [step("turn", AT, BRIDGE, direction="left")]),
        ("you'll want to slow down", [step("speed", change="slower")]),
        ("maybe you could switch your lights off", [step("lights", change="off")]),
        ("it would be great if you took me to the KFC", [step("visit", place=KFC)]),
        ("how about we avoid Plymouth?", [step("avoid", place={"street": "Plymouth"})]),
    ],
)
def test_indirect_requests_are_orders(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    "text",
    [
        "are we turning left at the KFC?",
        "why did you stop here?",
        "we turned right at the Shell",
        "it was the second left",
        "is that the Ikea on the right?",
        "did we pass Hubbard?",
    ],
)
def test_questions_and_statements_order_nothing(text):
    assert planned(text).steps == ()


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("first the Shell, then the KFC, and after that home", ["Shell", "KFC", "House"]),
        ("pick up my friend and then bring us to the Ikea", ["Person", "Ikea"]),
        ("the Ikea can wait, take me to the KFC first", ["KFC", "Ikea"]),
        ("skip the Shell, go straight to the Coco", ["Coco"]),
    ],
)
def test_errands_keep_their_order(text, names):
    plan = planned(text)
    assert [one.place.landmark.label for one in plan if one.place is not None] == names, plan.describe()


@pytest.mark.parametrize(
    ("text", "before", "move"),
    [
        ("right, thanks", "Explain", "Acknowledge"),
        ("oh, lovely", "Explain", "Acknowledge"),
        ("mm-hm", "QueryYN", "ReplyY"),
        ("mm-hm", "Explain", "Acknowledge"),
        ("that's okay", None, "Acknowledge"),
        ("that's okay", "QueryYN", "ReplyY"),
        ("alas, no", "QueryYN", "ReplyN"),
        ("bye now", None, "Irrelevant"),
        ("thanks a lot for that", None, "Acknowledge"),
        ("no, I meant the Shell", "Explain", "Clarify"),
    ],
)
def test_formulas_are_what_they_answer(text, before, move):
    after = None if before is None else next(one for one in DialogueMove if one.label == before)
    assert guess_spans(text, after)[0].act.move.label == move


def test_streets_to_avoid_and_places_without_a_name():
    matches("stay off Broadway please", step("avoid", place={"street": "Broadway"}))
    matches("back to where we started", step("visit", place={"reference": "start"}))
    matches("wait there", step("wait", AT, {"reference": "there"}))
    assert planned("don't stop, keep going").steps[0].action == "straight"
    assert LandmarkName.KFC in understand("left at the KFC").landmarks


@given(st.text(max_size=120))
def test_any_text_has_a_plan(text):
    assert isinstance(understand(text).plan, DrivingPlan)


def test_misheard_orders_have_plans():
    channel, rng = AsrChannel(rate=0.3), np.random.default_rng(5)
    said = "turn left at the second set of lights and then stop opposite the Ikea on the right hand side"
    heard = [understand(channel.transcribe(said, rng)).plan for _ in range(40)]
    assert sum(bool(plan.steps) for plan in heard) > 35


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("do you suppose you might turn left here", [step("turn", AT, {"reference": "here"}, direction="left")]),
        ("would you believe we could stop at the KFC", [step("stop", AT, KFC)]),
        ("before we drive to the KFC, take us to the Shell", [step("visit", place=SHELL), step("visit", place=KFC)]),
        ("skip the first left and take the second", [step("turn", direction="left", ordinal=2)]),
        ("instead of the KFC take me to the Shell", [step("visit", place=SHELL)]),
        ("the second we spot the Shell go left", [step("turn", "seen", SHELL, direction="left")]),
        ("I had hoped you'd take Fuller", [step("follow", place={"street": "Fuller"})]),
        ("we're hoping you'll turn right at the bridge", [step("turn", AT, BRIDGE, direction="right")]),
    ],
)
def test_politeness_and_order_do_not_change_what_is_asked(text, steps):
    matches(text, *steps)


@pytest.mark.parametrize(
    "text",
    [
        "last summer we turned left at the Ikea",
        "my sister used to work at the KFC",
        "will we still arrive before six o'clock?",
    ],
)
def test_what_is_told_of_other_days_orders_nothing(text):
    assert planned(text).steps == ()
    assert guess_spans(text)[0].act.move is not DialogueMove.INSTRUCT


def test_a_farewell_to_the_car_names_no_car():
    for text in ("bye bye car", "good night car", "hiya car"):
        assert not understand(text).objects
        assert guess_spans(text)[0].act.move is not DialogueMove.EXPLAIN


def test_times_of_day_are_no_speeds():
    assert understand("be at the KFC by thirty past").speed is None
    assert understand("the film begins at twenty o'clock").speed is None
    assert understand("drive at twenty").speed is not None


@pytest.mark.parametrize("phrase", ["(a|b", "a|(b)", "(a) (b)", "a||b"])
def test_a_malformed_phrase_of_the_grammar_is_refused(phrase):
    with pytest.raises(PhraseFileError, match="route_talk.yaml"):
        PhraseIndex([("actions", "stop", phrase)])


def test_the_longest_phrase_is_found():
    index = PhraseIndex([("actions", "go", "go"), ("actions", "u_turn", "go|head (right) back_round|home")])
    assert index.longest(["go", "back", "round", "now"], 0).length == 3
    assert index.longest(["go", "on"], 0).kind == "go"
    assert index.longest(["on"], 0) is None
    assert route_grammar().terminals.longest(["pull", "over"], 0).kind == "stop"


@pytest.mark.parametrize(
    ("text", "waits"),
    [
        ("if the bridge is closed, go left", "turn left"),
        ("in case it snows drive slower", "drive slower"),
        ("as soon as the rain lets up turn the lights off", "switch the lights off"),
        ("pull over if anybody feels sick", "stop"),
        ("unless there's a queue, take Hayward", "follow Hayward"),
        ("if you miss the turn, go back", "turn around"),
    ],
)
def test_what_depends_on_the_world_is_not_ordered_now(text, waits):
    parsed = understand(text)
    assert parsed.plan.steps == ()
    assert DrivingPlan(parsed.parse.contingent).describe() == waits
    assert [span.act.move for span in guess_spans(text)] == [DialogueMove.INSTRUCT]


@pytest.mark.parametrize(
    ("text", "plan"),
    [
        ("turn right if you would", "turn right"),
        ("stop as soon as it's safe", "stop"),
        ("it would be nice if you went a bit slower", "drive slower"),
        ("go to the Coco, and if it's shut go home", "drive to the Coco"),
        ("turn left once that bus has passed", "turn left after that car"),
    ],
)
def test_politeness_and_places_are_no_conditions_of_the_world(text, plan):
    assert planned(text).describe() == plan


@pytest.mark.parametrize(
    ("text", "plan"),
    [
        ("ignore three rights, take the fourth", "take the fourth right"),
        ("not the next left, the second", "take the second left"),
        ("forget that right, go straight on", "go straight on"),
        ("don't dawdle", "drive faster"),
        ("go twenty slower", "drive slower"),
        ("not into Draper, take Upland", "avoid Draper, then follow Upland"),
        ("do the Ikea before the KFC", "drive to IKEA, then drive to the KFC"),
        ("drop the Panera and go to the KFC", "drive to the KFC"),
        ("stop at the junction", "stop at the next junction"),
        ("I wonder if we should stop here", "stop here"),
        ("stop on the left, not the right", "stop on the left-hand side"),
        ("pick up Susan from the Ikea", "drive to my friend at IKEA"),
        ("when you see the bridge, slow down to thirty", "drive at 30 km/h at the sight of the bridge"),
    ],
)
def test_what_is_passed_dropped_or_put_first_is_understood(text, plan):
    assert planned(text).describe() == plan


@pytest.mark.parametrize(
    ("text", "after", "move"),
    [
        ("do the Coco before the Shell", None, "Instruct"),
        ("never turn on a bridge", None, "Instruct"),
        ("no, not right, left!", None, "Instruct"),
        ("can we make it by eight", None, "QueryYN"),
        ("how was your weekend?", None, "Irrelevant"),
        ("is there any chance we could stop at the Shell", None, "Instruct"),
        ("oh right", DialogueMove.EXPLAIN, "Acknowledge"),
        ("not that lane, the one on the other side", DialogueMove.EXPLAIN, "Clarify"),
    ],
)
def test_what_looks_like_another_act_is_told_by_the_parse(text, after, move):
    assert guess_spans(text, after)[0].act.move.label == move


def test_a_dropped_errand_is_abandoned():
    parsed = understand("get rid of the Qdoba")
    assert parsed.plan.steps == ()
    assert [value.label for value in parsed.statuses] == ["Abandoned"]
