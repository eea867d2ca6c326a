"""A mere side answers the question before it: one of a lane, a stop, a place, or the way."""

import pytest

from dorothie_gym.dialogue import guess_spans, understand
from dorothie_gym.ontology import ActionValue, DialogueMove
from tests.dialogue.plan_steps import step

LEFT_LANE = step("lane", direction="left")


def steps(text: str, question: str) -> list[dict[str, object]]:
    return understand(text, question).plan.to_json()


@pytest.mark.parametrize("question", ["which lane?", "What lane do you want me in?", "the left lane or the right one?"])
@pytest.mark.parametrize("answer", ["left", "the left one", "on the left", "Left, I think.", "go left"])
def test_side_after_a_question_for_a_lane_is_a_lane(question: str, answer: str) -> None:
    (span,) = guess_spans(answer, DialogueMove.QUERY_W, question)
    assert steps(answer, question) == [LEFT_LANE]
    assert span.act.slots == {ActionValue.LANE_SWITCH}
    assert span.act.move is DialogueMove.REPLY_W


@pytest.mark.parametrize(
    "question", ["which side?", "Which side of the street should I stop on?", "left or right kerb?"]
)
@pytest.mark.parametrize("answer", ["right", "on the right", "right, please", "the right-hand one"])
def test_side_after_a_question_for_a_side_is_that_of_the_stop(question: str, answer: str) -> None:
    assert steps(answer, question) == [step("stop", side="right")]
    assert ActionValue.J_TURN not in guess_spans(answer, DialogueMove.QUERY_W, question)[0].act.slots


def test_side_of_a_place_is_no_step() -> None:
    assert steps("left", "what side is it on?") == []
    assert not understand("on the right", "which side is the house on?").turns


@pytest.mark.parametrize(
    "question", ["which way?", "left, right or straight on?", "where to?", "", "we're in the right lane"]
)
def test_side_after_other_words_is_a_turn(question: str) -> None:
    assert steps("left", question) == [step("turn", direction="left")]


@pytest.mark.parametrize("answer", ["turn left", "take the second left", "left at the lights", "a left"])
def test_turn_after_a_question_for_a_lane_is_a_turn(answer: str) -> None:
    assert steps(answer, "which lane?")[0]["action"] == "turn"


def test_rest_of_an_answer_is_kept() -> None:
    assert steps("left, and then stop", "which lane?") == [LEFT_LANE, step("stop")]
    assert [span.text for span in guess_spans("right, please", DialogueMove.QUERY_W, "which way?")] == ["right, please"]
    apart = guess_spans("Right ,  please and stop", DialogueMove.QUERY_W, "which way?")
    assert " ".join(span.text for span in apart) == "Right , please and stop"
    assert steps("right, please", "left or right?") == [step("turn", direction="right")]
    assert guess_spans("", None, "which lane?") == ()
