"""Labelled enums, look-up of spellings in closed vocabularies, and the error for unknown spellings."""

from __future__ import annotations

import difflib
import functools
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Generic, Self, TypeVar

from dorothie_gym.errors import OntologyError

LONGEST = 80
"""Longest prefix of an unknown text that is compared and shown [characters]; files may contain any text."""


@functools.lru_cache(maxsize=1024)
def _nearest(text: str, spellings: tuple[str, ...]) -> str | None:
    """Returns the spelling nearest to a lower-case text; cached, since files repeat the same mistake."""
    by_lower = {spelling.lower(): spelling for spelling in spellings}
    nearest = difflib.get_close_matches(text, by_lower, n=1, cutoff=0.0)
    return by_lower[nearest[0]] if nearest else None


def _shown(text: str) -> str:
    return text if len(text) <= LONGEST + 2 else f"{text[:LONGEST]}..."


def unknown_spelling(text: object, vocabulary: str, known: Iterable[str]) -> OntologyError:
    """Returns the error for `text`, naming the vocabulary and the nearest of the `known` spellings."""
    spellings = tuple(known)
    if not isinstance(text, str):
        return OntologyError(f"{vocabulary}: expected a text, got {_shown(repr(text))} of type {type(text).__name__}")
    # cutoff 0: even a distant guess shows the spelling of this vocabulary.
    nearest = _nearest(text[:LONGEST].lower(), spellings)
    hint = f"; the nearest known spelling is {nearest!r}" if nearest is not None else ""
    return OntologyError(f"{vocabulary}: {_shown(repr(text))} is unknown{hint}")


Key = TypeVar("Key", bound=Enum)
Entry = TypeVar("Entry")


def check_complete(found: Collection[Key], members: Iterable[Key], table: str, module: str) -> None:
    """Checks, when a module is imported, that its table knows every member of a vocabulary.

    Args:
        found: members that the table knows.
        members: the vocabulary.
        table: name of the table, for the message.
        module: `__name__` of the module in which the table is written.

    Raises:
        OntologyError: a member is missing; names the table, its file and what it lacks.
    """
    missing = [f"{type(member).__name__}.{member.name}" for member in members if member not in found]
    if missing:
        raise OntologyError(
            f"{table} of {module.replace('.', '/')}.py has no entry for {', '.join(missing)}; every member needs one "
            "(docs/changes.md lists the files)"
        )


def complete(entries: Mapping[Key, Entry], members: Iterable[Key], table: str, module: str) -> Mapping[Key, Entry]:
    """Returns a table, for reading, after `check_complete`; arguments and errors are its."""
    check_complete(entries, members, table, module)
    return MappingProxyType(dict(entries))


class LabelledInt(IntEnum):
    """Integer enum with a label; members are written `NAME = id, "Label"`.

    Attributes:
        label: spelling in files, tables and SDN.
    """

    label: str

    # No member uses the default: it lets type checkers accept the look-up by number, `Enum(3)`.
    def __new__(cls, value: int, label: str = "") -> Self:
        """Creates a member from its number and its label."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.label = label
        return member


Member_co = TypeVar("Member_co", covariant=True)


def normalise(text: str) -> str:
    """Returns `text` in lower case without spaces and punctuation."""
    return "".join(char for char in unicodedata.normalize("NFKC", text).casefold() if char.isalnum())


class Vocabulary(Generic[Member_co]):
    """Spellings of a closed set of members.

    Case, spaces, underscores and punctuation are ignored: "Seven Eleven" equals "SevenEleven", "Jturn" equals "JTurn".

    Args:
        name: kind of the members in error messages ("dialogue move").
        spellings: pairs of a spelling and its member; a member may have several spellings.

    Raises:
        OntologyError: if two members share a spelling, or if a spelling has neither letters nor digits.
    """

    def __init__(self, name: str, spellings: Iterable[tuple[str, Member_co]]) -> None:
        self.name = name
        members: dict[str, Member_co] = {}
        written: dict[str, str] = {}
        for spelling, member in spellings:
            key = normalise(spelling)
            if not key:
                raise OntologyError(f"{name}: the spelling {spelling!r} has neither letters nor digits")
            if members.setdefault(key, member) is not member:
                raise OntologyError(f"{name}: the spelling {spelling!r} belongs to {members[key]!r} and to {member!r}")
            written.setdefault(key, spelling)
        self._members = members
        self._written = written

    @property
    def spellings(self) -> Mapping[str, Member_co]:
        """Known spellings, as written, with their members."""
        return MappingProxyType({self._written[key]: member for key, member in self._members.items()})

    def parse(self, text: str) -> Member_co:
        """Returns the member that `text` spells.

        Raises:
            OntologyError: if `text` spells no member; the message names the nearest spelling.
        """
        if isinstance(text, str):
            member = self._members.get(normalise(text))
            if member is not None:
                return member
        raise unknown_spelling(text, self.name, self._written.values())
