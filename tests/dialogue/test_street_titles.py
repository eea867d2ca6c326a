"""Names of a map for streets: shown to people, and read from what they type."""

from __future__ import annotations

import copy
import pickle

import pytest

from dorothie_gym.dialogue.street_titles import NO_TITLES, StreetTitles
from dorothie_gym.ontology import StreetName

NAMED = {
    StreetName.BEAL: "Rue de l'Église",
    StreetName.BISHOP: "Main St",
    StreetName.BROADWAY: "N Broadway",
    StreetName.FULLER: "Martin Luther King Jr. Blvd",
    StreetName.MURFIN: "Marktstraße",
    StreetName.UPLAND: "札幌通",
    StreetName.DRAPER: "An St. Marien / Kirchplatz & Markt",
    StreetName.BAITS: "Loop",
    StreetName.HUBBARD: "Park",
    StreetName.DIVISION: "Elm Street",
}
TITLES = StreetTitles([*NAMED, StreetName.HAYWARD], [*NAMED.values(), ""])


@pytest.mark.parametrize(
    ("typed", "read"),
    [
        ("turn right onto rue de l'eglise", "turn right onto Beal"),
        ("Rue de l\u2019Église!", "Beal!"),
        ("turn onto Main Street, then go left", "turn onto Bishop, then go left"),
        ("MAIN ST. then North Broadway", "Bishop then Broadway"),
        ("Martin Luther King Jr Boulevard please", "Fuller please"),
        ("onto marktstrasse", "onto Murfin"),
        ("go to 札幌通 now", "go to Upland now"),
        ("An St. Marien / Kirchplatz & Markt", "Draper"),
        ("the Loop, please", "the Baits, please"),
        ("take loop", "take Baits"),
        ("turn onto Park", "turn onto Hubbard"),
        ("left on elm", "left on Division"),
    ],
)
def test_titles_are_read_as_people_type_them(typed: str, read: str) -> None:
    assert TITLES.heard(typed) == read


@pytest.mark.parametrize(
    "text",
    [
        "park here",
        "Park at the KFC",
        "a loop",
        "on main",
        "that's the main thing",
        "the elm",
        "mainstream",
        "unmain st",
    ],
)
def test_ordinary_words_are_no_titles(text: str) -> None:
    assert TITLES.heard(text) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Turn left onto Beal Street, then Bishop.", "Turn left onto Rue de l'Église, then Main St."),
        ("Instruct(Street=Fuller)", "Instruct(Street=Martin Luther King Jr. Blvd)"),
        ("onto beale", "onto Rue de l'Église"),
        ("Hayward is closed", "Hayward is closed"),
        ("It's a bailout.", "It's a bailout."),
    ],
)
def test_titles_are_shown_for_names_of_the_session(text: str, shown: str) -> None:
    assert TITLES.shown(text) == shown


def test_what_is_shown_can_be_typed() -> None:
    for name, title in NAMED.items():
        assert TITLES.heard(f"turn onto {title}") == f"turn onto {name.label}"
        assert TITLES.shown(name.label) == title


def test_labels_are_titles_where_there_are_some() -> None:
    titles = StreetTitles([StreetName.BEAL, StreetName.UNKNOWN, StreetName.BAITS], ["Mill Road", "Far Road", ""])
    assert titles.labels(["Beal", "Unknown", "Baits"]) == ["Mill Road", "Far Road", "Baits"]
    assert titles.shown("Unknown street, Baits") == "Unknown street, Baits"
    assert titles.labels(["Beal"]) == ["Mill Road"]
    assert not NO_TITLES and NO_TITLES.labels(["Beal"]) == ["Beal"]
    assert NO_TITLES.heard("onto Main St") == "onto Main St" and NO_TITLES.shown("Beal") == "Beal"


def test_titles_are_copied_and_pickled() -> None:
    assert copy.deepcopy(TITLES) is TITLES
    assert pickle.loads(pickle.dumps(TITLES)).heard("onto Main St") == "onto Bishop"


def test_title_may_have_marks_of_patterns() -> None:
    titles = StreetTitles([StreetName.BEAL, StreetName.BAITS], ["A (old) [x] Road.*", "B+ Lane\\1"])
    assert titles.heard("onto B+ Lane\\1 now") == "onto Baits now"
    assert titles.shown("Beal") == "A (old) [x] Road.*"
