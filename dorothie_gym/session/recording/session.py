"""Recorded session: header, events and frames; reading, saving and hashing of its folder."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import SessionError
from dorothie_gym.session.recording.action_log import Decision, encode_decision, read_decisions
from dorothie_gym.session.recording.events import (
    INFRACTIONS,
    ActionRecord,
    Event,
    EventType,
    InfractionRecord,
    MoveRecord,
    UtteranceRecord,
    action_record,
    decode_event,
    encode_event,
    infraction_record,
    move_record,
    utterance_records,
)
from dorothie_gym.session.recording.files import (
    ACTIONS_FILE,
    AUDIO_FOLDER,
    EVENTS_FILE,
    FRAMES_FILE,
    HEADER_FILE,
    JOURNAL_FILE,
    MAX_EVENTS,
    MAX_EXCEPTIONS,
    MAX_MOVES,
    PICTURES_FOLDER,
    Fields,
    SessionState,
    canonical,
    read_lines,
    read_object,
    safe_name,
    to_line,
    to_page,
)
from dorothie_gym.session.recording.frames import read_frames, read_journal, write_frames
from dorothie_gym.session.recording.header import SessionHeader
from dorothie_gym.session.recording.surroundings import Surroundings
from dorothie_gym.session.recording.trajectory import TRAJECTORY_DTYPE, Trajectory, check_rising
from dorothie_gym.session.recording.validation import ReadReport, faults_of
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support.copying import shared
from dorothie_gym.support.files import new_folder, write_atomically

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role


@shared
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
        audio: paths of the audio of dialogue moves by the name in their field `audio`.
        decisions: actions of the roles, from which the session can be simulated again; None if not recorded.
        report: findings of the reader.
    """

    header: SessionHeader
    events: tuple[Event, ...]
    trajectory: Trajectory
    summary: Mapping[str, object] | None = None
    complete: bool = True
    name: str = ""
    scene: Surroundings = field(default_factory=Surroundings)
    pictures: Mapping[int, Path] = field(default_factory=dict)
    audio: Mapping[str, Path] = field(default_factory=dict)
    decisions: tuple[Decision, ...] | None = None
    report: ReadReport = field(default_factory=ReadReport)

    def __post_init__(self) -> None:
        """Sorts the events, checks the trajectory's columns, and names a session without a name."""
        if self.trajectory.dtype != TRAJECTORY_DTYPE:
            raise SessionError(f"session: trajectory has type {self.trajectory.dtype}; it must be {TRAJECTORY_DTYPE}")
        object.__setattr__(self, "events", tuple(sorted(self.events, key=lambda event: event.frame)))
        kinds = [event.type for event in self.events]
        for kind, most in ((EventType.DIALOGUE_MOVE, MAX_MOVES), (EventType.EXCEPTION, MAX_EXCEPTIONS)):
            if (count := kinds.count(kind)) > most:
                raise SessionError(f"session {self.name}: has {count} events of type {kind}; at most {most} are read")
        if not self.name:
            name = f"{self.header.town}-{self.header.storyboard}-{self.header.seed}"
            object.__setattr__(self, "name", safe_name(name))

    def __getstate__(self) -> dict[str, object]:
        """Returns the attributes, read-only mappings as dictionaries: they cannot be pickled."""
        return {
            name: dict(value) if isinstance(value, MappingProxyType) else value for name, value in vars(self).items()
        }

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
        file = read_session_file(folder)
        report = ReadReport()
        events, events_torn = _read_events(folder / EVENTS_FILE)
        decisions, decisions_torn = read_decisions(folder)
        trajectory, scene, frames_whole = _read_frames(folder, file.outcome is not None, report)
        whole = file.outcome is not None and (file.events, file.frames) == (len(events), len(trajectory))
        _note_unknown(file.header, events, report)
        return cls(
            header=file.header,
            events=events,
            trajectory=trajectory,
            summary=file.outcome,
            complete=whole and frames_whole and not events_torn and not decisions_torn,
            name=folder.resolve().name,
            scene=scene,
            pictures=_pictures(folder / PICTURES_FOLDER),
            audio=_audio(folder / AUDIO_FOLDER),
            decisions=decisions,
            report=report,
        )

    def save(self, path: Path | str) -> Path:
        """Writes the session into a new folder, which appears when it is complete; pictures and audio are copied.

        A session without an outcome is written as an interrupted one.

        Returns:
            The folder.

        Raises:
            SessionError: a file or folder of that name exists, or the session cannot be written.
            OSError: the folder cannot be written.
        """
        folder = Path(path)
        with new_session_folder(folder) as part:
            _write_lines(part / EVENTS_FILE, map(encode_event, self.events))
            if self.decisions is not None:
                _write_lines(part / ACTIONS_FILE, map(encode_decision, self.decisions))
            write_frames(part / FRAMES_FILE, self.trajectory, self.scene)
            if self.pictures:
                (part / PICTURES_FOLDER).mkdir()
                for frame, picture in self.pictures.items():
                    shutil.copyfile(picture, part / PICTURES_FOLDER / picture_name(frame))
            if self.audio:
                (part / AUDIO_FOLDER).mkdir()
                for name, audio in self.audio.items():
                    shutil.copyfile(audio, part / AUDIO_FOLDER / name)
            outcome = self.summary if self.complete else None
            SessionFile(
                header=self.header, outcome=outcome, events=len(self.events), frames=len(self.trajectory)
            ).write(part)
        return folder

    def check(self) -> tuple[str, ...]:
        """Returns the faults of the session that its reader accepted, one sentence each; empty for a sound session."""
        return faults_of(self)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of header, outcome, events, decisions and all numbers of the frames, in hexadecimal digits.

        It does not depend on name, pictures, audio, reader's report, or on the libraries that compressed the files.
        """
        return _digest(self)

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


# --- Files of a session ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class SessionFile:
    """Content of `session.json`.

    Attributes:
        header: header of the session.
        outcome: outcome of the session; None if it was interrupted.
        events: number of events of a complete session.
        frames: number of frames of a complete session.
    """

    header: SessionHeader
    outcome: Mapping[str, object] | None = None
    events: int = 0
    frames: int = 0

    def write(self, folder: Path) -> None:
        """Writes the file atomically; raises `SessionError` if the outcome holds other types than JSON's."""
        over = self.outcome is not None
        page = {
            **self.header.to_json(),
            "outcome": canonical(self.outcome, "outcome") if over else None,
            "counts": {"events": self.events, "frames": self.frames} if over else None,
        }
        write_atomically(folder / HEADER_FILE, to_page(page))


