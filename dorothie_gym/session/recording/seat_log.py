"""Log of the people at the seats of a session (`seats.jsonl`): arrivals, departures, pauses, and typed text.

A replay does not use this log: the actions of people are in the log of actions. Times are frames of the
session; it has no dates and no names of people.
"""

from __future__ import annotations

import enum
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.recording.files import (
    MAX_EVENTS,
    MAX_FRAME,
    SEATS_FILE,
    Fields,
    canonical_object,
    from_line,
    read_lines,
    to_line,
)


class SeatEventKind(enum.StrEnum):
    """Kinds of events at the seats, with the fields of their `data`."""

    JOINED = "joined"
    """A person sat down, or came back: seconds (of absence; null for the first time)."""
    LEFT = "left"
    """The connection of a person ended."""
    TAKEN_OVER = "taken over"
    """A policy takes over the seat: policy (its name)."""
    PAUSED = "paused"
    """The clock of the session stopped: reason ("experimenter", or "absence")."""
    RESUMED = "resumed"
    """The clock runs again: seconds (of the pause)."""
    SAID = "said"
    """A person typed a span: text, move, slots (the act that was spoken), source ("classifier", or "speaker" where the
    person corrected the act), guess (move and slots of the classifier); audio (name of the recording of the turn in the
    session's folder `utterance`) of one that was spoken."""
    CORRECTED = "corrected"
    """A person corrected the act of a span after it was spoken: utterance (number), span (index), move, slots."""
    ANNOUNCED = "announced"
    """The experimenter sent a message to all seats: text."""


@dataclass(frozen=True, kw_only=True)
class SeatEvent:
    """Event at a seat.

    Attributes:
        frame: physics frame at 30 Hz.
        kind: kind of the event.
        role: role of the seat; None for events of the whole session.
        data: details, see `SeatEventKind` (JSON types).
    """

    frame: int
    kind: SeatEventKind
    role: Role | None = None
    data: Mapping[str, object] = field(default_factory=dict)


_KINDS: Final = {kind.value: kind for kind in SeatEventKind}
_ROLES: Final = {role.value: role for role in AGENT_ROLES}


def encode_seat_event(event: SeatEvent) -> str:
    """Returns the event as JSON on one line; raises `SessionError` if its data holds other types than JSON's."""
    where = f"seat event {event.kind.value} at frame {event.frame}"
    if not 0 <= event.frame < MAX_FRAME:
        raise SessionError(f"{where}: frames are in 0..{MAX_FRAME - 1}")
    role = None if event.role is None else event.role.value
    return to_line(
        {"frame": event.frame, "kind": event.kind.value, "role": role, "data": canonical_object(event.data, where)}
    )


def decode_seat_event(line: str, where: str) -> SeatEvent:
    """Returns the event of a line; raises `SessionError` with `where` and the field if it is malformed."""
    fields = Fields(from_line(line, where), where)
    frame, kind, role = fields.integer("frame", 0), fields.text("kind"), fields.optional("role", fields.text)
    if frame >= MAX_FRAME:
        raise fields.error("frame", f"below {MAX_FRAME}")
    if kind not in _KINDS:
        raise fields.error("kind", f"one of {', '.join(_KINDS)}")
    if role is not None and role not in _ROLES:
        raise fields.error("role", f"null or one of {', '.join(_ROLES)}")
    return SeatEvent(
        frame=frame,
        kind=_KINDS[kind],
        role=None if role is None else _ROLES[role],
        data=fields.mapping("data"),
    )


def read_seat_log(folder: Path | str) -> tuple[SeatEvent, ...] | None:
    """Returns the events at the seats of a session, in the order of their recording; a torn last line is left out.

    Args:
        folder: folder of the session.

    Returns:
        The events; None if no people took part.

    Raises:
        SessionError: a line is damaged; the message names file, line and field.
    """
    path = Path(folder) / SEATS_FILE
    if not path.exists():
        return None
    lines, _ = read_lines(path, MAX_EVENTS)
    return tuple(decode_seat_event(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1))


class SeatLogWriter:
    """Appends events to the log of the seats; appended events survive a crash of the process.

    Args:
        folder: folder of a session, which must exist.

    Raises:
        FileExistsError: the folder has such a log.
        OSError: the folder cannot be written.
    """

    def __init__(self, folder: Path | str) -> None:
        self._file = (Path(folder) / SEATS_FILE).open("xb")

    def append(self, event: SeatEvent) -> None:
        """Appends an event and flushes it to the operating system; raises `SessionError` as `encode_seat_event`."""
        self._file.write((encode_seat_event(event) + "\n").encode("utf-8"))
        self._file.flush()

    def close(self) -> None:
        """Closes the file, which is then on the disk; may be called again."""
        try:
            if not self._file.closed:
                os.fsync(self._file.fileno())
        finally:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()
