"""Spoken and written forms of words."""

import pytest

from dorothie_gym.dialogue import load_lexicon, understand
from dorothie_gym.ontology import Slot
from dorothie_gym.speech import spoken_words, written_form
from dorothie_gym.speech.spoken_form import spoken_tokens


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("Take the 2nd left, KFC's on the right", "take the second left kfc's on the right"),
        ("the KFC", "the k f c"),
        ("the 7-Eleven, then IKEA", "the seven eleven then ikea"),
        ("at 25 km/h", "at twenty five kilometers an hour"),
        ("Mr. Ruiz\u2019s U-turn \u2026", "mister ruiz's u turn"),
        ("forty-five", "forty five"),
        ("2024", "two zero two four"),
        ("?!", ""),
    ],
)
def test_words_are_spoken(text: str, spoken: str) -> None:
    assert " ".join(spoken_words(text)) == spoken


def test_marks_are_reduced_to_three() -> None:
    assert spoken_tokens("Stop! No; really?!") == ["stop", ".", "no", ",", "really", "?"]


def test_names_are_written_as_they_are_spelt() -> None:
    tokens = [
        "so",
        "i",
        "take",
        "the",
        "k",
        "f",
        "c",
        ",",
        "the",
        "seven",
        "eleven",
        "and",
        "burger",
        "king",
        "on",
        "bonisteel",
        "?",
    ]
    assert written_form(tokens) == "so I take the KFC, the 7-Eleven and Burger King on Bonisteel?"


def test_every_spoken_name_is_understood() -> None:
    for value, forms in load_lexicon().phrases.items():
        if value.slot in (Slot.LANDMARK, Slot.STREET) and value.label not in ("Unknown", "Queried"):
            for phrase in forms["say"]:
                assert value in understand(f"go to {written_form(spoken_words(phrase))}").values, phrase
