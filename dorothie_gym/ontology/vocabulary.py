"""Closed vocabularies: labelled enums, look-up of spellings, and the error for unknown ones."""

from __future__ import annotations

import difflib
import functools
import unicodedata
from collections.abc import Iterable, Mapping
from enum import IntEnum
from types import MappingProxyType
from typing import Generic, Self, TypeVar

LONGEST = 80
"""So many letters of a text that is unknown are looked at and shown: texts come from files of others."""


class OntologyError(ValueError):
    """A text, number or combination that the closed vocabularies do not contain."""

    @classmethod
    def unknown(cls, text: object, vocabulary: str, known: Iterable[str]) -> OntologyError:
        """Returns the error for `text`, naming the vocabulary and the nearest of the `known` spellings."""
        spellings = tuple(known)
        if not isinstance(text, str):
            return cls(f"{vocabulary}: expected a text, got {_shown(repr(text))} of type {type(text).__name__}")
        # cutoff 0: a far guess still shows the reader what the spellings of this vocabulary look like.
        nearest = _nearest(text[:LONGEST].lower(), spellings)
        hint = f"; the nearest known spelling is {nearest!r}" if nearest is not None else ""
        return cls(f"{vocabulary}: {_shown(repr(text))} is unknown{hint}")


@functools.lru_cache(maxsize=1024)
def _nearest(text: str, spellings: tuple[str, ...]) -> str | None:
    """Returns the spelling nearest to a text in lower case; kept, since a file has the same mistake many times."""
    by_lower = {spelling.lower(): spelling for spelling in spellings}
    nearest = difflib.get_close_matches(text, by_lower, n=1, cutoff=0.0)
    return by_lower[nearest[0]] if nearest else None


def _shown(text: str) -> str:
    return text if len(text) <= LONGEST + 2 else f"{text[:LONGEST]}..."


class LabelledInt(IntEnum):
    """An integer enum whose members are written `NAME = id, "Label"`.

    Attributes:
        label: the spelling in files, tables and SDN.
    """

    label: str

    # The default is never used by a member: it lets type checkers accept the look-up by number, `Enum(3)`.
    def __new__(cls, value: int, label: str = "") -> Self:
        """Makes a member from its number and its spelling."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.label = label
        return member


Member_co = TypeVar("Member_co", covariant=True)


def normalise(text: str) -> str:
    """Returns what is left of `text` when case, spaces and punctuation do not count."""
    return "".join(char for char in unicodedata.normalize("NFKC", text).casefold() if char.isalnum())


class Vocabulary(Generic[Member_co]):
    """The spellings of a closed set of members.

    Case, spaces, underscores and punctuation do not count, so "Seven Eleven" is "SevenEleven" and "Jturn" is "JTurn".

    Args:
        name: what the members are, for error messages ("dialogue move").
        spellings: pairs of a spelling and its member; a member may have several.

    Raises:
        OntologyError: one spelling is given to two members, or has no letter and no digit.
    """

    def __init__(self, name: str, spellings: Iterable[tuple[str, Member_co]]) -> None:
        self.name = name
        members: dict[str, Member_co] = {}
        written: dict[str, str] = {}
        for spelling, member in spellings:
            key = normalise(spelling)
            if not key:
                raise OntologyError(f"{name}: the spelling {spelling!r} has no letter and no digit")
            if members.setdefault(key, member) is not member:
                raise OntologyError(f"{name}: the spelling {spelling!r} belongs to {members[key]!r} and to {member!r}")
            written.setdefault(key, spelling)
        self._members = members
        self._written = written

    @property
    def spellings(self) -> Mapping[str, Member_co]:
        """Every known spelling, as written, and its member."""
        return MappingProxyType({self._written[key]: member for key, member in self._members.items()})

    def parse(self, text: str) -> Member_co:
        """Returns the member that `text` spells.

        Raises:
            OntologyError: `text` spells no member; the message names the nearest spelling.
        """
        if isinstance(text, str):
            member = self._members.get(normalise(text))
            if member is not None:
                return member
        raise OntologyError.unknown(text, self.name, self._written.values())
