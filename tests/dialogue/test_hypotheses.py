import numpy as np
import pytest

from dorothie_gym.dialogue import (
    INAUDIBLE,
    AsrChannel,
    DrivingPlan,
    TextHypothesis,
    guess_spans,
    read_hypotheses,
    word_error_rate,
)
from dorothie_gym.dialogue.hypotheses import MOST, nbest, with_unsure_names
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, StreetName

SAID = [
    "turn left at the KFC and then take the second right",
    "please stop behind the bridge on the right-hand side",
    "go straight on until you see the Shell, then slow down",
    "could you take me to the Panera on Fuller",
    "change to the left lane and follow Hubbard",
    "no, I meant the house on Draper",
]


def heard(*texts: str) -> list[TextHypothesis]:
    """Returns hypotheses, each a bit less probable than the one before."""
    weights = [0.9**number for number in range(len(texts))]
    return [
        TextHypothesis(text=text, weight=weight / sum(weights)) for text, weight in zip(texts, weights, strict=True)
    ]


@pytest.mark.parametrize(
    ("texts", "taken"),
    [
        (("turn lift at the bridge", "turn left at the bridge"), 1),
        (("shop at the next lights", "stop at the next lights"), 1),
        (("turn right at the bridge", "turned ride at the bridge"), 0),
        (("take me to the KFC", "take me to the case"), 0),
    ],
)
def test_hypothesis_that_orders_something_is_taken(texts: tuple[str, ...], taken: int) -> None:
    assert read_hypotheses(heard(*texts)).text == texts[taken]


def test_map_decides_between_readings() -> None:
    both = heard("turn right onto Beal", "turn right onto Bishop")
    assert read_hypotheses(both).text == both[0].text

    def has_bishop(plan: DrivingPlan) -> bool:
        return all(place.street is StreetName.BISHOP for step in plan for place in step.places)

    assert read_hypotheses(both, allows=has_bishop).text == both[1].text


def test_question_before_decides_the_move_of_the_answer() -> None:
    assert read_hypotheses(heard("left"), DialogueMove.QUERY_W).spans[0].act.move is DialogueMove.REPLY_W


def test_name_that_most_hypotheses_lack_is_asked_for() -> None:
    reading = read_hypotheses(
        heard("take me to the Coco, please", "take me to the cocoa, please", "take me to the cook, please")
    )
    assert reading.unsure == (LandmarkName.COCO,)
    assert with_unsure_names(reading) == f"take me to the {INAUDIBLE}, please"
    sure = read_hypotheses(heard("take me to the Coco", "take him to the Coco"))
    assert not sure.unsure and with_unsure_names(sure) == sure.text


def test_confidence_is_the_share_of_equal_meanings() -> None:
    one = read_hypotheses([TextHypothesis(text="stop here", weight=1.0)])
    assert one.confidence == 1.0
    two = read_hypotheses(
        [
            TextHypothesis(text="stop here", weight=0.5),
            TextHypothesis(text="stop here now", weight=0.25),
            TextHypothesis(text="top hair", weight=0.25),
        ]
    )
    assert two.confidence == pytest.approx(0.75)
    assert ActionValue.STOP in two.spans[0].act.slots and len(two.plan) == 1


def test_reading_needs_a_hypothesis() -> None:
    with pytest.raises(ValueError, match="at least one hypothesis"):
        read_hypotheses([])


def test_most_probable_words_come_first() -> None:
    found = nbest([(("turn", 1.0),), (("lift", 0.6), ("left", 0.4)), (("here", 0.9), ("hair", 0.1))])
    assert [each.text for each in found[:2]] == ["turn lift here", "turn left here"]
    assert sum(each.weight for each in found) == pytest.approx(1.0)
    assert len(found) == len({each.text for each in found}) <= MOST
    assert nbest([]) == ()


@pytest.mark.parametrize("seed", range(3))
def test_best_hypothesis_is_the_transcript(seed: int) -> None:
    channel, rng, other = AsrChannel(rate=0.3), np.random.default_rng(seed), np.random.default_rng(seed)
    for text in SAID:
        hypotheses = channel.recognise(text, rng)
        assert hypotheses[0].text == channel.transcribe(text, other)
        assert hypotheses == tuple(sorted(hypotheses, key=lambda each: -each.weight)), "the most probable first"


def test_hypotheses_are_better_than_the_first_one() -> None:
    channel, rng = AsrChannel(rate=0.25), np.random.default_rng(5)
    texts = SAID * 12
    recognised = [channel.recognise(text, rng) for text in texts]
    first = [each[0].text for each in recognised]
    taken = [read_hypotheses(each).text for each in recognised]
    wanted = [frozenset(value for span in guess_spans(text) for value in span.act.slots) for text in texts]

    def share(found: list[str]) -> float:
        values = [frozenset(value for span in guess_spans(text) for value in span.act.slots) for text in found]
        return sum(value == want for value, want in zip(values, wanted, strict=True)) / len(wanted)

    assert word_error_rate(texts, taken) < word_error_rate(texts, first)
    assert share(taken) >= share(first) + 0.03
