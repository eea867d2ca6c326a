"""Spellings of speech, repetitions and forms of speech that mean the same as plainer words."""

from __future__ import annotations

import random
import string

import pytest

from dorothie_gym.dialogue import DrivingPlan, guess_spans, understand
from dorothie_gym.dialogue.lexicon import plain_word, split_words
from dorothie_gym.ontology import DialogueMove


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("t-turn l-l-left pls", "turn left please"),
        ("stooop heeere", "stop here"),
        ("haud on noo", "hold on now"),
        ("goin' doon tae the lichts", "going down to the lights"),
        ("a right-hand U-turn", "a right hand u turn"),
    ],
)
def test_spellings_of_speech_are_plain_words(said: str, words: str) -> None:
    assert split_words(said) == words.split()


def test_a_word_that_stands_for_several_stays_one_word() -> None:
    assert plain_word("Thankyou,") == "thankyou"
    assert plain_word("comin\u2019") == "coming"


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("left, mate, left", "left"),
        ("right right left", "right, then right, then left"),
        ("take this right coming up", "take the right"),
        ("keep going till you hit the lights", "keep going until the lights"),
        ("past the KFC, over the bridge, then left", "go past the KFC, then go past the bridge, then left"),
        ("the Shell and the Panera, the Panera first", "the Panera, then the Shell"),
        ("the IKEA is where you hang a right", "turn right at the IKEA"),
        ("don't stop until you're at the KFC", "stop at the KFC"),
        ("where Plymouth meets Draper take a right", "turn right at Plymouth"),
        ("take us down Duffield", "follow Duffield"),
        ("go round this bus", "overtake"),
        ("knock ten miles an hour off that", "slower"),
        ("I'd get in the other lane if I were you", "get in the other lane"),
        ("the second, hang on, no, the third left", "the third left"),
    ],
)
def test_forms_of_speech_order_what_plainer_words_do(said: str, plain: str) -> None:
    assert understand(plain).plan != DrivingPlan()
    assert understand(said).plan == understand(plain).plan


@pytest.mark.parametrize(
    ("before", "said", "move"),
    [
        ("Is that your house?", "it certainly is", DialogueMove.REPLY_Y),
        ("Did you mean the second left?", "not the second, the third", DialogueMove.REPLY_N),
        ("There is a queue ahead.", "yeah alright", DialogueMove.ACKNOWLEDGE),
        ("Turning onto Beal.", "Bishop, love, not Beal", DialogueMove.CLARIFY),
        ("", "please do not drive so quickly", DialogueMove.INSTRUCT),
        ("", "where the wall ends, make a left", DialogueMove.INSTRUCT),
    ],
)
def test_reactions_and_orders_of_free_form(before: str, said: str, move: DialogueMove) -> None:
    after = guess_spans(before)[-1].act.move if before else None
    assert guess_spans(said, after)[0].act.move is move


@pytest.mark.parametrize("text", ["left,then right", "okay,left", "go on for 1,000 m", "a,b,c", "Yes,[no,1Go right,"])
def test_commas_inside_words_lose_no_word(text: str) -> None:
    assert " ".join(span.text for span in guess_spans(text)) == text


def test_any_signs_are_read() -> None:
    drawn = random.Random(4)
    for _ in range(200):
        text = "".join(drawn.choice(f"{string.printable[:95]}  ,.?") for _ in range(drawn.randint(1, 90)))
        assert " ".join(span.text for span in guess_spans(text)).split() == text.split()
