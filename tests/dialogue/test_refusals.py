from __future__ import annotations

import pytest

from dorothie_gym.dialogue.refusals import (
    Reason,
    agrees,
    asks,
    consents,
    declines,
    named_places,
    named_streets,
    offers,
    reasons_of,
)
from dorothie_gym.ontology.slots import LandmarkName, StreetName


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("Sorry, there is no KFC on my map.", Reason.NOT_THERE),
        ("I can't find such a place in this town.", Reason.NOT_THERE),
        ("My map does not show any KFC.", Reason.NOT_THERE),
        ("I can\u2019t go on, the road is blocked by a barrier.", Reason.CLOSED),
        ("I won't do that, it's illegal.", Reason.RULES),
        ("Running red lights is not allowed, sorry.", Reason.RULES),
        ("I have no way to know that, sorry.", Reason.UNSEEN),
        ("I cannot see that from here.", Reason.UNSEEN),
    ],
)
def test_refusals_are_read_with_their_reason(text: str, reason: Reason) -> None:
    assert declines(text) and reasons_of(text) == {reason} and not agrees(text)


def test_offers_questions_and_promises_are_told_apart() -> None:
    assert offers("I can take you to Ikea instead.") and offers("Shall I drive there?")
    assert not offers("There is no KFC here.")
    assert asks("Which house do you mean?") and asks("which house") and not asks("I will go to the house.")
    assert consents("Sure, I won't drive faster.") and not consents("I can't do that, okay?")
    assert not agrees("Okay, but I cannot do that.")
    assert agrees("Sure, right away!") and agrees("OK, I'll do that.") and not agrees("Sorry, I can't do that.")


def test_places_and_streets_are_found_as_words() -> None:
    assert named_places("To Seven Eleven, or the house's door?") == (LandmarkName.SEVEN_ELEVEN, LandmarkName.HOUSE)
    assert named_places("a greenhouse") == ()
    assert named_streets("the one on Baits, not on beal") == (StreetName.BAITS, StreetName.BEAL)
