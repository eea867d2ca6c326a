"""Writing a session in SDN's release layout."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym.sessions.encoding import canonical
from dorothie_gym.sessions.header import LandmarkRow, SessionHeader
from dorothie_gym.sessions.layout import EVENTS_FILE
from dorothie_gym.sessions.saving import new_folder
from dorothie_gym.sessions.sdn.layouts import (
    AD_WIZARD_FILE,
    CONFIG_FILE,
    DETAILED_PLAN_FILE,
    FRAMES_EACH,
    LOG_FILE,
    OURS,
    PLACES_FILE,
    PLAN_FILE,
    SCENE_FILE,
    SDN_RATE,
)
from dorothie_gym.sessions.sdn.maps import find_town
from dorothie_gym.sessions.sdn.places import COLUMNS
from dorothie_gym.sessions.sdn.scenes import write_scene
from dorothie_gym.sessions.sdn.written import ad_wizard_lines, detailed_plan_rows, log_rows, plan_rows
from dorothie_gym.sessions.session import Session
from dorothie_gym.world.town import Town

_NONE: Final = -1


def write_sdn(session: Session, path: Path | str, *, maps: Path | str | None = None) -> Path:
    """Writes a session into a new folder in the release layout, whole or not at all.

    What the layout has no place for (`docs/session-format.md`) is lost: frames between those of 10 Hz, the controls,
    pictures. Events keep a tenth of a second as their time. Actors, lights and the weather of the frames that are left
    are kept in a file of ours beside the layout's.

    Args:
        session: the session.
        path: the folder; its name should be `log_<number>`, which the original scripts look for.
        maps: folder with maps of towns that are not shipped, for OpenDRIVE's numbers of lanes.

    Returns:
        The folder.

    Raises:
        SessionError: there is something of that name already, or the session holds what JSON cannot.
        OSError: the folder cannot be written.
    """
    town = find_town(session.header.town, None if maps is None else Path(maps))
    first = first_frame_of(session.header)
    with new_folder(Path(path)) as folder:
        _write(folder / CONFIG_FILE, json.dumps(_config(session, town, first), ensure_ascii=False, indent=1))
        _write(folder / LOG_FILE, _lines(log_rows(session, first)))
        _write(folder / PLAN_FILE, _lines(sorted(plan_rows(session, first), key=lambda row: int(row["frame"]))))
        _write(folder / DETAILED_PLAN_FILE, _lines(detailed_plan_rows(session, first)))
        _write(folder / PLACES_FILE, "\n".join(_place_lines(session, town, first)))
        _write(folder / AD_WIZARD_FILE, "\n".join(ad_wizard_lines(session, first)))
        write_scene(folder / SCENE_FILE, session)
    return Path(path)


def first_frame_of(header: SessionHeader) -> int:
    """Returns the frame (10 Hz) that a session began at in the corpus that it was read from; 0 for ours."""
    read = header.config.get("sdn")
    first = read.get("first_frame") if isinstance(read, Mapping) else None
    return first if isinstance(first, int) and first >= 0 else 0


def _write(path: Path, text: str) -> None:
    path.write_text(text.rstrip("\n") + "\n", encoding="utf-8", newline="\n")


def _lines(rows: Iterable[Mapping[str, Any]]) -> str:
    """A JSON list with a row a line."""
    lines = (json.dumps(canonical(row, EVENTS_FILE), ensure_ascii=False, allow_nan=False) for row in rows)
    return "[\n" + ",\n".join(lines) + "\n]"


# --- config.json ----------------------------------------------------------------------------------------------------


def _config(session: Session, town: Town | None, first: int) -> dict[str, Any]:
    header = session.header
    read = header.config.get("sdn")
    original = read.get("config") if isinstance(read, Mapping) else None
    last = round(session.duration * SDN_RATE)
    config = dict(original) if isinstance(original, Mapping) else _own_config(session, town)
    outcome = canonical(session.summary, "outcome") if session.complete else None
    return {
        **config,
        "start_frame": first,
        "end_frame": first + last,
        OURS: {**header.to_json(), "outcome": outcome},
    }


def _own_config(session: Session, town: Town | None) -> dict[str, Any]:
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


def _landmark(row: LandmarkRow, town: Town | None) -> dict[str, Any]:
    return {
        "asset": row["name"],
        "name": row["name"],
        "is_hidden": row["hidden"],
        "wp": _waypoint(row["lane"], row["station"], row["x"], row["y"], town),
    }


def _waypoint(lane: int, station: float, x: float, y: float, town: Town | None) -> dict[str, Any]:
    """A place on a lane, with OpenDRIVE's numbers where the town is known; else (x, y) and no numbers."""
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
    kept = trajectory["frame"] % FRAMES_EACH == 0
    rows = trajectory[kept]
    ids = np.full((3, len(rows)), _NONE, dtype=np.int64)
    for k, name in enumerate(COLUMNS[4:]):
        if name in session.scene.columns:
            ids[k] = session.scene.columns[name][kept]
        elif town is not None:
            table = [getattr(lane, name) for lane in town.lanes]
            ids[k] = [table[lane] if 0 <= lane < len(table) else _NONE for lane in rows["lane"].tolist()]
    frames = (rows["frame"] // FRAMES_EACH + first).tolist()
    columns = (frames, rows["x"].tolist(), rows["y"].tolist(), np.degrees(rows["heading"]).tolist(), *ids.tolist())
    return [", ".join(COLUMNS), *(", ".join(map(repr, row)) for row in zip(*columns, strict=True))]
