"""Session folders: reading complete and interrupted sessions, saving, and hashing."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.errors import SessionError
from dorothie_gym.files import new_folder, write_atomically
from dorothie_gym.recording.action_log import Decision, encode_decision, read_decisions
from dorothie_gym.recording.events import Event, EventType, decode_event, encode_event
from dorothie_gym.recording.file_names import (
    ACTIONS_FILE,
    EVENTS_FILE,
    FRAMES_FILE,
    HEADER_FILE,
    JOURNAL_FILE,
    MAX_EVENTS,
    PICTURES_FOLDER,
    SessionState,
)
from dorothie_gym.recording.frames import read_frames, read_journal, write_frames
from dorothie_gym.recording.header import SessionHeader
from dorothie_gym.recording.json_io import (
    Fields,
    canonical,
    decode_text,
    from_line,
    read_bytes,
    read_lines,
    to_line,
    to_page,
)
from dorothie_gym.recording.surroundings import Surroundings
from dorothie_gym.recording.trajectory import TRAJECTORY_DTYPE, Trajectory, check_rising
from dorothie_gym.recording.validation import ReadReport

if TYPE_CHECKING:
    from dorothie_gym.recording.session import Session


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
    outcome: Mapping[str, Any] | None = None
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
    fields = Fields(from_line(decode_text(read_bytes(path), str(path)), str(path)), str(path))
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


# --- Reading ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class FolderContent:
    """Content of a session folder; attributes as of `Session`."""

    header: SessionHeader
    events: tuple[Event, ...]
    trajectory: Trajectory
    scene: Surroundings
    summary: Mapping[str, Any] | None
    complete: bool
    report: ReadReport
    pictures: Mapping[int, Path]
    decisions: tuple[Decision, ...] | None = None


def read_folder(folder: Path) -> FolderContent:
    """Returns the content of a folder; raises `SessionError` naming file, line and field if it cannot be read."""
    file = read_session_file(folder)
    report = ReadReport()
    events, events_torn = _read_events(folder / EVENTS_FILE)
    decisions, decisions_torn = read_decisions(folder)
    trajectory, scene, frames_whole = _read_frames(folder, file.outcome is not None, report)
    whole = file.outcome is not None and (file.events, file.frames) == (len(events), len(trajectory))
    _note_unknown(file.header, events, report)
    return FolderContent(
        header=file.header,
        events=events,
        trajectory=trajectory,
        scene=scene,
        summary=file.outcome,
        complete=whole and frames_whole and not events_torn and not decisions_torn,
        report=report,
        pictures=_pictures(folder / PICTURES_FOLDER),
        decisions=decisions,
    )


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


# --- Saving ----------------------------------------------------------------------------------------------------------


@contextmanager
def new_session_folder(folder: Path) -> Iterator[Path]:
    """Yields a folder to fill, which gets its name when the block is left and is removed when the block fails.

    Raises:
        SessionError: a file or folder of that name exists.
    """
    if os.path.lexists(folder) and not (folder.is_dir() and not folder.is_symlink() and not any(folder.iterdir())):
        raise SessionError(f"{folder}: exists already; choose another name, or remove it first")
    with new_folder(folder, hidden=True) as part:
        yield part


def save_folder(session: Session, folder: Path) -> Path:
    """Writes a session into a new folder; see `Session.save`."""
    with new_session_folder(folder) as part:
        lines = [encode_event(event) + "\n" for event in session.events]
        (part / EVENTS_FILE).write_text("".join(lines), encoding="utf-8", newline="\n")
        if session.decisions is not None:
            lines = [encode_decision(decision) + "\n" for decision in session.decisions]
            (part / ACTIONS_FILE).write_text("".join(lines), encoding="utf-8", newline="\n")
        write_frames(part / FRAMES_FILE, session.trajectory, session.scene)
        if session.pictures:
            (part / PICTURES_FOLDER).mkdir()
            for frame, picture in session.pictures.items():
                shutil.copyfile(picture, part / PICTURES_FOLDER / picture_name(frame))
        outcome = session.summary if session.complete else None
        file = SessionFile(
            header=session.header, outcome=outcome, events=len(session.events), frames=len(session.trajectory)
        )
        file.write(part)
    return folder


def picture_name(frame: int) -> str:
    """Returns the name of the picture of a frame."""
    return f"{frame:06d}.png"


# --- Hashing ---------------------------------------------------------------------------------------------------------


def digest_of(session: Session) -> str:
    """Returns the SHA-256 of a session's content: header, outcome, events, decisions and all numbers of its frames.

    It does not depend on name, pictures, reader's report, or on the libraries that compressed the files.
    """
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
