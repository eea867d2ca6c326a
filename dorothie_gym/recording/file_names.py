"""Names of the files in the folder of a session, and how far a folder has come."""

from __future__ import annotations

import enum
import re
from typing import Final

HEADER_FILE: Final = "session.json"
"""Header, outcome, counts and version: written whole when the session begins, and again when it is over."""

EVENTS_FILE: Final = "events.jsonl"
"""One event a line, appended as they happen."""

ACTIONS_FILE: Final = "actions.jsonl"
"""What the roles decided, one decision a line, those left out in which nobody did anything."""

FRAMES_FILE: Final = "frames.parquet"
"""One row a frame, written whole when the session is over."""

JOURNAL_FILE: Final = "frames.journal"
"""What `FRAMES_FILE` is made of, appended as it happens; gone when the session is over."""

PICTURES_FOLDER: Final = "pictures"
"""Optional pictures, `<frame>.png`."""

SESSION_FILES: Final = (HEADER_FILE, EVENTS_FILE, ACTIONS_FILE, FRAMES_FILE, JOURNAL_FILE)

MAX_EVENTS: Final = 200_000
"""Events that a session may have; 15 minutes of three roles that act at 2 Hz give some 5,000."""

MAX_FRAMES: Final = 1_000_000
"""Frames that a session may have: 9 hours at 30 Hz."""

MAX_FRAME: Final = 2**31
"""Numbers of frames are below this."""

MAX_TEXT_FILE: Final = 128 * 2**20
"""Bytes of the largest JSON or CSV file that is read."""

MAX_FRAMES_FILE: Final = 2**30
"""Bytes of the largest frames file, unpacked, and of the largest journal, that is read."""

_NAME: Final = re.compile(r"[^\w.+-]+")


class SessionState(enum.StrEnum):
    """How far the folder of a session has come."""

    ABSENT = "absent"
    """No session, or one that died before its header was written."""
    PARTIAL = "partial"
    """Begun and not finished: it loads up to what was complete when it was cut off."""
    FINISHED = "finished"
    """Written to its end."""


def safe_name(text: str) -> str:
    """Returns `text` as the name of one file or folder: no separators, no leading dot, at most 100 characters."""
    return _NAME.sub("_", text).lstrip(".")[:100] or "session"
