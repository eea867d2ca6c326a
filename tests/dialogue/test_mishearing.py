import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import Channel, word_error_rate
from dorothie_gym.dialogue.mishearing import misheard
from tests.dialogue.talk_corpus import session

SAID = [item.text for seed in range(300, 325) for item in session(seed)][:1000]


@pytest.mark.parametrize("rate", [0.05, 0.12, 0.25])
def test_the_error_rate_is_the_one_that_is_set(rate):
    rng = np.random.default_rng(8)
    heard = [Channel(rate=rate).transcribe(text, rng) for text in SAID]
    assert word_error_rate(SAID, heard) == pytest.approx(rate, rel=0.1)


def test_a_perfect_recogniser_hears_what_was_said():
    rng = np.random.default_rng(0)
    assert [Channel(rate=0).transcribe(text, rng) for text in SAID] == SAID


def test_a_transcript_is_a_function_of_text_and_seed():
    hear = [[Channel(rate=0.3).transcribe(text, np.random.default_rng(3)) for text in SAID[:50]] for _ in range(2)]
    assert hear[0] == hear[1]


def test_names_are_misheard_for_what_sounds_alike():
    heard = {misheard("Baits", draw) for draw in (itertools.repeat(x / 20).__next__ for x in range(20))}
    assert "Baits" not in heard
    assert heard & {"Beats", "Bits", "Bats", "Bets", "Bates"}


@given(st.text(max_size=160), st.integers(0, 2**32))
def test_any_text_has_a_transcript(text, seed):
    heard = Channel(rate=0.5).transcribe(text, np.random.default_rng(seed))
    assert bool(heard.split()) >= bool(text.split())


@pytest.mark.parametrize("fields", [{"rate": 1.0}, {"rate": -0.1}, {"substitutions": 0.9, "deletions": 0.3}])
def test_settings_out_of_range_are_named(fields):
    with pytest.raises(ValueError, match=next(iter(fields))):
        Channel(**fields)


def test_texts_and_transcripts_come_in_pairs():
    with pytest.raises(ValueError, match="2 texts and 1 transcripts"):
        word_error_rate(["a", "b"], ["a"])
