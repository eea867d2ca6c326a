"""`session.json`: header, outcome and counts of a session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dorothie_gym.sessions.encoding import canonical, decode_text, from_line, read_bytes, to_page, write_atomically
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.fields import Fields
from dorothie_gym.sessions.header import SessionHeader
from dorothie_gym.sessions.layout import (
    EVENTS_FILE,
    FRAMES_FILE,
    HEADER_FILE,
    JOURNAL_FILE,
    SUMMARY_FILE,
    TRAJECTORY_FILE,
    SessionState,
)


@dataclass(frozen=True, kw_only=True)
class SessionFile:
    """What the file says.

    Attributes:
        header: what was known before the session began.
        outcome: how it ended; None where it did not.
        events: number of events of a session that is over.
        frames: number of its frames.
    """

    header: SessionHeader
    outcome: Mapping[str, Any] | None = None
    events: int = 0
    frames: int = 0

    def write(self, folder: Path) -> None:
        """Writes the file whole or not at all; raises `SessionError` where the outcome is more than JSON."""
        over = self.outcome is not None
        page = {
            **self.header.to_json(),
            "outcome": canonical(self.outcome, "outcome") if over else None,
            "counts": {"events": self.events, "frames": self.frames} if over else None,
        }
        write_atomically(folder / HEADER_FILE, to_page(page))


def read_session_file(folder: Path) -> SessionFile:
    """Reads the file; raises `SessionError` naming file and field, and where there is none."""
    path = folder / HEADER_FILE
    if not path.is_file():
        raise SessionError(f"{folder}: no session here (there is no {HEADER_FILE})")
    fields = Fields(from_line(decode_text(read_bytes(path), str(path)), str(path)), str(path))
    header = SessionHeader.from_json(fields.others(("outcome", "counts")), str(path))
    outcome = fields.if_given("outcome", fields.mapping)
    if outcome is None:
        return SessionFile(header=header)
    counts = Fields(fields.mapping("counts"), f"{path}, counts")
    return SessionFile(
        header=header, outcome=outcome, events=counts.integer("events", 0), frames=counts.integer("frames", 0)
    )


def is_version1(folder: Path) -> bool:
    """Whether the folder has the files of version 1 and none of today's."""
    ours = any((folder / name).exists() for name in (FRAMES_FILE, JOURNAL_FILE))
    return not ours and any((folder / name).exists() for name in (TRAJECTORY_FILE, SUMMARY_FILE))


def session_state(folder: Path | str) -> SessionState:
    """Returns how far a folder has come; a session that is finished was written whole.

    Raises:
        SessionError: the header is damaged.
    """
    folder = Path(folder)
    if not (folder / HEADER_FILE).is_file():
        return SessionState.ABSENT
    if is_version1(folder):
        return SessionState.FINISHED if (folder / SUMMARY_FILE).is_file() else SessionState.PARTIAL
    whole = all((folder / name).is_file() for name in (EVENTS_FILE, FRAMES_FILE))
    over = read_session_file(folder).outcome is not None
    return SessionState.FINISHED if whole and over else SessionState.PARTIAL
