"""Writer of SDN's release layout."""

from __future__ import annotations

import json
import math
import re
import shutil
from collections.abc import Container, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from dorothie_gym.archive.sdn.event_log import FOREIGN, LEFT, RIGHT
from dorothie_gym.archive.sdn.files import (
    AD_WIZARD_FILE,
    CONFIG_FILE,
    DETAILED_PLAN_FILE,
    LOG_FILE,
    MORE,
    OURS,
    PLACES_FILE,
    PLAN_FILE,
    SCENE_FILE,
    whole_of,
)
from dorothie_gym.archive.sdn.landmark_names import asset_of
from dorothie_gym.archive.sdn.trajectory import CSV_COLUMNS, write_scene
from dorothie_gym.errors import OntologyError
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology.actions import SPEED_STEP, ArgumentKind, MentalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_mental_action, parse_physical_action, parse_prop
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.recording.events import Event, EventType
from dorothie_gym.session.recording.files import AUDIO_FOLDER, EVENTS_FILE, canonical
from dorothie_gym.session.recording.session import Session, new_session_folder
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH, TENTHS
from dorothie_gym.support.audio import encode_flac, read_audio
from dorothie_gym.support.files import write_atomically

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.header import LandmarkRow, SessionHeader

_ACT: Final = ("move", "slots", "exchange", "transaction", "span", "utterance", "start", "end")
_SAID: Final = (*_ACT, "text", "recognised", "sdn", "sdn_act")
_TO: Final = {Role.PARTICIPANT: Role.CO_WIZARD, Role.CO_WIZARD: Role.PARTICIPANT}
_BELIEFS: Final = {
    MentalAction.PLAN_UPDATE: ("PlanUpdate", "Junction"),
    MentalAction.GOAL_UPDATE: ("GoalUpdate", "Landmark"),
    MentalAction.STATUS_UPDATE: ("StatusUpdate", "Status"),
    MentalAction.KNOWLEDGE_UPDATE: ("LandmarkUpdate", "Location"),
    MentalAction.OTHER: ("Other", None),
}
_OF_SPAN: Final = re.compile(r"utterance_\d+_\d+\.flac")
"""Name of the audio of one span; the layout has one file for an utterance."""
_PLAN_CLOSED: Final = ("Complete", "Abandoned")


def log_rows(session: Session, first: int) -> list[Mapping[str, object]]:
    """Returns the rows of `annotated_log.json`: every event, and a row for each frame of speech, in order of frames.

    Args:
        session: the session.
        first: first frame (10 Hz) of the session.
    """
    rows = [_row(event, first) for event in session.events]
    return in_order([*_speech(session, first), *rows])


def in_order(rows: Iterable[Mapping[str, object]]) -> list[Mapping[str, object]]:
    """Returns rows in order of their frames (stable)."""
    return sorted(rows, key=lambda row: whole_of(row["frame"]) or 0)


def plan_rows(session: Session, first: int) -> Iterator[dict[str, object]]:
    """Yields the rows of `plan.json`: `Ongoing` opens a goal, the next row of the landmark closes it."""
    opened: set[str] = set()
    since = first
    for event in session.of_type(EventType.SUBGOAL):
        landmark, status = str(event.data.get("landmark")), str(event.data.get("status"))
        frame = _frame(event, first)
        if status in _PLAN_CLOSED and landmark not in opened:
            yield {"frame": since, "landmark": landmark, "status": "Ongoing"}
        yield {"frame": frame, "landmark": landmark, "status": status}
        opened = opened | {landmark} if status == "Ongoing" else opened - {landmark}
        if status in _PLAN_CLOSED:
            since = frame


def detailed_plan_rows(session: Session, first: int) -> Iterator[dict[str, object]]:
    """Yields the rows of `detailed_plan.json`: plans and goals of the Co-Wizard's belief updates."""
    for event in session.of_type(EventType.BELIEF_UPDATE):
        junctions, landmarks = event.data.get("junctions"), event.data.get("landmarks")
        if junctions is not None or landmarks is not None:
            yield {"frame": _frame(event, first), "junctions": junctions, "objective": landmarks}


