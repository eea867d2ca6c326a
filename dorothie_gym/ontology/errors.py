"""The one error of the ontology."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class OntologyError(ValueError):
    """A text, number or combination that the closed vocabularies do not contain."""

    @classmethod
    def unknown(cls, text: object, vocabulary: str, known: Iterable[str]) -> OntologyError:
        """Returns the error for `text`, naming the vocabulary and the nearest of the `known` spellings."""
        spellings = tuple(known)
        if not isinstance(text, str):
            return cls(f"{vocabulary}: expected a text, got {text!r} of type {type(text).__name__}")
        # cutoff 0: a far guess still shows the reader what the spellings of this vocabulary look like.
        by_lower = {spelling.lower(): spelling for spelling in spellings}
        nearest = difflib.get_close_matches(text.lower(), by_lower, n=1, cutoff=0.0)
        hint = f"; the nearest known spelling is {by_lower[nearest[0]]!r}" if nearest else ""
        return cls(f"{vocabulary}: {text!r} is unknown{hint}")
