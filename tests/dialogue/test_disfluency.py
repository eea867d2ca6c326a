"""Hesitations, restarts and withdrawn names, and texts without them."""

import numpy as np
import pytest

from dorothie_gym.dialogue import SpeakerStyle, fluent, word_act
from dorothie_gym.dialogue.disfluency import FILLED_PAUSES, hesitating
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName, Role


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("Um, turn left at the light.", "Turn left at the light."),
        ("I, uh, need to go to the bakery.", "I need to go to the bakery."),
        ("pull, um, pull over up there", "pull over up there"),
        ("Take me to the KFC, no, the Ikea.", "Take me to the Ikea."),
        ("turn onto Beal Street, sorry, Baits Drive", "turn onto Baits Drive"),
        ("Hmm, not sure.", "Not sure."),
        ("So the KFC, no, er, the Shell on Beal.", "So the Shell on Beal."),
    ],
)
def test_disfluencies_are_removed(said, meant):
    assert fluent(said) == meant


@pytest.mark.parametrize(
    "text", ["Um.", "uh", "Turn left, then right.", "No, the Ikea.", "Go to the KFC and the Ikea."]
)
def test_fluent_texts_stay_as_they_are(text):
    assert fluent(text) == text


@pytest.mark.parametrize("filler", FILLED_PAUSES)
def test_hesitations_leave_the_sentence_intact(filler):
    body = "the bakery is on the other side of the road"
    rng = np.random.default_rng(5)
    texts = {hesitating(body, filler, rng.random) for _ in range(60)}
    assert len(texts) > 3 and body not in texts
    assert {fluent(text) for text in texts} == {body}


def test_hesitant_speakers_say_what_fluent_ones_say():
    act = DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.U_TURN, LandmarkName.KFC)
    style = SpeakerStyle(disfluency=1.0)
    texts = [word_act(act, Role.PARTICIPANT, np.random.default_rng(seed), style=style) for seed in range(50)]
    assert all(fluent(text) != text for text in texts)
    assert not any(
        set(fluent(text).lower().strip(".?").replace(",", "").split()) & set(FILLED_PAUSES) for text in texts
    )


def test_no_pause_parts_a_title_from_its_name():
    rng = np.random.default_rng(2)
    texts = [hesitating("next is Mrs. Tamm's house, on Division", "er", rng.random) for _ in range(200)]
    assert not any("Mrs.," in text for text in texts)
