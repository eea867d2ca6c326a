"""Reading the folder of a session, whatever version it has and at whatever moment it was cut off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from dorothie_gym.sessions.decisions import Decision, read_decisions
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.event_lines import decode_event
from dorothie_gym.sessions.events import Event, EventType
from dorothie_gym.sessions.frames_file import read_frames
from dorothie_gym.sessions.header import SessionHeader
from dorothie_gym.sessions.journal import read_journal
from dorothie_gym.sessions.layout import (
    EVENTS_FILE,
    FRAMES_FILE,
    JOURNAL_FILE,
    MAX_EVENTS,
    PICTURES_FOLDER,
)
from dorothie_gym.sessions.report import ReadReport
from dorothie_gym.sessions.scene import Scene
from dorothie_gym.sessions.session_file import is_version1, read_session_file
from dorothie_gym.sessions.text_lines import read_lines
from dorothie_gym.sessions.trajectory import TRAJECTORY_DTYPE, Trajectory, check_rising
from dorothie_gym.sessions.version1 import read_summary, read_trajectory


@dataclass(frozen=True, kw_only=True)
class FolderContent:
    """What the folder of a session holds; attributes as those of `Session`."""

    header: SessionHeader
    events: tuple[Event, ...]
    trajectory: Trajectory
    scene: Scene
    summary: Mapping[str, Any] | None
    complete: bool
    report: ReadReport
    pictures: Mapping[int, Path]
    decisions: tuple[Decision, ...] | None = None


def read_folder(folder: Path) -> FolderContent:
    """Reads a folder; raises `SessionError` naming file, line and field where there is no session or a damaged one."""
    if is_version1(folder):
        return _read_version1(folder)
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


def _read_version1(folder: Path) -> FolderContent:
    header = read_session_file(folder).header
    report = ReadReport(layout="native-1")
    events, events_torn = _read_events(folder / EVENTS_FILE)
    trajectory, whole = read_trajectory(folder)
    ending = read_summary(folder)
    counted = ending is not None and ending[1:] == (len(events), len(trajectory))
    _note_unknown(header, events, report)
    return FolderContent(
        header=header,
        events=events,
        trajectory=trajectory,
        scene=Scene(),
        summary=ending[0] if ending else None,
        complete=whole and counted and not events_torn,
        report=report,
        pictures=MappingProxyType({}),
    )


def _read_events(path: Path) -> tuple[tuple[Event, ...], bool]:
    lines, torn = read_lines(path, MAX_EVENTS)
    return tuple(decode_event(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)), torn


def _read_frames(folder: Path, over: bool, report: ReadReport) -> tuple[Trajectory, Scene, bool]:
    """Returns the frames and whether they were written whole."""
    journal = folder / JOURNAL_FILE
    if journal.exists() and not over:
        trajectory, scene = read_journal(journal)
        check_rising(trajectory["frame"], -1, str(journal))
        return trajectory, scene, False
    if (folder / FRAMES_FILE).exists():
        return *read_frames(folder / FRAMES_FILE, report), True
    if over:
        raise SessionError(f"{folder / FRAMES_FILE}: is missing, though the session is over")
    return np.empty(0, dtype=TRAJECTORY_DTYPE), Scene(), False


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
    """Pictures by frame."""
    if not folder.is_dir():
        return MappingProxyType({})
    found = {int(path.stem): path for path in folder.glob("*.png") if path.stem.isdecimal() and len(path.stem) <= 10}
    return MappingProxyType(dict(sorted(found.items())))
