import numpy as np
import pytest

from dorothie_gym.baselines.roles.learned_role.utterance_inputs import (
    MAX_WORDS,
    UTTERANCE_SIZE,
    Utterance,
    word_rows,
    write_utterance,
)
from dorothie_gym.dialogue import Predicate, guess_spans, understand
from dorothie_gym.ontology import LandmarkName, StreetName
from dorothie_gym.policies.heard_utterance import HeardUtterance


def heard(text, time=10.0):
    acts = tuple(span.act for span in guess_spans(text))
    return Utterance(time=time, heard=HeardUtterance(acts=acts, words=understand(text)))


def utterance_vector(utterance, now):
    inputs = np.full(UTTERANCE_SIZE, np.nan, dtype=np.float32)
    write_utterance(utterance, now, inputs)
    return inputs.tolist()


@pytest.mark.parametrize("text", ["", "Turn left.", "Forget KFC, go to Ikea on Beal. Then stop in 30 meters, okay?"])
def test_all_utterances_have_vectors_of_one_length(text):
    assert np.isfinite(utterance_vector(heard(text), 12.0)).all()


def test_left_and_right_and_age_are_told_apart():
    assert utterance_vector(heard("Turn left."), 10.0) != utterance_vector(heard("Turn right."), 10.0)
    assert utterance_vector(heard("Turn left."), 10.0) != utterance_vector(heard("Turn left."), 14.0)


def test_names_of_places_are_not_learnt_one_by_one():
    assert utterance_vector(heard("Go to KFC."), 10.0) == utterance_vector(heard("Go to Ikea."), 10.0)
    assert heard("Go to KFC on Beal.").places == (LandmarkName.KFC,)
    assert heard("Go to KFC on Beal.").streets == (StreetName.BEAL,)


def test_question_has_what_it_asks():
    assert heard("Do you see a pedestrian?").asked.predicate is Predicate.SEES
    assert heard("Turn left.").asked is None


def test_words_are_numbered_alike_everywhere_and_cut_off():
    assert (word_rows("turn left")[:2] == word_rows("Turn LEFT!")[:2]).all()
    assert word_rows("go " * 100).shape == (MAX_WORDS,)
    assert not word_rows("").any()