def ad_wizard_lines(session: Session, first: int) -> Iterator[str]:
    """Yields the lines of `ad_wizardlog.csv`; times are those of the session, not of a clock."""
    props = 0
    for event in session.of_type(EventType.EXCEPTION, EventType.MESSAGE):
        data = event.data
        values: list[object] | None = None
        if event.type is EventType.MESSAGE:
            values = ["message", " ".join(str(data.get("text")).split())]
        elif data.get("kind") == ExceptionKind.WEATHER.name.lower():
            values = ["set_weather", data.get("parameter"), data.get("value")]
        elif data.get("kind") == ExceptionKind.PLACE_PROP.name.lower():
            values = ["prop_create", _blueprint(data.get("prop")), props, data.get("x", 0.0), data.get("y", 0.0)]
            values += [data.get(name, 0.0) for name in ("z", "pitch", "yaw", "roll")]
            props += 1
        elif data.get("kind") in ("spawn_pedestrians", "spawn_vehicles"):
            name = "make_peds" if data["kind"] == "spawn_pedestrians" else "make_cars"
            values = [name, data.get("count"), *(data.get(corner, 0.0) for corner in ("x0", "x1", "y0", "y1"))]
        if values is not None:
            frame = _frame(event, first)
            yield ", ".join(str(value) for value in (f"{frame / TENTHS:.1f}", frame, *values))


def _row(event: Event, first: int) -> dict[str, object]:
    row: dict[str, object] = {
        "frame": _frame(event, first),
        "type": event.type.value,
        "from": event.source.sdn_names[0],
    }
    to = _TO.get(event.source) if event.type is EventType.DIALOGUE_MOVE else None
    row |= {"to": to.sdn_names[0] if to is not None else None, "flag": event.flagged}
    data = event.data
    if event.type is EventType.DIALOGUE_MOVE:
        row |= _said(data)
    elif event.type is EventType.PHYSICAL_ACTION:
        row["val"] = _physical(data)
    elif event.type is EventType.BELIEF_UPDATE and _is_belief(data):
        row["val"] = _belief(data)
    elif event.type is EventType.OTHER and event.type_name.startswith(FOREIGN):
        return {**data, "frame": row["frame"], "type": event.type_name.removeprefix(FOREIGN)}
    else:
        extra = {name: value for name, value in event.extra.items() if name != "type"}
        return {**row, "type": event.type_name, "val": dict(data), OURS: {"extra": extra} if extra else {}}
    kept = data.get("sdn")
    if isinstance(kept, Mapping):
        row |= {name: value for name, value in kept.items() if name not in row}
    return {**row, MORE: dict(event.extra)} if event.extra else row


def _said(data: Mapping[str, object]) -> dict[str, object]:
    act = {name: data[name] for name in _ACT if name in data}
    kept = data.get("sdn_act")
    if isinstance(kept, Mapping):
        act = {**kept, **act}
    is_of_span = _OF_SPAN.fullmatch(str(data.get("audio")))
    act |= _more(data, (*_SAID, "audio") if is_of_span else _SAID)
    said = {"utterance_gt": data["text"], "utterance_filename": _file(data), "act": act}
    return said if data.get("recognised") is None else {**said, "utterance": data["recognised"]}


def _file(data: Mapping[str, object]) -> str:
    name = data.get("audio")
    whole = f"utterance_{data['utterance']}.flac"
    return whole if name is None or _OF_SPAN.fullmatch(str(name)) else str(name)


def _write_audio(folder: Path, session: Session) -> None:
    """Writes the audio of each utterance, joined from that of its spans; utterances with a missing file are omitted.

    A file that holds a whole utterance is copied.

    Raises:
        AudioError: a file is damaged.
        SpeechError: the extra `speech` is not installed.
    """
    folder.mkdir()
    for utterance in session.utterances():
        events = [session.events[move.index].data for move in utterance.moves]
        names = list(dict.fromkeys(str(data.get("audio")) for data in events))
        if not all(name in session.audio for name in names):
            continue
        paths, stem = [session.audio[name] for name in names], Path(_file(events[0])).stem
        if len(paths) == 1:
            shutil.copyfile(paths[0], folder / (stem + paths[0].suffix))
        else:
            joined = np.concatenate([read_audio(path) for path in paths])
            write_atomically(folder / f"{stem}.flac", encode_flac(joined))


