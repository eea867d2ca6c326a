"""Understanding of hand-written utterances; docs/talk.md has the figures."""

import pytest

from dorothie_gym.dialogue import guess_spans
from tests.dialogue.annotated_utterances import read_annotated, score


@pytest.mark.parametrize("name", ["dev", "test", "voices", "more", "cabin", "fresh", "people_dev", "people_more"])
def test_hand_written_utterances_are_understood(name):
    annotated = read_annotated(name)
    assert len(annotated) >= 40
    alone = score(annotated, context=False)
    assert alone.moves >= 0.8 and alone.f1 >= 0.8, alone.wrong
    # The move before settles what short answers are.
    assert score(annotated).moves >= alone.moves


@pytest.mark.parametrize("name", ["unseen", "held", "people_test"])
def test_utterances_that_no_rule_was_written_for_are_understood(name):
    annotated = read_annotated(name)
    assert len(annotated) >= 60
    found = score(annotated)
    assert found.moves >= 0.75 and found.f1 >= 0.65, found.wrong


@pytest.mark.parametrize(
    "name", ["dev", "test", "voices", "more", "cabin", "fresh", "unseen", "held", "people_dev", "people_test"]
)
def test_hand_written_utterances_are_segmented_into_acts(name):
    annotated = read_annotated(name)
    right = sum(len(guess_spans(item.text, item.after)) == len(item.acts) for item in annotated)
    assert right / len(annotated) >= 0.85
