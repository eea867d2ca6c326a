"""Items of questionnaires, and the check of their answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Final, TypeAlias, get_args

from msgspec import Meta, Struct

from dorothie_gym.errors import DorothieGymError, short_repr

Identifier: TypeAlias = Annotated[
    str, Meta(pattern=r"^[a-z][a-z0-9_]{0,39}$", description="lower-case letters, digits and _, at most 40")
]
Question: TypeAlias = Annotated[str, Meta(min_length=1, max_length=1000)]
Label: TypeAlias = Annotated[str, Meta(min_length=1, max_length=200)]

Answer: TypeAlias = str | int | float | list[str] | None
"""Answer to an item: number of a point (Likert), option, options, number, or text; None if it is left out."""

MAX_TEXT: Final = 4000
"""Longest text of an answer [characters]."""


class AnswerError(DorothieGymError, ValueError):
    """An answer is missing or not one of those that its item allows."""


class _Item(Struct, tag_field="kind", forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Item of a questionnaire.

    Attributes:
        id: name of its column in exports.
        text: the question.
        required: whether it must be answered.
    """

    id: Identifier
    text: Question
    required: bool = True

    def accept(self, answer: Answer) -> Answer:
        """Returns an answer, which is not empty, as it is stored.

        Raises:
            AnswerError: the item does not allow it.
        """
        raise NotImplementedError


class Likert(_Item, tag="likert", frozen=True, kw_only=True):
    """Rating from 1 to `points`; `low` and `high` label the ends."""

    points: Annotated[int, Meta(ge=2, le=11)] = 7
    low: Label = "strongly disagree"
    high: Label = "strongly agree"

    def accept(self, answer: Answer) -> Answer:
        """Returns the number of a point; see `_Item.accept`."""
        if type(answer) is not int or not 1 <= answer <= self.points:
            raise AnswerError(f"item {self.id!r} takes a whole number in 1..{self.points}")
        return answer


class Choice(_Item, tag="choice", frozen=True, kw_only=True):
    """One of the options, or any number of them if `several`."""

    options: Annotated[list[Label], Meta(min_length=2, max_length=40)]
    several: bool = False

    def accept(self, answer: Answer) -> Answer:
        """Returns the option, or the options in their order; see `_Item.accept`."""
        chosen = answer if isinstance(answer, list) else [answer]
        if isinstance(answer, list) is not self.several or any(each not in self.options for each in chosen):
            expected = "a list of its options" if self.several else "one of its options"
            raise AnswerError(f"item {self.id!r} takes {expected}")
        return [option for option in self.options if option in chosen] if self.several else answer


class Number(_Item, tag="number", frozen=True, kw_only=True):
    """Number from `min` to `max`; a whole one if `whole`."""

    min: float = 0.0
    max: float = 1e6
    whole: bool = True

    def accept(self, answer: Answer) -> Answer:
        """Returns the number; see `_Item.accept`."""
        if isinstance(answer, str | list | bool) or answer is None or not math.isfinite(answer):
            raise AnswerError(f"item {self.id!r} takes a number")
        if not self.min <= answer <= self.max or (self.whole and answer != int(answer)):
            kind = "a whole number" if self.whole else "a number"
            raise AnswerError(f"item {self.id!r} takes {kind} in {self.min:g}..{self.max:g}")
        return int(answer) if self.whole else float(answer)


class Text(_Item, tag="text", frozen=True, kw_only=True):
    """Text of at most `max_length` characters; `long` gives several lines."""

    max_length: Annotated[int, Meta(ge=1, le=MAX_TEXT)] = 1000
    long: bool = False

    def accept(self, answer: Answer) -> Answer:
        """Returns the text; see `_Item.accept`."""
        if not isinstance(answer, str) or len(answer) > self.max_length:
            raise AnswerError(f"item {self.id!r} takes a text of at most {self.max_length} characters")
        return answer


Item: TypeAlias = Likert | Choice | Number | Text
"""All items; `static/forms.js` shows them."""

for _kind in get_args(Item):
    if _kind.accept is _Item.accept:
        raise NotImplementedError(
            f"{_kind.__name__} of {__name__.replace('.', '/')}.py lacks `accept`, which says what answers it allows"
        )


def check_answers(items: Sequence[Item], answers: Mapping[str, Answer]) -> dict[str, Answer]:
    """Returns the answers to the items in their order; items that are left out have None.

    Args:
        items: items of the questionnaire.
        answers: answers by id.

    Raises:
        AnswerError: an answer is missing, not allowed, or of no item; the message names the item.
    """
    known = {item.id for item in items}
    if unknown := next((name for name in answers if name not in known), None):
        raise AnswerError(f"there is no item {short_repr(unknown)}")
    return {item.id: _checked(item, answers.get(item.id)) for item in items}


def _checked(item: Item, answer: Answer) -> Answer:
    if isinstance(answer, str):
        answer = answer.strip()
    if answer is None or answer in ("", []):
        if item.required:
            raise AnswerError(f"item {item.id!r} must be answered")
        return None
    return item.accept(answer)
