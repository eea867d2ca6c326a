from __future__ import annotations

from collections import Counter

import pytest

from dorothie_gym.evaluation.analysis import anchors_of
from dorothie_gym.evaluation.analysis.diversity import ORDER, UNKNOWN, repetition, trigram_perplexity
from dorothie_gym.ontology import ActionValue, PhysicalAction, Role
from tests.evaluation.analysis.builders import M, car, did, drive, human

TRAIN = ["Go left please", "go right please now", "turn left now", "please turn around", "go left soon", "a dog barks"]
TEST = ["turn left please", "go around now", "zebra left"]


def test_the_trigram_is_that_of_nltk() -> None:
    lm, util = pytest.importorskip("nltk.lm"), pytest.importorskip("nltk.util")
    words = [text.lower().split() for text in TRAIN]
    vocabulary = lm.Vocabulary((word for line in words for word in line), unk_cutoff=2, unk_label=UNKNOWN)

    def padded(line: list[str]) -> list[str]:
        return ["<s>", "<s>", *vocabulary.lookup(line), "</s>"]

    model = lm.KneserNeyInterpolated(ORDER)
    lines = [padded(line) for line in words]
    model.fit((util.everygrams(line, max_len=ORDER) for line in lines), [word for line in lines for word in line])
    heard = [padded(text.split()) for text in TEST]
    grams = [tuple(line[k - 2 : k + 1]) for line in heard for k in range(2, len(line))]
    assert trigram_perplexity(TRAIN, TEST) == pytest.approx(model.perplexity(grams))


def test_talk_that_repeats_itself_surprises_less_than_new_words() -> None:
    pytest.importorskip("nltk")
    same, new = trigram_perplexity(TRAIN * 2 + ["x"], TRAIN), trigram_perplexity(TRAIN, ["now please around left go"])
    assert same is not None and new is not None and 1.0 < same < new


def test_perplexity_without_training_or_test_words_is_undefined() -> None:
    pytest.importorskip("nltk")
    assert trigram_perplexity([], TEST) is None and trigram_perplexity(TRAIN, ["..."]) is None


def test_repetition_counted_by_hand() -> None:
    assert repetition(Counter({"okay": 3, "left": 1})) == {
        "distinct_utterance_ratio": 0.5,
        "commonest_utterance": "okay",
        "commonest_utterance_share": 0.75,
    }
    assert set(repetition(Counter()).values()) == {None}


def test_anchors_counted_by_hand() -> None:
    session = drive(
        human(1.0, "left", M.INSTRUCT, ActionValue.J_TURN),
        human(4.0, "left", M.INSTRUCT, ActionValue.J_TURN),
        human(7.0, "yes", M.REPLY_Y),
        car(10.0, "okay", M.ACKNOWLEDGE),
        did(11.0, PhysicalAction.J_TURN, angle=80.0),
        did(12.0, PhysicalAction.SPEED_CHANGE, up=True),
    )
    anchors = anchors_of([session])
    human_move, car_move = anchors["commonest_human_move"], anchors["commonest_car_move"]
    assert (human_move["label"], human_move["points"], human_move["within"]) == ("Instruct", 3, False)
    assert human_move["share"] == pytest.approx(2 / 3) and car_move["share"] == 1.0
    assert anchors["commonest_navigation_action"]["points"] == 1, "a change of speed is no navigation action"
    assert anchors["human_moves_without_slot"]["share"] == pytest.approx(1 / 3)
    assert anchors["human_moves_without_slot"]["within"], "within 8 points of the paper's 36.9"
    assert anchors_of([])["commonest_car_move"]["share"] is None
    assert Role.CO_WIZARD in {move.speaker for move in session.all_moves}