def read_session_file(folder: Path) -> SessionFile:
    """Returns the content of the file; raises `SessionError` naming file and field if it is missing or malformed."""
    path = folder / HEADER_FILE
    if not path.is_file():
        raise SessionError(f"{folder}: no session here (there is no {HEADER_FILE})")
    fields = read_object(path)
    header = SessionHeader.from_json(fields.others(("outcome", "counts")), str(path))
    outcome = fields.if_given("outcome", fields.mapping)
    if outcome is None:
        return SessionFile(header=header)
    counts = Fields(fields.mapping("counts"), f"{path}, counts")
    return SessionFile(
        header=header, outcome=outcome, events=counts.integer("events", 0), frames=counts.integer("frames", 0)
    )


def session_state(folder: Path | str) -> SessionState:
    """Returns the state of a session folder.

    Raises:
        SessionError: the header is damaged.
    """
    folder = Path(folder)
    if not (folder / HEADER_FILE).is_file():
        return SessionState.ABSENT
    whole = all((folder / name).is_file() for name in (EVENTS_FILE, FRAMES_FILE))
    over = read_session_file(folder).outcome is not None
    return SessionState.FINISHED if whole and over else SessionState.PARTIAL


def _read_events(path: Path) -> tuple[tuple[Event, ...], bool]:
    lines, torn = read_lines(path, MAX_EVENTS)
    return tuple(decode_event(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)), torn


