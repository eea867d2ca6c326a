"""Reader of SDN sessions of any layout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from dorothie_gym.archive.sdn.audio import AudioFiles
from dorothie_gym.archive.sdn.config import header_of, town_of
from dorothie_gym.archive.sdn.event_log import LogReader, sorted_rows
from dorothie_gym.archive.sdn.files import (
    CONFIG_FILE,
    OURS,
    PLACES_FILE,
    SCENE_FILE,
    TASK_FILE,
    JsonObject,
    SdnLayout,
    detect_layout,
    expected_files,
    frame_of,
    log_file,
    objects,
    read_json,
    whole_of,
)
from dorothie_gym.archive.sdn.plan_files import ViewReader
from dorothie_gym.archive.sdn.trajectory import CarPoses, SdnMap, read_places, read_scene, trajectory_of_places
from dorothie_gym.archive.sdn.turn_angles import SignVote, vote, with_roads, with_sign
from dorothie_gym.errors import SessionError
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.session.recording.events import Event
from dorothie_gym.session.recording.files import ANNOTATIONS_FOLDER, MAX_FRAME
from dorothie_gym.session.recording.header import SessionHeader
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.recording.validation import ReadReport

MAX_START_OFFSET: Final = 600
"""Largest distance of `start_frame` from the first row; a larger one belongs to another clock [frames at 10 Hz]."""


@dataclass(frozen=True)
class RawSession:
    """Content of the files; angles of JTurns have the sign of the file."""

    layout: SdnLayout
    config: JsonObject
    task: JsonObject
    header: SessionHeader
    events: list[Event]
    places: CarPoses
    first_frame: int
    place: SdnMap
    report: ReadReport
    audio: Mapping[str, Path]

    @property
    def is_ours(self) -> bool:
        """Whether this package wrote the session."""
        return isinstance(self.config.get(OURS), Mapping)


def read_sdn(path: Path | str, *, maps: Path | str | None = None, sign: SignVote | None = None) -> Session:
    """Returns the SDN session of a folder in release, sample or hub layout (`docs/session-format.md`).

    Only JSON and CSV files are opened, never `.pkl` files. `Session.report` names unknown, missing and repaired values.

    Args:
        path: the folder.
        maps: folder with the towns' maps (`Town01.xodr`, ...), for lanes and for angles of turns into a road.
        sign: vote on the sign of angles; None uses the vote of this session alone (see `settle_sign`).

    Raises:
        SessionError: there is no SDN session, or a file of it cannot be read; the message names file and place.
        TownError: the town's map is malformed.
        OSError: a file cannot be read.
    """
    folder = Path(path)
    raw = raw_session(folder, None if maps is None else Path(maps))
    report = raw.report
    own = vote(raw.events, raw.places, raw.first_frame)
    settled = own if sign is None else sign
    if raw.is_ours:
        settled = SignVote()  # positive left
    else:
        report.facts["turn_angles"] = settled.to_json()
    trajectory, scene = trajectory_of_places(raw.places, raw.first_frame, raw.place)
    if raw.is_ours:
        scene = read_scene(folder / SCENE_FILE, scene, trajectory, report)
    header = raw.header
    if header.departure[0] < 0 and len(trajectory) and raw.place.town is not None:
        found = raw.place.locate(float(trajectory["x"][0]), float(trajectory["y"][0]))
        header = replace(header, departure=(found.lane, found.station))
    ending = raw.config.get(OURS)
    outcome = ending.get("outcome") if isinstance(ending, Mapping) else None
    return Session(
        header=header,
        events=tuple(with_sign(raw.events, settled)),
        trajectory=trajectory,
        summary=outcome if isinstance(outcome, Mapping) else {},
        complete=outcome is not None or not isinstance(ending, Mapping),
        name=folder.resolve().name,
        scene=scene,
        audio=raw.audio,
        report=report,
    )


def raw_session(folder: Path, maps: Path | None) -> RawSession:
    """Returns the contents of the files of a session; see `read_sdn`."""
    layout = detect_layout(folder)
    if layout is None:
        raise SessionError(f"{folder}: no SDN session here (none of its logs is there)")
    report = ReadReport(layout=str(layout))
    config = _object(folder, CONFIG_FILE, report) if CONFIG_FILE in expected_files(layout) else {}
    task = _object(folder, TASK_FILE, report) if TASK_FILE in expected_files(layout) else {}
    name = log_file(layout)
    rows, around = _log_rows(folder / name, report)
    config = {**around, **config}
    rows = sorted_rows(rows, name, report)
    is_driven = layout is not SdnLayout.HUB or (folder / PLACES_FILE).exists()
    places = read_places(folder / PLACES_FILE, report if is_driven else ReadReport())
    first = _first_frame(config, rows, places)
    town = town_of(config)
    place = SdnMap(find_town(town, maps))
    if place.town is None:
        report.miss(f"map of {town or 'the town'!r} (lanes, and angles of turns into a road, are unknown)")
    header = header_of(config, task, layout, place, first, report)
    ours = isinstance(config.get(OURS), Mapping)
    audio = AudioFiles(folder, report)
    log = LogReader(rows, first, name, report, audio=None if ours and not audio.paths else audio)
    events, unknown = with_roads(log.events(), log.actions.roads, places, first, place)
    if log.actions.roads:
        report.facts["turns_into_a_road"] = {"found": len(log.actions.roads) - unknown, "unknown": unknown}
    if log.actions.lane_switches:
        report.facts["lane_switch_values"] = dict(sorted(log.actions.lane_switches.items()))
    if layout is SdnLayout.RELEASE and not ours:  # the log of this package is complete
        more, header = ViewReader(folder, first, report).events(events, header)
        events = sorted([*events, *more], key=lambda event: event.frame)
    _note_files(folder, layout, report)
    return RawSession(layout, config, task, header, events, places, first, place, report, audio.paths)


def settle_sign(folders: Iterable[Path | str]) -> SignVote:
    """Returns the joint vote of the JTurns of SDN sessions on the sign of angles.

    Sessions that cannot be read are skipped; reading them reports the error. Sessions that this package wrote do not
    vote: their angles are positive to the left.
    """
    result = SignVote()
    for folder in folders:
        try:
            raw = raw_session(Path(folder), None)
        except SessionError:
            continue
        if not raw.is_ours:
            result += vote(raw.events, raw.places, raw.first_frame)
    return result


def _object(folder: Path, name: str, report: ReadReport) -> JsonObject:
    """Returns the JSON object of a file; empty if the file is missing."""
    if not (folder / name).is_file():
        report.miss(name)
        return {}
    value = read_json(folder / name, report)
    if not isinstance(value, Mapping):
        raise SessionError(f"{folder / name}: a JSON object is expected")
    return value


def _log_rows(path: Path, report: ReadReport) -> tuple[list[JsonObject], JsonObject]:
    """Returns the rows of a log, and the fields around them if the log is not a plain list (as in the hub layout).

    Rows are the objects with a field 'frame', or in a list with such objects: of the list, if the file holds one, else
    in the fields of its object.
    """
    value = read_json(path, report)
    if isinstance(value, list):
        return objects(value, path.name, report), {}
    if not isinstance(value, Mapping):
        raise SessionError(f"{path}: a JSON list of events is expected")
    rows: list[JsonObject] = []
    around: dict[str, object] = {}
    for name, items in value.items():
        given = items if isinstance(items, list) else [items]
        found = objects(given, path.name, ReadReport())
        if any("frame" in row for row in found):
            rows += found
        else:
            around[name] = items
    if not rows:
        raise SessionError(f"{path}: holds no list of events (rows with a field 'frame')")
    return rows, around


def _first_frame(config: JsonObject, rows: list[JsonObject], places: CarPoses) -> int:
    """Returns the first frame (10 Hz) of a session."""
    seen = [frame_of(row) or 0 for row in rows[:1]] + places.frames[:1].tolist()
    first = min(seen, default=0)
    given = whole_of(config.get("start_frame"))
    if given is not None and 0 <= given < MAX_FRAME and 0 <= first - given <= MAX_START_OFFSET:
        return given
    return first


def _note_files(folder: Path, layout: SdnLayout, report: ReadReport) -> None:
    """Reports the files of the folder that are not read."""
    known = (*expected_files(layout), ANNOTATIONS_FOLDER)
    left = sorted(path.name for path in folder.iterdir() if path.name not in known)
    if left:
        report.facts["files_not_read"] = ", ".join(name[:60] for name in left[:20]) + ("..." if len(left) > 20 else "")
