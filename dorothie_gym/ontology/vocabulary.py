"""Looking a spelling up in a closed vocabulary."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Generic, TypeVar

from dorothie_gym.ontology.errors import OntologyError

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
