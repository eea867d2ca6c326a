"""A session: what happened, as everything else reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from dorothie_gym.ontology import Role
from dorothie_gym.sessions.encoding import from_line
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.event_lines import decode_event
from dorothie_gym.sessions.events import INFRACTIONS, Event, EventType
from dorothie_gym.sessions.fields import Fields
from dorothie_gym.sessions.header import SessionHeader
from dorothie_gym.sessions.layout import EVENTS_FILE, HEADER_FILE, SUMMARY_FILE, TRAJECTORY_FILE
from dorothie_gym.sessions.records import (
    ActionRecord,
    InfractionRecord,
    MoveRecord,
    UtteranceRecord,
    action_record,
    infraction_record,
    move_record,
    utterance_records,
)
from dorothie_gym.sessions.trajectory import TRAJECTORY_DTYPE, TRAJECTORY_HEADER, Trajectory, decode_rows
from dorothie_gym.world.config import FRAME_RATE


@dataclass(frozen=True, eq=False)
class Session:
    """Header, events and trajectory of a session.

    Attributes:
        header: what was known before it began.
        events: what happened, in order of frames (events of one frame in the order they were recorded in).
        trajectory: structured array (n,), 30 rows a second; see `TRAJECTORY_COLUMNS`.
        summary: how it ended; None where it did not.
        complete: whether it was recorded to its end.
        name: name of its folder, or of its town, storyboard and seed.
    """

    header: SessionHeader
    events: tuple[Event, ...]
    trajectory: Trajectory
    summary: Mapping[str, Any] | None = None
    complete: bool = True
    name: str = ""

    def __post_init__(self) -> None:
        """Puts the events in order, checks the trajectory's columns and gives a name to what has none."""
        if self.trajectory.dtype != TRAJECTORY_DTYPE:
            raise SessionError(f"session: trajectory has type {self.trajectory.dtype}; it must be {TRAJECTORY_DTYPE}")
        object.__setattr__(self, "events", tuple(sorted(self.events, key=lambda event: event.frame)))
        if not self.name:
            name = f"{self.header.town}-{self.header.storyboard}-{self.header.seed}"
            object.__setattr__(self, "name", name)

    @classmethod
    def load(cls, path: Path | str) -> Session:
        """Reads the folder of a session.

        A session that was cut off, at whatever byte, is read up to its last complete event and frame, and its
        `complete` is False.

        Raises:
            SessionError: there is no session, or it is damaged otherwise; the message names file, line and field.
        """
        folder = Path(path)
        header = _load_header(folder / HEADER_FILE)
        events, events_torn = _load_events(folder / EVENTS_FILE)
        trajectory, trajectory_torn = _load_trajectory(folder / TRAJECTORY_FILE)
        ending = _load_ending(folder / SUMMARY_FILE)
        whole = ending is not None and ending.events == len(events) and ending.frames == len(trajectory)
        return cls(
            header=header,
            events=events,
            trajectory=trajectory,
            summary=ending.summary if ending else None,
            complete=whole and not events_torn and not trajectory_torn,
            name=folder.resolve().name,
        )

    @property
    def duration(self) -> float:
        """Seconds from the start to the last frame or event."""
        last_event = self.events[-1].frame if self.events else 0
        last_frame = int(self.trajectory["frame"][-1]) if len(self.trajectory) else 0
        return max(last_event, last_frame) / FRAME_RATE

    @cached_property
    def all_moves(self) -> tuple[MoveRecord, ...]:
        """The dialogue moves of all speakers."""
        return tuple(
            move_record(event, index, f"session {self.name}, event {index}")
            for index, event in enumerate(self.events)
            if event.type is EventType.DIALOGUE_MOVE
        )

    def moves(self, role: Role | None = None) -> tuple[MoveRecord, ...]:
        """Returns the dialogue moves of `role`, or of everybody."""
        return tuple(move for move in self.all_moves if role is None or move.speaker is role)

    def utterances(self, role: Role | None = None) -> tuple[UtteranceRecord, ...]:
        """Returns the utterances of `role`, or of everybody."""
        return utterance_records(self.moves(role))

    @cached_property
    def physical_actions(self) -> tuple[ActionRecord, ...]:
        """The physical actions, of whatever source."""
        return tuple(
            action_record(event, index, f"session {self.name}, event {index}")
            for index, event in enumerate(self.events)
            if event.type is EventType.PHYSICAL_ACTION
        )

    @cached_property
    def infractions(self) -> tuple[InfractionRecord, ...]:
        """Breaches of the rules of the road, collisions among them."""
        return tuple(
            infraction_record(event, index, f"session {self.name}, event {index}")
            for index, event in enumerate(self.events)
            if event.type in INFRACTIONS
        )

    def of_type(self, *types: EventType) -> tuple[Event, ...]:
        """Returns the events of the given types."""
        return tuple(event for event in self.events if event.type in types)


@dataclass(frozen=True)
class _Ending:
    events: int
    frames: int
    summary: Mapping[str, Any]


def _load_header(path: Path) -> SessionHeader:
    if not path.is_file():
        raise SessionError(f"{path.parent}: no session here (there is no {path.name})")
    lines, torn = _read_lines(path)
    if torn or len(lines) != 1:
        raise SessionError(f"{path}: the header is cut off or has more than one line; the session cannot be read")
    return SessionHeader.from_json(from_line(lines[0], f"{path}, line 1"), f"{path}, line 1")


def _load_events(path: Path) -> tuple[tuple[Event, ...], bool]:
    lines, torn = _read_lines(path)
    return tuple(decode_event(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)), torn


def _load_trajectory(path: Path) -> tuple[Trajectory, bool]:
    lines, torn = _read_lines(path)
    if not lines:  # cut off in the first line, or before it
        return np.empty(0, dtype=TRAJECTORY_DTYPE), True
    if lines[0] != TRAJECTORY_HEADER:
        raise SessionError(f"{path}, line 1: the columns are {lines[0]!r}; they must be {TRAJECTORY_HEADER!r}")
    return decode_rows(lines[1:], str(path), first_line=2), torn


def _load_ending(path: Path) -> _Ending | None:
    lines, torn = _read_lines(path)
    if torn or not lines:
        return None
    fields = Fields(from_line("\n".join(lines), str(path)), str(path))
    return _Ending(fields.integer("events", 0), fields.integer("frames", 0), fields.mapping("summary"))


def _read_lines(path: Path) -> tuple[list[str], bool]:
    """Returns the complete lines of a file, and whether anything is missing: a torn last line, or the file."""
    if not path.is_file():
        return [], True
    *lines, rest = path.read_bytes().split(b"\n")
    return [_decode(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)], bool(rest)


def _decode(line: bytes, where: str) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SessionError(f"{where}: not UTF-8 at byte {error.start}") from None