def _physical(data: Mapping[str, object]) -> dict[str, object]:
    action = parse_physical_action(str(data["action"]))
    kind, angle, up = action.argument, data.get("angle"), data.get("up")
    slot: tuple[str | None, object] = (None, None)
    if kind is ArgumentKind.ANGLE:
        slot = ("Angle", angle) if angle is not None or "road" not in data else ("RoadID", data["road"])
    elif kind is ArgumentKind.SIDE and isinstance(angle, int | float):
        slot = ("Direction", LEFT if angle > 0 else RIGHT)
    elif kind is ArgumentKind.SPEED_STEP and up is not None:
        slot = ("Speed", SPEED_STEP if up else -SPEED_STEP)
    elif kind is ArgumentKind.SWITCH and up is not None:
        slot = ("Light", "On" if up else "Off")
    carried = {ArgumentKind.ANGLE: "angle", ArgumentKind.SIDE: "angle"}.get(kind, "up")
    unusual = [name for name in ("angle", "up") if name != carried and data.get(name) is not None]
    more = _more(data, {"action", "angle", "up", "sdn"} - set(unusual))
    return {"act": action.label, "slot_type": slot[0], "slot_val": slot[1], **more}


def _is_belief(data: Mapping[str, object]) -> bool:
    """Returns whether the layout can represent a belief update."""
    try:
        action = parse_mental_action(str(data.get("action")))
    except OntologyError:
        return False
    return all(name in data for name in action.arguments)


def _belief(data: Mapping[str, object]) -> dict[str, object]:
    action = parse_mental_action(str(data["action"]))
    name, slot_type = _BELIEFS[action]
    known = ["action", "sdn", *action.arguments]
    values = [data[argument] for argument in action.arguments]
    value: object = values
    if action in (MentalAction.PLAN_UPDATE, MentalAction.GOAL_UPDATE):
        value = values[0]
    elif action is MentalAction.KNOWLEDGE_UPDATE and isinstance(data.get("landmark"), str):
        value = [*values, data["landmark"]]
        known.append("landmark")
    elif action is MentalAction.OTHER:
        value = None
    return {"act": name, "slot_type": slot_type, "slot_val": value, **_more(data, known)}


def _more(data: Mapping[str, object], known: Container[str]) -> dict[str, object]:
    rest = {name: value for name, value in data.items() if name not in known}
    return {MORE: rest} if rest else {}


def _speech(session: Session, first: int) -> Iterator[dict[str, object]]:
    for utterance in session.utterances():
        data = session.events[utterance.moves[0].index].data
        start, end = round(utterance.start * TENTHS), round(utterance.end * TENTHS)
        for frame in range(max(start, 0), max(end, start, 0) + 1):
            yield {
                "frame": frame + first,
                "type": "Speech",
                "from": utterance.speaker.sdn_names[0],
                "utterance_filename": _file(data),
                "start_frame": max(start, 0) + first,
                "end_frame": max(end, start, 0) + first,
            }


def _blueprint(prop: object) -> str:
    try:
        return parse_prop(str(prop)).blueprint
    except OntologyError:
        return str(prop)


def _frame(event: Event, first: int) -> int:
    return event.frame // FRAMES_PER_TENTH + first


# --- Session folder --------------------------------------------------------------------------------------------------

_NONE: Final = -1


def write_sdn(session: Session, path: Path | str, *, maps: Path | str | None = None) -> Path:
    """Writes a session into a new folder in the release layout; the folder appears when it is complete.

    Data that the layout cannot represent (`docs/session-format.md`) is lost: frames between those of 10 Hz, controls
    and pictures. Times of events are rounded to a tenth of a second. Actors, lights and weather of the remaining frames
    are kept in an additional file.

    Args:
        session: the session.
        path: the folder; the original scripts look for the name `log_<number>`.
        maps: folder with maps of towns that are not shipped, for OpenDRIVE numbers of lanes.

    Returns:
        The folder.

    Raises:
        SessionError: a file or folder of that name exists, or the session holds other types than JSON's.
        AudioError: a file with audio is damaged.
        SpeechError: the session has audio, and the extra `speech` is not installed.
        OSError: the folder cannot be written.
    """
    town = find_town(session.header.town, None if maps is None else Path(maps))
    first = first_frame_of(session.header)
    with new_session_folder(Path(path)) as folder:
        _write(folder / CONFIG_FILE, json.dumps(_config(session, town, first), ensure_ascii=False, indent=1))
        _write(folder / LOG_FILE, _lines(log_rows(session, first)))
        _write(folder / PLAN_FILE, _lines(in_order(plan_rows(session, first))))
        _write(folder / DETAILED_PLAN_FILE, _lines(detailed_plan_rows(session, first)))
        _write(folder / PLACES_FILE, "\n".join(_place_lines(session, town, first)))
        _write(folder / AD_WIZARD_FILE, "\n".join(ad_wizard_lines(session, first)))
        write_scene(folder / SCENE_FILE, session)
        if session.audio:
            _write_audio(folder / AUDIO_FOLDER, session)
    return Path(path)


