"""Numbers of the ids in an OpenDRIVE file, which are text in the standard (1.4 to 1.8: xs:string)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import count

# Largest magnitude of an id that keeps its number: the arrays of the simulation hold 32 bits. Ids beyond it get a
# number like those that are text.
MAX_ID = 2**31 - 1

_WHOLE_NUMBER = re.compile(r"\s*[+-]?[0-9]{1,13}\s*")


class IdNumbers:
    """Numbers of all ids of one kind of element: numeric ids keep theirs, others follow in the order of the file.

    Args:
        texts: ids in the order of the file; repeated ones count once.
    """

    def __init__(self, texts: Iterable[str]) -> None:
        self._numbers: dict[str, int] = {}
        rest = []
        used: set[int] = set()
        for text in dict.fromkeys(texts):
            number = plain_number(text)
            if number is None or number in used:
                rest.append(text)
            else:
                self._numbers[text] = number
                used.add(number)
        free = max(0, max(used, default=-1) + 1)
        unused = count(free if free + len(rest) <= MAX_ID else 0)
        self.renamed = dict(zip(rest, (number for number in unused if number not in used), strict=False))
        """Numbers of the ids that are no whole numbers, or too large."""
        self._numbers |= self.renamed
        self._kept = frozenset(used)

    def get(self, text: str) -> int | None:
        """Returns the number of an id, or None if no element has it."""
        number = self._numbers.get(text)
        if number is None and (value := plain_number(text)) is not None:  # "07" refers to road 7
            number = value if value in self._kept else None
        return number


def plain_number(text: str) -> int | None:
    """Returns the number that an id states, or None for other texts and numbers beyond `MAX_ID`."""
    if not _WHOLE_NUMBER.fullmatch(text):
        return None
    value = int(text)
    return value if abs(value) <= MAX_ID else None
