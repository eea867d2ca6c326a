"""Record of a session with people: the session itself as everywhere, and the log of the seats beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from dorothie_gym.engine.recorder import SessionRecorder
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.recording import SeatEvent, SeatLogWriter, SessionHeader, SessionWriter
from dorothie_gym.spaces import ActionMapping


class RoomRecord:
    """Record of a session in progress; what was recorded survives the death of the process.

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
        self._recordings = 0

    def record(self, actions: Mapping[str, ActionMapping]) -> None:
        """Records a decision after the engine has played it."""
        self._recorder.record(actions)

    def note(self, events: Sequence[SeatEvent]) -> None:
        """Records events at the seats."""
        for event in events:
            self._log.append(event)

    def add_audio(self, seat: str, flac: bytes) -> str:
        """Records a spoken turn (FLAC), and returns the name of its file; other threads may call it, one at a time."""
        self._recordings += 1
        name = f"{seat}_{self._recordings}.flac"
        self._writer.add_audio(name, flac)
        return name

    def finish(self, *, broken_off: bool) -> None:
        """Closes the record of a session that is over.

        Args:
            broken_off: whether it was broken off after the last decision, so that its end is not recorded yet.
        """
        if broken_off:
            self._recorder.record_end()
        self._writer.finish(self._engine.summary())
        self._log.close()

    def close(self) -> None:
        """Closes the record of a session that is not over; it stays incomplete."""
        self._writer.close()
        self._log.close()


def free_folder(parent: Path, name: str) -> Path:
    """Returns the first folder of a name, or of the name with a number, that does not exist."""
    folder, number = parent / name, 2
    while folder.exists():
        folder, number = parent / f"{name}_{number}", number + 1
    return folder