def first_frame_of(header: SessionHeader) -> int:
    """Returns the first frame (10 Hz) of a session in its original corpus; 0 for sessions of this package."""
    read = header.config.get("sdn")
    first = read.get("first_frame") if isinstance(read, Mapping) else None
    return first if isinstance(first, int) and first >= 0 else 0


def _write(path: Path, text: str) -> None:
    path.write_text(text.rstrip("\n") + "\n", encoding="utf-8", newline="\n")


def _lines(rows: Iterable[Mapping[str, object]]) -> str:
    """Returns a JSON list with one row per line."""
    lines = (json.dumps(canonical(row, EVENTS_FILE), ensure_ascii=False, allow_nan=False) for row in rows)
    return "[\n" + ",\n".join(lines) + "\n]"


# --- config.json ----------------------------------------------------------------------------------------------------


def _config(session: Session, town: Town | None, first: int) -> dict[str, object]:
    header = session.header
    read = header.config.get("sdn")
    original = read.get("config") if isinstance(read, Mapping) else None
    last = round(session.duration * TENTHS)
    config = dict(original) if isinstance(original, Mapping) else _own_config(session, town)
    outcome = canonical(session.summary, "outcome") if session.complete else None
    return {
        **config,
        "start_frame": first,
        "end_frame": first + last,
        OURS: {**header.to_json(), "outcome": outcome},
    }


def _own_config(session: Session, town: Town | None) -> dict[str, object]:
    header = session.header
    weather = session.scene.weather
    values = weather.rows[0].tolist() if len(weather) else ()
    world = header.config.get("world")
    return {
        "environment": {
            "map": header.town,
            "street_names": list(header.street_names),
            "departure": _waypoint(header.departure[0], header.departure[1], 0.0, 0.0, town),
            "landmarks": [_landmark(row, town) for row in header.landmarks],
        },
        "weather": dict(zip(weather.rows.dtype.names or (), values, strict=True)) if values else {},
        "npc_count": world.get("vehicles") if isinstance(world, Mapping) else None,
    }


def _landmark(row: LandmarkRow, town: Town | None) -> dict[str, object]:
    return {
        "asset": asset_of(row["name"]),
        "name": row["name"],
        "is_hidden": row["hidden"],
        "wp": _waypoint(row["lane"], row["station"], row["x"], row["y"], town),
    }


def _waypoint(lane: int, station: float, x: float, y: float, town: Town | None) -> dict[str, object]:
    """Returns a position on a lane, with OpenDRIVE numbers if the town is known; else (x, y) without numbers."""
    z = yaw = 0.0
    ids = {"lane_id": _NONE, "road_id": _NONE, "junction_id": _NONE}
    if town is not None and 0 <= lane < len(town.lanes):
        on = town.lanes[lane]
        x, y = (float(value) for value in on.position(station))
        z, yaw = on.height_at(station), math.degrees(on.heading_at(station))
        ids = {"lane_id": on.lane_id, "road_id": on.road_id, "junction_id": on.junction_id}
    return {
        "Transform": {"Location": {"x": x, "y": y, "z": z}, "Rotation": {"pitch": 0.0, "yaw": yaw, "roll": 0.0}},
        "OpenDriveID": ids,
    }


# --- trajectory.csv -------------------------------------------------------------------------------------------------


def _place_lines(session: Session, town: Town | None, first: int) -> list[str]:
    trajectory = session.trajectory
    kept = trajectory["frame"] % FRAMES_PER_TENTH == 0
    rows = trajectory[kept]
    ids = np.full((3, len(rows)), _NONE, dtype=np.int64)
    for k, name in enumerate(CSV_COLUMNS[4:]):
        if name in session.scene.columns:
            ids[k] = session.scene.columns[name][kept]
        elif town is not None:
            table = [getattr(lane, name) for lane in town.lanes]
            ids[k] = [table[lane] if 0 <= lane < len(table) else _NONE for lane in rows["lane"].tolist()]
    frames = (rows["frame"] // FRAMES_PER_TENTH + first).tolist()
    columns = (frames, rows["x"].tolist(), rows["y"].tolist(), np.degrees(rows["heading"]).tolist(), *ids.tolist())
    return [", ".join(CSV_COLUMNS), *(", ".join(map(repr, row)) for row in zip(*columns, strict=True))]
