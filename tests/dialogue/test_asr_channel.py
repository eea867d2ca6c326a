from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.dialogue import (
    ANSWER_TIMEOUT,
    AsrChannel,
    Recogniser,
    Span,
    Utterance,
    asr_channel,
    guess_act,
    word_error_rate,
)
from dorothie_gym.dialogue.asr_channel import misheard
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role
from tests.dialogue.talk_corpus import session

SAID = [item.text for seed in range(300, 325) for item in session(seed)][:1000]


@pytest.mark.parametrize("rate", [0.05, 0.12, 0.25])
def test_error_rate_equals_setting(rate):
    rng = np.random.default_rng(9)
    said = SAID * 4  # 27,000 words: the standard error of a rate of 0.05 is 3 % of it
    heard = [AsrChannel(rate=rate).transcribe(text, rng) for text in said]
    assert word_error_rate(said, heard) == pytest.approx(rate, rel=0.1)


def test_error_free_channel_returns_the_spoken_text():
    rng = np.random.default_rng(0)
    assert [AsrChannel(rate=0).transcribe(text, rng) for text in SAID] == SAID


def test_transcript_depends_on_text_and_seed_only():
    hear = [[AsrChannel(rate=0.3).transcribe(text, np.random.default_rng(3)) for text in SAID[:50]] for _ in range(2)]
    assert hear[0] == hear[1]


def test_names_are_confused_with_similar_sounding_words():
    heard = {misheard("Baits", draw) for draw in (itertools.repeat(x / 20).__next__ for x in range(20))}
    assert "Baits" not in heard
    assert heard & {"Beats", "Bits", "Bats", "Bets", "Bates"}


@given(st.text(max_size=160), st.integers(0, 2**32))
def test_every_text_has_a_transcript(text, seed):
    heard = AsrChannel(rate=0.5).transcribe(text, np.random.default_rng(seed))
    assert bool(heard.split()) >= bool(text.split())


@pytest.mark.parametrize("fields", [{"rate": 1.0}, {"rate": -0.1}, {"substitutions": 0.9, "deletions": 0.3}])
def test_error_names_setting_out_of_range(fields):
    with pytest.raises(ValueError, match=next(iter(fields))):
        AsrChannel(**fields)


def test_word_error_rate_needs_equal_numbers_of_texts():
    with pytest.raises(ValueError, match="2 texts and 1 transcripts"):
        word_error_rate(["a", "b"], ["a"])


def recogniser(rate: float, seed: int = 4) -> Recogniser:
    return Recogniser(AsrChannel(rate=rate), np.random.default_rng(seed))


def said(speaker: Role, start: float, *spans: tuple[str, DialogueAct]) -> Utterance:
    return Utterance(speaker, tuple(Span(text, act) for text, act in spans), start, start + 2.0)


ASKED = DialogueAct.of(DialogueMove.QUERY_W, ActionValue.QUERIED)
TALK = [
    said(Role.PARTICIPANT, 10.0 * k, (item.text, DialogueAct(DialogueMove.ALIGN)))
    for k, item in enumerate(itertools.islice((item for seed in range(40, 44) for item in session(seed)), 150))
]


def test_error_free_recogniser_returns_the_utterance() -> None:
    perfect = recogniser(0.0)
    assert all(perfect.hear(utterance) is utterance for utterance in TALK)


def test_correctly_recognised_words_keep_act_and_others_never_do() -> None:
    ears = recogniser(0.12)
    kept = lost = 0
    for utterance in TALK:
        heard = ears.hear(utterance)
        for truth, span in zip(utterance.spans, heard.spans, strict=True):
            if word_error_rate([truth.text], [span.text]) == 0:
                kept += 1
                assert span.act == truth.act
            else:
                lost += 1
                assert span.act == guess_act(span.text), "the words alone determine another act"
        assert (heard.speaker, heard.start, heard.end) == (utterance.speaker, utterance.start, utterance.end)
    assert kept > 30 and lost > 30


def test_transcript_does_not_depend_on_the_intended_act() -> None:
    to_kfc = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC)
    misheard = 0
    ears, others = recogniser(0.3), recogniser(0.3)
    for utterance in TALK:
        text = utterance.text
        heard, other = ears.hear(utterance), others.hear(said(Role.PARTICIPANT, utterance.start, (text, to_kfc)))
        assert heard.text == other.text
        if word_error_rate([text], [heard.text]):
            misheard += 1
            assert heard.acts == other.acts
    assert misheard > 50


def heard_after_a_question(pause: float, between: Utterance | None = None) -> set[DialogueMove]:
    """Returns the moves of misheard "go left at the Ikea" after a question and a pause [s]."""
    found = set()
    for seed in range(60):
        ears = recogniser(0.3, seed)
        ears.hear(said(Role.CO_WIZARD, 0.0, ("Which way?", ASKED)))
        if between is not None:
            ears.hear(between)
        answer = said(
            Role.PARTICIPANT, 2.0 + pause, ("go left at the Ikea please", DialogueAct(DialogueMove.IRRELEVANT))
        )
        heard = ears.hear(answer)
        if heard.text != answer.text and "go left" in heard.text:
            found.add(heard.acts[0].move)
    return found


def test_misheard_words_are_classified_by_open_question() -> None:
    assert DialogueMove.REPLY_W in heard_after_a_question(1.0)
    assert DialogueMove.REPLY_W not in heard_after_a_question(ANSWER_TIMEOUT + 1.0), "the exchange is abandoned"
    other = said(Role.PARTICIPANT, 2.0, ("well", DialogueAct(DialogueMove.IRRELEVANT)))
    assert DialogueMove.REPLY_W not in heard_after_a_question(1.0, other), "it has been answered"


def test_equal_seeds_give_equal_transcripts() -> None:
    once, again = recogniser(0.2), recogniser(0.2)
    assert [once.hear(utterance) for utterance in TALK] == [again.hear(utterance) for utterance in TALK]


def test_recogniser_without_classification_gives_equal_transcripts() -> None:
    plain = Recogniser(AsrChannel(rate=0.5), np.random.default_rng(4), classify=False)
    with_acts = recogniser(0.5)
    for utterance in TALK:
        heard, expected = plain.hear(utterance), with_acts.hear(utterance)
        assert heard.text == expected.text
        for span, spoken in zip(heard.spans, utterance.spans, strict=True):
            assert span.act == spoken.act or span.act.move is DialogueMove.IRRELEVANT


def test_recogniser_knows_no_labels_of_the_grammar():
    known = {word for words in asr_channel._vocabulary_by_sound().values() for word in words}
    labels = {move.label.lower() for move in DialogueMove} | {"jturn", "uturn", "laneswitch", "co_wizard", "cmd"}
    assert not known & (labels - {"check", "clarify", "confirm", "explain", "confuse", "align", "instruct"})
    assert {"straight", "left", "driver"} <= known, "what is said stays known"
