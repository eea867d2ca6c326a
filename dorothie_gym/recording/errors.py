"""The one error of sessions."""

from __future__ import annotations

from reprlib import Repr
from typing import Final

LONGEST: Final = 120
"""Letters of a value that a message shows."""


class SessionError(ValueError):
    """A session that cannot be written or read; the message names the file, the line and the field."""


class _Short(Repr):
    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = self.maxlong = LONGEST


def shown(value: object) -> str:
    """Returns a wrong value as a message shows it, which it must not flood."""
    text = _Short().repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
