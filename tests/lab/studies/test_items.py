"""Answers to the items of questionnaires."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.lab.studies.items import AnswerError, Choice, Item, Likert, Number, Text, check_answers

ITEMS: dict[str, Item] = {
    "rating": Likert(id="rating", text="?", points=5),
    "one": Choice(id="one", text="?", options=["red", "blue"]),
    "many": Choice(id="many", text="?", options=["red", "blue"], several=True, required=False),
    "age": Number(id="age", text="?", min=18, max=99),
    "share": Number(id="share", text="?", min=0, max=1, whole=False),
    "words": Text(id="words", text="?", max_length=10),
}


def check(name: str, answer: Any) -> Any:
    return check_answers([ITEMS[name]], {name: answer})[name]


@pytest.mark.parametrize(
    ("name", "answer", "kept"),
    [
        ("rating", 5, 5), ("one", "blue", "blue"), ("many", ["blue", "red"], ["red", "blue"]), ("many", [], None),
        ("age", 18.0, 18), ("share", 0.25, 0.25), ("words", "  hello ", "hello"), ("many", None, None),
    ],
)  # fmt: skip
def test_allowed_answers_are_kept(name: str, answer: Any, kept: Any) -> None:
    assert check(name, answer) == kept


@pytest.mark.parametrize(
    ("name", "answer", "message"),
    [
        ("rating", 6, "in 1..5"), ("rating", True, "in 1..5"), ("rating", "5", "in 1..5"), ("rating", 2.5, "in 1..5"),
        ("one", "green", "one of its options"), ("one", ["red"], "one of its options"), ("many", "red", "a list"),
        ("age", 17, "in 18..99"), ("age", 20.5, "a whole number"), ("age", float("nan"), "a number"),
        ("age", True, "a number"),
        ("share", "0.5", "a number"), ("words", "a" * 11, "at most 10"), ("words", 4, "at most 10"),
        ("words", "   ", "must be answered"), ("rating", None, "must be answered"),
    ],
)  # fmt: skip
def test_other_answers_are_refused_by_the_name_of_the_item(name: str, answer: Any, message: str) -> None:
    with pytest.raises(AnswerError, match=message) as caught:
        check(name, answer)
    assert repr(name) in str(caught.value)


def test_answers_to_unknown_items_are_refused() -> None:
    with pytest.raises(AnswerError, match="no item 'other'"):
        check_answers([ITEMS["rating"]], {"rating": 3, "other": 1})


ANY = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.text())


@given(st.sampled_from(sorted(ITEMS)), ANY)
def test_any_answer_is_kept_or_refused(name: str, answer: Any) -> None:
    try:
        kept = check(name, answer)
    except AnswerError:
        return
    assert check(name, kept) == kept
