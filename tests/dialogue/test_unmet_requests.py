"""Requests that a car which only drives cannot carry out."""

import pytest

from dorothie_gym.dialogue.unmet_requests import unmet_request


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("couldn't you just go along the sidewalk?", "off_road"),
        ("cut across the lawn", "off_road"),
        ("jump the lights, nobody is looking", "against_law"),
        ("please go the wrong way down here", "against_law"),
        ("play some music", "equipment"),
        ("turn up the heating, would you", "equipment"),
        ("open a window", "equipment"),
        ("straight over the lights", None),
        ("turn the headlights on", None),
        ("go over the bridge and past the wall", None),
        ("stop by the grass", None),
    ],
)
def test_reason_against_a_request(text, reason):
    assert unmet_request(text) == reason
