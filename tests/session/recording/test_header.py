from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dorothie_gym.errors import SessionError
from dorothie_gym.session.recording import SessionHeader
from tests.session.recording.builders import header


def test_header_round_trips_through_json() -> None:
    assert SessionHeader.from_json(header().to_json()) == header()


def test_header_takes_lists_and_numpy_numbers() -> None:
    given = header(street_names=["Baits", "Fuller"], departure=(np.int64(2), np.float64(8.25)), seed=np.int64(7))
    assert given == header()
    assert SessionHeader.from_json(given.to_json()) == header()


def test_header_holds_no_time_of_day() -> None:
    assert header().to_json() == header().to_json()
    assert not {"time", "date", "created"} & set(header().to_json())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"town": 3}, "'town' is 3; it must be a text"),
        ({"seed": "7"}, "'seed' is '7'; it must be a whole number"),
        ({"decision_frequency": 0.0}, "'decision_frequency' is 0.0; it must be a positive number"),
        ({"street_names": ["Elm"]}, "'street_names'.*Elm"),
        ({"departure": (-2, 0.0)}, "'lane' is -2"),
        ({"departure": (1,)}, "'departure'"),
        ({"landmarks": [{"name": "KFC"}]}, r"landmarks\[0\]: field 'lane' is missing"),
        ({"config": {"f": object()}}, "config.f is a object"),
    ],
)
def test_wrong_field_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SessionError, match=message):
        header(**changes)
