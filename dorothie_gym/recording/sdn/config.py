"""Session header from `config.json` and `task.json` of SDN."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology import parse_landmark, parse_street
from dorothie_gym.recording.header import LandmarkRow, SessionHeader, SubgoalRow
from dorothie_gym.recording.json_io import Fields
from dorothie_gym.recording.sdn.files import (
    CONFIG_FILE,
    DIALOG_FILE,
    OURS,
    JsonObject,
    SdnLayout,
    number_of,
    plain,
    plain_object,
    text_of,
    whole_of,
)
from dorothie_gym.recording.sdn.trajectory import SdnMap
from dorothie_gym.recording.validation import ReadReport

_KNOWN: Final = {
    "environment", "map", "street_names", "departure", "landmarks", "start_frame", "end_frame", "weather", "npc_count",
    "task", OURS,
}  # fmt: skip
_UNKNOWN: Final = "Unknown"


def town_of(config: JsonObject) -> str:
    """Returns the name of the town; empty if the configuration has none."""
    name = _environment(config).get("map", config.get("map"))
    return name.rpartition("/")[2] if isinstance(name, str) else ""


def header_of(
    config: JsonObject, task: JsonObject, layout: SdnLayout, place: SdnMap, first_frame: int, report: ReadReport
) -> SessionHeader:
    """Returns the header of a session.

    Args:
        config: content of `config.json`; empty without the file.
        task: content of `task.json`; empty without the file.
        layout: the session's layout.
        place: map of the town.
        first_frame: frame (10 Hz) at which the session begins.
        report: receives missing and unknown fields.
    """
    ours = config.get(OURS)
    if isinstance(ours, Mapping):
        return SessionHeader.from_json(ours, f"config.json, {OURS}")
    environment = _environment(config)
    _note_fields(config, environment, DIALOG_FILE if layout is SdnLayout.HUB else CONFIG_FILE, report)
    given = environment.get("landmarks", config.get("landmarks"))
    hidden = _hidden(task)
    landmarks = [_landmark(row, place, hidden, report) for row in _rows(given)]
    return SessionHeader(
        town=str(plain(town_of(config))) or "unknown",
        storyboard=_text(task.get("template")),
        seed=None,
        decision_frequency=10.0,
        street_names=_streets(environment.get("street_names", config.get("street_names")), report),
        landmarks=landmarks,
        subgoals=_subgoals(config, task, landmarks, report),
        story=_text(task.get("story")),
        departure=(-1, 0.0),
        config={"sdn": {"first_frame": first_frame, "config": plain_object(config), "task": plain_object(task)}},
        source=f"sdn-{layout}",
    )


def _note_fields(config: JsonObject, environment: JsonObject, file: str, report: ReadReport) -> None:
    for values, where in ((config, ""), (environment, "environment.")):
        for name in values:
            if name not in _KNOWN:
                report.keep(f"{file}: field {where + str(name)!r}")
    for name in ("map", "street_names", "departure", "landmarks"):
        if name not in environment and name not in config:
            report.miss(f"{file}: environment.{name}")


def _environment(config: JsonObject) -> JsonObject:
    environment = config.get("environment")
    return environment if isinstance(environment, Mapping) else {}


def _rows(value: object) -> list[JsonObject]:
    items = value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ()
    return [item for item in items if isinstance(item, Mapping)]


def _text(value: object) -> str:
    return str(plain(value)) if isinstance(value, str) else ""


def _streets(names: object, report: ReadReport) -> list[str]:
    streets = []
    for name in names if isinstance(names, list) else ():
        try:
            streets.append(parse_street(name if isinstance(name, str) else "").label)
        except OntologyError:
            report.keep(f"config.json: street {str(name)[:40]!r}")
            streets.append(_UNKNOWN)
    return streets


def _dig(row: JsonObject, *path: str) -> JsonObject:
    """Returns the object at a path of fields, each of which may be missing."""
    for name in path:
        below = row.get(name)
        row = below if isinstance(below, Mapping) else {}
    return row


def _landmark(row: JsonObject, place: SdnMap, hidden: frozenset[str], report: ReadReport) -> LandmarkRow:
    """Returns a landmark of the release layout (`wp`) or of the sample layout (`location`)."""
    name = _landmark_name(row, report)
    location = _dig(row, "wp", "Transform", "Location")
    ids = _dig(row, "wp", "OpenDriveID") or row
    x, y = number_of(location.get("x")), number_of(location.get("y"))
    point = row.get("location")
    if isinstance(point, list) and len(point) >= 2:
        x, y = number_of(point[0]), number_of(point[1])
    if x is None or y is None:
        report.miss("config.json: place of a landmark")
        x = y = 0.0
    found = place.locate(x, y, whole_of(ids.get("road_id")), whole_of(ids.get("lane_id")))
    return LandmarkRow(
        name=name,
        lane=found.lane,
        station=found.station if found.lane >= 0 else number_of(row.get("s")) or 0.0,
        x=x,
        y=y,
        street=found.street,
        hidden=row.get("is_hidden", row.get("hidden")) is True or name in hidden,
        extra=plain_object(row),
    )


def _landmark_name(row: JsonObject, report: ReadReport) -> str:
    for field in ("name", "asset"):
        try:
            return parse_landmark(text_of(row.get(field))).label
        except OntologyError:
            continue
    report.keep(f"config.json: landmark {str(row.get('name', row.get('asset')))[:40]!r}")
    return _UNKNOWN


def _hidden(task: JsonObject) -> frozenset[str]:
    names = task.get("hidden_from_wizard", task.get("hidden_from_co_wizard"))
    found = (_resolve(name, task) for name in (names if isinstance(names, list) else ()))
    return frozenset(name for name in found if name is not None)


def _resolve(destination: object, task: JsonObject) -> str | None:
    """Returns the landmark of a storyboard's destination: a name, or a variable that is assigned to one."""
    if not isinstance(destination, str):
        return None
    assignments = _dig(task, "assignments")
    variable = destination.lstrip("$")
    for name in (assignments.get(variable), assignments.get(destination), destination):
        candidate = name.get("name", name.get("asset")) if isinstance(name, Mapping) else name
        try:
            return parse_landmark(candidate if isinstance(candidate, str) else "").label
        except OntologyError:
            continue
    return None


def _subgoals(
    config: JsonObject, task: JsonObject, landmarks: list[LandmarkRow], report: ReadReport
) -> list[SubgoalRow]:
    numbers = {landmark["name"]: k for k, landmark in reversed(list(enumerate(landmarks)))}
    subgoals = []
    for row in _rows(task.get("subgoals")) or _rows(_dig(config, "task").get("subgoals")):
        destination = row.get("destination", row.get("landmark"))
        name = _resolve(destination, task)
        if name not in numbers:
            report.keep(f"task: subgoal to {str(destination)[:40]!r}")
            continue
        fields = Fields(row, "task")
        subgoals.append(
            SubgoalRow(
                description=_text(row.get("description")),
                landmark=numbers[name],
                after=[],
                trigger=bool(row.get("trigger")),
                delete=bool(row.get("delete")),
                change=_text(row.get("change")) or None,
                extra=plain_object(fields.others(("description", "trigger", "delete", "change"))),
            )
        )
    return subgoals
