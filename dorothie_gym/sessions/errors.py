"""The one error of sessions."""

from __future__ import annotations


class SessionError(ValueError):
    """A session that cannot be written or read; the message names the file, the line and the field."""
