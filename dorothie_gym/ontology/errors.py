"""The one error of the ontology."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterable

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
