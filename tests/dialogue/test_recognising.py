"""What a listener gets of words that a recogniser stands in the way of."""

from __future__ import annotations

import itertools

import numpy as np

from dorothie_gym.dialogue import PATIENCE, Channel, Recogniser, Span, Utterance, guess_act, word_error_rate
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role
from tests.dialogue.talk_corpus import session


def recogniser(rate: float, seed: int = 4) -> Recogniser:
    return Recogniser(Channel(rate=rate), np.random.default_rng(seed))


def said(speaker: Role, start: float, *spans: tuple[str, DialogueAct]) -> Utterance:
    return Utterance(speaker, tuple(Span(text, act) for text, act in spans), start, start + 2.0)


ASKED = DialogueAct.of(DialogueMove.QUERY_W, ActionValue.QUERIED)
TALK = [
    said(Role.PARTICIPANT, 10.0 * k, (item.text, DialogueAct(DialogueMove.ALIGN)))
    for k, item in enumerate(itertools.islice((item for seed in range(40, 44) for item in session(seed)), 150))
]


def test_a_perfect_recogniser_hands_on_what_was_said() -> None:
    perfect = recogniser(0.0)
    assert all(perfect.hear(utterance) is utterance for utterance in TALK)


def test_words_that_are_heard_right_keep_their_act_and_others_never_do() -> None:
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
                assert span.act == guess_act(span.text), "nobody could have said this act by these words alone"
        assert (heard.speaker, heard.start, heard.end) == (utterance.speaker, utterance.start, utterance.end)
    assert kept > 30 and lost > 30


def test_what_is_heard_does_not_depend_on_the_act_that_was_meant() -> None:
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
    """Moves of "go left at the Ikea" where it was misheard, said so long after a question."""
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


def test_misheard_words_are_read_in_the_light_of_an_open_question() -> None:
    assert DialogueMove.REPLY_W in heard_after_a_question(1.0)
    assert DialogueMove.REPLY_W not in heard_after_a_question(PATIENCE + 1.0), "nobody waits for it any more"
    other = said(Role.PARTICIPANT, 2.0, ("well", DialogueAct(DialogueMove.IRRELEVANT)))
    assert DialogueMove.REPLY_W not in heard_after_a_question(1.0, other), "it has been answered"


def test_the_same_seed_hears_the_same() -> None:
    once, again = recogniser(0.2), recogniser(0.2)
    assert [once.hear(utterance) for utterance in TALK] == [again.hear(utterance) for utterance in TALK]
