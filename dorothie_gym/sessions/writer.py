"""Writing a session while it happens."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from io import TextIOWrapper
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.sessions.encoding import canonical, to_line, write_atomically
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.event_lines import encode_event
from dorothie_gym.sessions.events import Event
from dorothie_gym.sessions.header import SessionHeader
from dorothie_gym.sessions.layout import EVENTS_FILE, HEADER_FILE, SESSION_FILES, SUMMARY_FILE, TRAJECTORY_FILE
from dorothie_gym.sessions.trajectory import TRAJECTORY_HEADER, encode_rows, trajectory_of


class SessionWriter:
    """Appends events and frames to the folder of a session; what was appended survives the death of the process.

    Args:
        folder: folder of the session, made if need be.
        header: what is known of the session before it begins.
        overwrite: whether a session that the folder holds already is deleted.

    Raises:
        SessionError: the folder holds a session already and `overwrite` is False.
    """

    def __init__(self, folder: Path | str, header: SessionHeader, *, overwrite: bool = False) -> None:
        self.folder = Path(folder)
        self._prepare(overwrite)
        write_atomically(self.folder / HEADER_FILE, to_line(header.to_json()) + "\n")
        self._events = self._open(EVENTS_FILE)
        self._trajectory = self._open(TRAJECTORY_FILE)
        self._trajectory.write(TRAJECTORY_HEADER + "\n")
        self._trajectory.flush()
        self._event_count = 0
        self._frame_count = 0
        self._last_frame = -1

    def append(self, events: Iterable[Event] = (), frames: NDArray[np.float64] | None = None) -> None:
        """Appends a batch and hands it to the operating system.

        Args:
            events: what happened.
            frames: (n, 9) float64, see `TRAJECTORY_COLUMNS`; frames must rise.

        Raises:
            SessionError: an event or a row cannot be written; nothing of the batch is then.
        """
        if self._events.closed:
            raise SessionError(f"{self.folder}: the session is closed; nothing can be appended")
        lines = [encode_event(event) for event in events]
        rows = self._encode(frames) if frames is not None else []
        for file, batch in ((self._events, lines), (self._trajectory, rows)):
            if batch:
                file.write("\n".join(batch) + "\n")
                file.flush()
        self._event_count += len(lines)
        self._frame_count += len(rows)

    def finish(self, summary: Mapping[str, Any]) -> None:
        """Writes how the session ended, which makes it complete, and closes it.

        Raises:
            SessionError: the summary holds what JSON cannot, or the session is closed already.
        """
        if self._events.closed:
            raise SessionError(f"{self.folder}: the session is closed; it cannot be finished")
        ending = {
            "events": self._event_count,
            "frames": self._frame_count,
            "summary": canonical(summary, "summary"),
        }
        self.close()
        write_atomically(self.folder / SUMMARY_FILE, to_line(ending) + "\n")

    def close(self) -> None:
        """Closes the files; a session that was not finished stays incomplete. May be called again."""
        self._events.close()
        self._trajectory.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _prepare(self, overwrite: bool) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        present = [name for name in SESSION_FILES if (self.folder / name).exists()]
        if present and not overwrite:
            raise SessionError(
                f"{self.folder}: holds a session already ({', '.join(present)}); choose another folder or overwrite it"
            )
        # The header goes first: from then on, whenever the process dies, the folder holds no session with parts of two.
        for name in present:
            (self.folder / name).unlink()

    def _open(self, name: str) -> TextIOWrapper:
        return (self.folder / name).open("w", encoding="utf-8", newline="\n")

    def _encode(self, frames: NDArray[np.float64]) -> list[str]:
        trajectory = trajectory_of(frames)
        numbers = trajectory["frame"]
        if len(numbers) == 0:
            return []
        if np.any(np.diff(numbers, prepend=self._last_frame) <= 0):
            raise SessionError(
                f"{self.folder}: frames {numbers.tolist()} after {self._last_frame}; each must be above the one before"
            )
        self._last_frame = int(numbers[-1])
        return encode_rows(trajectory)
