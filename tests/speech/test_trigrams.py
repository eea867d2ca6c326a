"""Trigram models and punctuation."""

import math

import pytest

from dorothie_gym.speech.punctuation import PunctuationModel
from dorothie_gym.speech.spoken_form import spoken_tokens
from dorothie_gym.speech.trigrams import END, START, Trigrams, estimate

SENTENCES = ["turn left", "turn right", "turn left here", "stop here", "go to beal"]
MODEL = estimate([(sentence.split(), 1.0) for sentence in SENTENCES], ["fuller"])


@pytest.mark.parametrize("context", [(START, START), (START, "turn"), ("turn", "left"), ("beal", "stop"), ("x", "y")])
def test_probabilities_sum_to_one(context: tuple[str, str]) -> None:
    words = MODEL.unigrams
    assert sum(math.exp(MODEL.log_probability(*context, word)) for word in words) == pytest.approx(1.0, abs=1e-6)


def test_frequent_continuations_are_more_probable() -> None:
    assert MODEL.log_probability(START, "turn", "left") > MODEL.log_probability(START, "turn", "right")
    assert MODEL.log_probability(START, "turn", "right") > MODEL.log_probability(START, "turn", "fuller")
    assert MODEL.log_probability("turn", "left", END) > MODEL.log_probability("turn", "left", "fuller")


def test_arpa_gives_the_same_model() -> None:
    again = Trigrams.from_arpa(MODEL.arpa())
    for context in [(START, "turn"), ("turn", "left"), ("beal", "stop")]:
        for word in MODEL.unigrams:
            found = again.log_probability(*context, word)
            assert found == pytest.approx(MODEL.log_probability(*context, word), abs=1e-3)


def test_marks_are_restored() -> None:
    texts = ["Yeah, turn left.", "Should I turn left?", "Okay, should I stop?", "Yeah, I stop.", "Which way now?"]
    model = PunctuationModel.learn([(spoken_tokens(text), 1.0) for text in texts])
    for text in texts:
        assert model.restore([word for word in spoken_tokens(text) if word.isalpha()]) == spoken_tokens(text)
    assert model.restore(["okay", "should", "i", "turn", "left"])[-1] == "?"
    assert model.restore([]) == []
    again = PunctuationModel.from_texts(model.texts())
    assert again.restore(["should", "i", "stop"]) == model.restore(["should", "i", "stop"])