def _read_frames(folder: Path, over: bool, report: ReadReport) -> tuple[Trajectory, Surroundings, bool]:
    """Returns the frames, and whether they are complete."""
    journal = folder / JOURNAL_FILE
    if journal.exists() and not over:
        trajectory, scene = read_journal(journal)
        check_rising(trajectory["frame"], -1, str(journal))
        return trajectory, scene, False
    if (folder / FRAMES_FILE).exists():
        return *read_frames(folder / FRAMES_FILE, report), True
    if over:
        raise SessionError(f"{folder / FRAMES_FILE}: is missing, though the session is over")
    return np.empty(0, dtype=TRAJECTORY_DTYPE), Surroundings(), False


def _note_unknown(header: SessionHeader, events: tuple[Event, ...], report: ReadReport) -> None:
    for name in header.extra:
        report.keep(f"session.json: field {name!r}")
    for event in events:
        if event.type is EventType.OTHER:
            report.keep(f"{EVENTS_FILE}: type {event.type_name!r}")
        for name in event.extra:
            if name != "type" or event.type is not EventType.OTHER:
                report.keep(f"{EVENTS_FILE}: field {name!r} of {event.type_name}")


def _pictures(folder: Path) -> Mapping[int, Path]:
    """Returns the pictures by frame."""
    if not folder.is_dir():
        return MappingProxyType({})
    found = {int(path.stem): path for path in folder.glob("*.png") if path.stem.isdecimal() and len(path.stem) <= 10}
    return MappingProxyType(dict(sorted(found.items())))


def _audio(folder: Path) -> Mapping[str, Path]:
    """Returns the audio files by name."""
    if not folder.is_dir():
        return MappingProxyType({})
    return MappingProxyType(
        {path.name: path for ending in ("flac", "wav") for path in sorted(folder.glob(f"*.{ending}"))}
    )


@contextmanager
def new_session_folder(folder: Path) -> Iterator[Path]:
    """Yields a temporary folder, which is renamed at the end of the block, and removed if the block fails.

    Raises:
        SessionError: a file or folder of that name exists.
    """
    if os.path.lexists(folder) and not (folder.is_dir() and not folder.is_symlink() and not any(folder.iterdir())):
        raise SessionError(f"{folder}: exists already; choose another name, or remove it first")
    with new_folder(folder, hidden=True) as part:
        yield part


def _write_lines(path: Path, lines: Iterable[str]) -> None:
    path.write_text("".join(line + "\n" for line in lines), encoding="utf-8", newline="\n")


def picture_name(frame: int) -> str:
    """Returns the name of the picture of a frame."""
    return f"{frame:06d}.png"


# --- Hashing ---------------------------------------------------------------------------------------------------------


def _digest(session: Session) -> str:
    content = hashlib.sha256()

    def take(name: str, data: bytes) -> None:
        content.update(f"{name}:{len(data)}\n".encode())
        content.update(data)

    take("header", to_line(session.header.to_json()).encode())
    take("outcome", to_line(canonical(session.summary if session.complete else None, "outcome")).encode())
    take("events", "\n".join(encode_event(event, check=False) for event in session.events).encode())
    if session.decisions is not None:
        take("decisions", "\n".join(map(encode_decision, session.decisions)).encode())
    for name in session.trajectory.dtype.names or ():
        take(name, _bytes(session.trajectory[name]))
    scene = session.scene
    for name, table in (("actors", scene.actors), ("lights", scene.lights), ("weather", scene.weather)):
        take(f"{name} frames", _bytes(table.frames))
        take(f"{name} offsets", _bytes(table.offsets))
        for column in table.rows.dtype.names or ():
            take(f"{name} {column}", _bytes(table.rows[column]))
    for name in sorted(scene.columns):
        take(f"column {name}", _bytes(scene.columns[name]))
    return content.hexdigest()


def _bytes(values: NDArray[np.generic]) -> bytes:
    if values.dtype.kind not in "biuf":
        return to_line(canonical(values.tolist(), "column")).encode()
    if values.dtype.kind == "f":
        values = np.where(np.isnan(values), np.nan, values)  # one bit pattern for unknown values
    return np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<"))).tobytes()
