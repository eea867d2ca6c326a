"""File names and size limits of a session folder."""

from __future__ import annotations

import enum
import re
from typing import Final

HEADER_FILE: Final = "session.json"
"""Header, outcome, counts and version; written when the session begins, and again when it ends."""

EVENTS_FILE: Final = "events.jsonl"
"""One event per line, appended during the session."""

ACTIONS_FILE: Final = "actions.jsonl"
"""One decision of the roles per line; decisions without an action are left out."""

SEATS_FILE: Final = "seats.jsonl"
"""One event at the seats of people per line; absent from sessions without people."""

FRAMES_FILE: Final = "frames.parquet"
"""One row per frame, written when the session ends."""

JOURNAL_FILE: Final = "frames.journal"
"""Binary log of the frames, appended during the session; converted into `FRAMES_FILE` when it ends."""

PICTURES_FOLDER: Final = "pictures"
"""Optional pictures, `<frame>.png`."""

AUDIO_FOLDER: Final = "utterance"
"""Optional audio of dialogue moves, as their field `audio` names it; the folder of SDN's layout."""

ANNOTATIONS_FOLDER: Final = "annotations"
"""Optional logs of annotators (`dorothie_gym.lab.annotation`), which are not part of the session."""

SESSION_FILES: Final = (HEADER_FILE, EVENTS_FILE, ACTIONS_FILE, SEATS_FILE, FRAMES_FILE, JOURNAL_FILE)

MAX_EVENTS: Final = 200_000
"""Most events of a session; 15 minutes of three roles acting at 2 Hz give some 5,000."""

MAX_MOVES: Final = 10_000
"""Most dialogue moves of a session; 15 minutes have some 300."""

MAX_EXCEPTIONS: Final = 500
"""Most exceptions of a session; most sessions have up to 4."""

MAX_FRAMES: Final = 1_000_000
"""Most frames of a session: 9 hours at 30 Hz."""

MAX_FRAME: Final = 2**31
"""Bound of frame numbers."""

MAX_FRAMES_FILE: Final = 2**28
"""Largest uncompressed frames file, and largest journal, that is read [bytes]; a session of 15 minutes takes 16 MB."""

_NAME: Final = re.compile(r"[^\w.+-]+")


class SessionState(enum.StrEnum):
    """State of a session folder."""

    ABSENT = "absent"
    """No session, or one whose process died before the header was written."""
    PARTIAL = "partial"
    """Interrupted session, which loads up to the last complete event and frame."""
    FINISHED = "finished"
    """Complete session."""


def safe_name(text: str) -> str:
    """Returns `text` as the name of a file or folder: no separators, no leading dot, at most 100 characters."""
    return _NAME.sub("_", text).lstrip(".")[:100] or "session"
