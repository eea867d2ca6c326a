"""Variety of generated utterances in many sessions, compared with human dialogue; docs/talk.md has the figures."""

import numpy as np
import pytest

from dorothie_gym.dialogue import guess_act
from dorothie_gym.ontology import Role
from tests.dialogue.talk_corpus import Said, figures, perplexity, session, tokens


@pytest.fixture(scope="module")
def sessions() -> list[list[Said]]:
    return [session(seed) for seed in range(1000, 1183)]


def test_corpus_figures_are_in_range_of_human_dialogue(sessions):
    found = figures([item for one in sessions for item in one])
    assert 5.1 <= found.words <= 6.9
    assert 1.25 <= found.acts <= 1.5
    assert found.vocabulary >= 1100  # 1141; 1213 with remarks out of nowhere and guesses what an obstacle is
    assert found.distinct >= 0.55
    assert found.commonest[1] <= 0.08, found.commonest


def test_sessions_differ_in_wording(sessions):
    words = [np.mean([len(tokens(item.text)) for item in one if item.speaker is Role.PARTICIPANT]) for one in sessions]
    assert np.percentile(words, 90) > 1.25 * np.percentile(words, 10)


def test_most_acts_are_recovered_from_their_words(sessions):
    spans = [span for one in sessions[:25] for item in one for span in item.spans]
    right = sum(guess_act(span.text).move is span.act.move for span in spans)
    assert right / len(spans) >= 0.85


def test_equal_seeds_give_equal_words(sessions):
    assert session(1000) == sessions[0]


@pytest.mark.slow
def test_perplexity_is_between_verbatim_and_noise(sessions):
    pytest.importorskip("nltk")
    train, test = sessions[:122], sessions[122:]
    found = perplexity([item for one in train for item in one], [item for one in test for item in one][::4])
    assert 6 <= found <= 40
