"""Record of a session with people: the normal recording of the session, and the log of the seats."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dorothie_gym.lab.console.recordings import SpanRecordings
from dorothie_gym.session.recorder import SessionRecorder
from dorothie_gym.session.recording.seat_log import SeatEvent, SeatLogWriter
from dorothie_gym.session.recording.writer import SessionWriter

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.recording.header import SessionHeader
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.spaces.actions import AnyAction


class RoomRecord:
    """Recording of a session in progress; recorded data survive a crash of the process.

    Args:
        engine: an engine that has just been reset.
        header: header of the session.
        folder: new folder of the session.

    Attributes:
        folder: see above.

    Raises:
        SessionError: the folder holds a session.
        OSError: the folder cannot be written.
    """

    def __init__(self, engine: SessionEngine, header: SessionHeader, folder: Path) -> None:
        self.folder, self._engine = folder, engine
        self._writer = SessionWriter(folder, header)
        self._recorder = SessionRecorder(engine, self._writer)
        self._log = SeatLogWriter(folder)
        self._spans = SpanRecordings()
        self._audio: set[str] = set()
        self._open = threading.Lock()  # audio comes from another thread
        self._closed = False

    def say(self, role: Role, text: str, audio: str | None) -> None:
        """Records that a person says a span at the current decision.

        Args:
            role: speaker.
            text: words.
            audio: name of the recording of its turn; None for a typed one.
        """
        self._spans.say(role, text, audio)

    def record(self, actions: Mapping[str, AnyAction]) -> None:
        """Records a decision after the engine has played it."""
        self._recorder.record(actions, self._spans.named(self._engine.last_events))

    def note(self, events: Sequence[SeatEvent]) -> None:
        """Records events at the seats."""
        for event in events:
            self._log.append(event)

    def add_audio(self, seat: str, flac: bytes) -> str | None:
        """Records a spoken turn (FLAC); other threads may call it.

        Returns:
            The name of its file; None if the record is closed.
        """
        with self._open:
            if self._closed:
                return None
            number = 1 + len(self._audio)
            while (name := f"{seat}_{number}.flac") in self._audio:
                number += 1
            self._add(name, flac)
        return name

    def adopt_audio(self, audio: Mapping[str, Path]) -> None:
        """Copies the recordings of the interrupted session that this one resumes, by name."""
        with self._open:
            for name, path in audio.items():
                self._add(name, path.read_bytes())

    def _add(self, name: str, flac: bytes) -> None:
        self._writer.add_audio(name, flac)
        self._audio.add(name)

    def finish(self, *, broken_off: bool) -> None:
        """Closes the record of a session that has ended.

        Args:
            broken_off: whether it was broken off after the last decision, so that its end is not recorded yet.
        """
        with self._open:
            self._closed = True
        if broken_off:
            self._recorder.record_end()
        self._log.close()  # before the session counts as finished
        self._writer.finish(self._engine.summary())

    def close(self) -> None:
        """Closes the record of a session that is not over; it stays incomplete."""
        with self._open:
            self._closed = True
        try:
            self._writer.close()
        finally:
            self._log.close()


def free_folder(parent: Path, name: str) -> Path:
    """Returns the first folder that does not exist among those with a name, or the name and a number."""
    folder, number = parent / name, 2
    while folder.exists():
        folder, number = parent / f"{name}_{number}", number + 1
    return folder
