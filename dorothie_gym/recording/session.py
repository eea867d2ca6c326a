"""Session: header, events and frames, as analyses and models read it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import Role
from dorothie_gym.recording.action_log import Decision
from dorothie_gym.recording.events import (
    INFRACTIONS,
    ActionRecord,
    Event,
    EventType,
    InfractionRecord,
    MoveRecord,
    UtteranceRecord,
    action_record,
    infraction_record,
    move_record,
    utterance_records,
)
from dorothie_gym.recording.file_names import safe_name
from dorothie_gym.recording.folder import digest_of, read_folder, save_folder
from dorothie_gym.recording.header import SessionHeader
from dorothie_gym.recording.surroundings import Surroundings
from dorothie_gym.recording.trajectory import TRAJECTORY_DTYPE, Trajectory
from dorothie_gym.recording.validation import ReadReport, faults_of
from dorothie_gym.sim.config import FRAME_RATE


@dataclass(frozen=True, eq=False)
class Session:
    """Header, events and trajectory of a session.

    Attributes:
        header: town, storyboard, seed and configuration.
        events: events in order of frames (those of one frame in the order of their recording).
        trajectory: structured array (n,), 30 rows per second; see `TRAJECTORY_COLUMNS`.
        summary: outcome; None if the session was interrupted.
        complete: whether the session was recorded to its end.
        name: name of its folder, or of its town, storyboard and seed.
        scene: recorded surroundings of the car.
        pictures: paths of the pictures by frame.
        decisions: actions of the roles, from which the session can be simulated again; None if not recorded.
        report: findings of the reader.
    """

    header: SessionHeader
    events: tuple[Event, ...]
    trajectory: Trajectory
    summary: Mapping[str, Any] | None = None
    complete: bool = True
    name: str = ""
    scene: Surroundings = field(default_factory=Surroundings)
    pictures: Mapping[int, Path] = field(default_factory=dict)
    decisions: tuple[Decision, ...] | None = None
    report: ReadReport = field(default_factory=ReadReport)

    def __post_init__(self) -> None:
        """Sorts the events, checks the trajectory's columns, and names a session without a name."""
        if self.trajectory.dtype != TRAJECTORY_DTYPE:
            raise SessionError(f"session: trajectory has type {self.trajectory.dtype}; it must be {TRAJECTORY_DTYPE}")
        object.__setattr__(self, "events", tuple(sorted(self.events, key=lambda event: event.frame)))
        if not self.name:
            name = f"{self.header.town}-{self.header.storyboard}-{self.header.seed}"
            object.__setattr__(self, "name", safe_name(name))

    @classmethod
    def load(cls, path: Path | str) -> Session:
        """Returns the session of a folder in the native layout (`docs/session-format.md`); see also `read_session`.

        An interrupted session is read up to its last complete event and frame, and its `complete` is False. Events
        that are out of order are sorted. Additions of a newer minor version of the format are kept and named in
        `report`.

        Raises:
            SessionError: there is no session, or it is damaged otherwise, or of a newer major version; the message
                names file, line and field.
        """
        folder = Path(path)
        content = read_folder(folder)
        return cls(
            header=content.header,
            events=content.events,
            trajectory=content.trajectory,
            summary=content.summary,
            complete=content.complete,
            name=folder.resolve().name,
            scene=content.scene,
            pictures=content.pictures,
            decisions=content.decisions,
            report=content.report,
        )

    def save(self, path: Path | str) -> Path:
        """Writes the session into a new folder, which appears when it is complete; pictures are copied.

        A session without an outcome is written as an interrupted one.

        Returns:
            The folder.

        Raises:
            SessionError: a file or folder of that name exists, or the session cannot be written.
            OSError: the folder cannot be written.
        """
        return save_folder(self, Path(path))

    def check(self) -> tuple[str, ...]:
        """Returns the faults of the session that its reader accepted, one sentence each; empty for a sound session."""
        return faults_of(self)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the content in hexadecimal digits; it does not depend on compression or package version."""
        return digest_of(self)

    @property
    def duration(self) -> float:
        """Seconds from the start to the last frame or event."""
        last_event = self.events[-1].frame if self.events else 0
        last_frame = int(self.trajectory["frame"][-1]) if len(self.trajectory) else 0
        return max(last_event, last_frame) / FRAME_RATE

    @cached_property
    def all_moves(self) -> tuple[MoveRecord, ...]:
        """Dialogue moves of all speakers."""
        return tuple(
            move_record(event, index, f"session {self.name}, event {index}")
            for index, event in enumerate(self.events)
            if event.type is EventType.DIALOGUE_MOVE
        )

    def moves(self, role: Role | None = None) -> tuple[MoveRecord, ...]:
        """Returns the dialogue moves of `role`, or of all speakers."""
        return tuple(move for move in self.all_moves if role is None or move.speaker is role)

    def utterances(self, role: Role | None = None) -> tuple[UtteranceRecord, ...]:
        """Returns the utterances of `role`, or of all speakers."""
        return utterance_records(self.moves(role))

    @cached_property
    def physical_actions(self) -> tuple[ActionRecord, ...]:
        """Physical actions of all sources."""
        return tuple(
            action_record(event, index, f"session {self.name}, event {index}")
            for index, event in enumerate(self.events)
            if event.type is EventType.PHYSICAL_ACTION
        )

    @cached_property
    def infractions(self) -> tuple[InfractionRecord, ...]:
        """Infractions of the traffic rules, including collisions."""
        return tuple(
            infraction_record(event, index, f"session {self.name}, event {index}")
            for index, event in enumerate(self.events)
            if event.type in INFRACTIONS
        )

    def of_type(self, *types: EventType) -> tuple[Event, ...]:
        """Returns the events of the given types."""
        return tuple(event for event in self.events if event.type in types)
