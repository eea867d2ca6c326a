"""Schema of the answers that are requested from a model, and the parser of an answer.

Every field is a text: one of a list of labels, which are made from the action space and its mask, or free words. The
same object writes the JSON schema and checks an answer, so that an answer that passes is an action inside the mask.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from dorothie_gym.dialogue.street_titles import NO_TITLES, StreetTitles
from dorothie_gym.errors import InputFileError, short_repr
from dorothie_gym.policies.language_model.faults import CallError, Fault
from dorothie_gym.session.spaces.fields import plain_text
from dorothie_gym.support.input_files import parse_json

MAX_ANSWER: Final = 20_000
"""Longest answer that is read [characters]."""

_FENCE: Final = re.compile(r"\A\s*```(?:json)?\s*(.*?)\s*```\s*\Z", re.DOTALL)
"""Code fence around an answer, which many models write unasked."""

_WORDS: Final = "[A-Za-z0-9 ,.?!':;()-]"
"""Characters of free words in the schema; an answer may contain others, which are replaced or dropped."""


@dataclass(frozen=True, kw_only=True)
class ChoiceField:
    """Field that takes one of the given labels; the first is the default of an answer without the field.

    Attributes:
        name: name of the field.
        labels: what it may be.
        meaning: meaning of the field.
        listed: where the labels of the moment are found, such as in the page; empty if they are always the same.
        values: value of each label, which an answer may have in its place; empty if each label is its value.
    """

    name: str
    labels: tuple[str, ...]
    meaning: str
    listed: str = ""
    values: tuple[str, ...] = ()

    @property
    def default(self) -> str:
        """Value of an answer that leaves the field out."""
        return (self.values or self.labels)[0]

    def schema(self) -> dict[str, Any]:
        """Returns the JSON schema of the field."""
        return {"type": "string", "enum": list(self.labels), "description": self.meaning}

    def shared_schema(self) -> dict[str, Any]:
        """Returns the JSON schema of the field for all turns: labels that change are described, not listed."""
        if not self.listed:
            return self.schema()
        return {"type": "string", "description": f"{self.meaning}: {self.listed}"}

    def read(self, value: object) -> str:
        """Returns the value; raises `CallError` if it is not one of the labels."""
        if value is None:
            return self.default
        if isinstance(value, str) and value in self.labels:
            return self.values[self.labels.index(value)] if self.values else value
        if isinstance(value, str) and value in self.values:
            return value
        shown = ", ".join(map(json.dumps, self.labels[:40]))
        raise CallError(Fault.WRONG_SCHEMA, f"{self.name} is {short_repr(value)}; it must be one of {shown}")


@dataclass(frozen=True, kw_only=True)
class WordsField:
    """Field of free words; longer texts are cut after a whole word, or within a word that is longer than the field.

    Attributes:
        name: name of the field.
        length: largest length [characters].
        meaning: meaning of the field.
        titles: names of the map for the streets, which become those of the session.
    """

    name: str
    length: int
    meaning: str
    titles: StreetTitles = NO_TITLES

    @property
    def default(self) -> str:
        """Value of an answer that leaves the field out."""
        return ""

    def schema(self) -> dict[str, Any]:
        """Returns the JSON schema of the field; a pattern limits the length, as not all endpoints know `maxLength`."""
        return {"type": "string", "pattern": f"^{_WORDS}{{0,{self.length}}}$", "description": self.meaning}

    def shared_schema(self) -> dict[str, Any]:
        """Returns the JSON schema of the field for all turns."""
        return self.schema()

    def read(self, value: object) -> str:
        """Returns the words in the characters of utterances; raises `CallError` if the value is not a text."""
        if value is None:
            return ""
        if not isinstance(value, str):
            raise CallError(Fault.WRONG_SCHEMA, f"{self.name} is {short_repr(value)}; it must be a text")
        words = " ".join(plain_text(self.titles.heard(" ".join(value.split())), MAX_ANSWER).split())
        if len(words) <= self.length:
            return words
        whole = words[: self.length + 1].rpartition(" ")[0]
        return whole or words[: self.length]


AnswerField = ChoiceField | WordsField


@dataclass(frozen=True, kw_only=True)
class AnswerSchema:
    """Fields of an answer, in order."""

    name: str
    fields: tuple[AnswerField, ...]

    def titled(self, titles: StreetTitles) -> AnswerSchema:
        """Returns the schema with the names of the map for the streets in its labels; `read` takes these names too."""
        return replace(self, fields=tuple(_titled(field, titles) for field in self.fields)) if titles else self

    def json_schema(self, *, shared: bool = False) -> dict[str, Any]:
        """Returns the JSON schema of an answer, which requires every field.

        Args:
            shared: whether it is the schema of all turns of the role, with which prompts can be cached. Choices that
                change are then free words in it, which `read` checks.
        """
        return {
            "type": "object",
            "properties": {field.name: field.shared_schema() if shared else field.schema() for field in self.fields},
            "required": [field.name for field in self.fields],
            "additionalProperties": False,
        }

    def response_format(self, *, shared: bool = False) -> dict[str, Any]:
        """Returns the request's `response_format`: a strict JSON schema; `shared` as in `json_schema`."""
        schema = self.json_schema(shared=shared)
        return {"type": "json_schema", "json_schema": {"name": self.name, "strict": True, "schema": schema}}

    def read(self, text: str) -> dict[str, str]:
        """Returns the value of each field of an answer.

        A code fence around the object is removed; fields that are missing or null have their defaults.

        Raises:
            CallError: it is not a JSON object, has no field of the schema or one that is unknown, or a value is not
                allowed.
        """
        fenced = _FENCE.match(text[:MAX_ANSWER])
        try:
            answer = parse_json(fenced[1] if fenced else text[:MAX_ANSWER], "the answer", line_breaks=True)
        except InputFileError as error:
            raise CallError(Fault.NOT_JSON, f"the answer is not JSON ({error.reason})") from None
        if not isinstance(answer, Mapping):
            raise CallError(Fault.NOT_JSON, "the answer is JSON, but no object")
        names = [field.name for field in self.fields]
        if unknown := [name for name in answer if name not in names]:
            raise CallError(
                Fault.WRONG_SCHEMA, f"there is no field {short_repr(unknown[0])}; the fields are {', '.join(names)}"
            )
        if not answer:
            raise CallError(Fault.WRONG_SCHEMA, f"the object is empty; the fields are {', '.join(names)}")
        return {field.name: field.read(answer.get(field.name)) for field in self.fields}


def _titled(field: AnswerField, titles: StreetTitles) -> AnswerField:
    if isinstance(field, WordsField):
        return replace(field, titles=titles)
    labels = tuple(titles.shown(label) for label in field.labels)
    return field if labels == field.labels else replace(field, labels=labels, values=field.labels)


def distinct(labels: Sequence[str]) -> tuple[str, ...]:
    """Returns labels without repetitions, in order."""
    return tuple(dict.fromkeys(labels))
