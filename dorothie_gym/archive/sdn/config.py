"""Session header from `config.json` and `task.json` of SDN."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from dorothie_gym.archive.sdn.files import (
    CONFIG_FILE,
    DIALOG_FILE,
    OURS,
    JsonObject,
    SdnLayout,
    number_of,
    plain,
    plain_object,
    whole_of,
)
from dorothie_gym.archive.sdn.landmark_names import landmark_name
from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.spellings import parse_street
from dorothie_gym.session.recording.header import LandmarkRow, SessionHeader, SubgoalRow
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.archive.sdn.trajectory import SdnMap
    from dorothie_gym.session.recording.validation import ReadReport

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
    rows = _rows(given)
    names = [_landmark_name(row, report) for row in rows]
    destinations = Destinations(task, rows, names)
    hidden = _hidden(task, destinations, report)
    landmarks = [_landmark(row, names[k], k in hidden, place, report) for k, row in enumerate(rows)]
    return SessionHeader(
        town=str(plain(town_of(config))) or "unknown",
        storyboard=_text(task.get("template")),
        seed=None,
        decision_frequency=10.0,
        street_names=_streets(environment.get("street_names", config.get("street_names")), report),
        landmarks=landmarks,
        subgoals=_subgoals(config, task, destinations, report),
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


def _landmark(row: JsonObject, name: str, hidden: bool, place: SdnMap, report: ReadReport) -> LandmarkRow:
    """Returns a landmark of the release layout (`wp`) or of the sample layout (`location`)."""
    location = _dig(row, "wp", "Transform", "Location")
    ids = _dig(row, "wp", "OpenDriveID") or row
    x, y = number_of(location.get("x")), number_of(location.get("y"))
    if row.get("location") is not None:
        x, y = _point(row["location"])
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
        hidden=hidden or row.get("is_hidden", row.get("hidden")) is True,
        extra=plain_object(row),
    )


def _point(value: object) -> tuple[float | None, float | None]:
    """Returns the coordinates of a place, given as a list or as an object with x and y."""
    if isinstance(value, Mapping):
        return number_of(value.get("x")), number_of(value.get("y"))
    if isinstance(value, list) and len(value) >= 2:
        return number_of(value[0]), number_of(value[1])
    return None, None


def _landmark_name(row: JsonObject, report: ReadReport) -> str:
    try:
        return landmark_name(row).label
    except OntologyError:
        shown = row.get("name", row.get("asset"))
        report.keep(f"config.json: landmark {str(plain(shown))[:40]!r}")
        return _UNKNOWN


@dataclass(frozen=True)
class Destinations:
    """Landmarks that the texts of a storyboard refer to: by variable, name or asset.

    Attributes:
        task: content of `task.json`, with `assignments` of variables.
        rows: landmarks of `config.json`.
        names: their names.
    """

    task: JsonObject
    rows: list[JsonObject]
    names: list[str]

    def find(self, destination: object) -> int | None:
        """Returns the row of a destination; None if it names none."""
        value = self._assigned(destination)
        if isinstance(value, list) and len(value) == 1:
            value = value[0]
        if isinstance(value, int) and not isinstance(value, bool):
            return value if 0 <= value < len(self.rows) else None
        same = [k for k, row in enumerate(self.rows) if _has_text(row, value)]
        try:
            name = landmark_name(value).label
        except OntologyError:
            return same[0] if same else None
        found = [k for k, each in enumerate(self.names) if each == name]
        x, y = _point(value.get("location")) if isinstance(value, Mapping) else (None, None)
        if found and x is not None and y is not None:
            return min(found, key=lambda k: self._distance(k, x, y))
        return next((k for k in found if k in same), found[0] if found else None)

    def _assigned(self, destination: object) -> object:
        """Returns the value of a variable; other destinations unchanged."""
        if not isinstance(destination, str):
            return destination
        given = self.task.get("assignments")
        pairs = given.items() if isinstance(given, Mapping) else given if isinstance(given, list) else ()
        for pair in pairs:
            if isinstance(pair, list | tuple) and len(pair) == 2 and isinstance(pair[0], str):
                if pair[0].lstrip("$") == destination.strip().lstrip("$"):
                    return pair[1]
        return destination

    def _distance(self, k: int, x: float, y: float) -> float:
        own_x, own_y = _point(self.rows[k].get("location", _dig(self.rows[k], "wp", "Transform", "Location")))
        return math.inf if own_x is None or own_y is None else pm.hypot(own_x - x, own_y - y)


def _has_text(row: JsonObject, value: object) -> bool:
    """Returns whether name or asset of a landmark is literally a text, or that of an object."""
    texts = [value.get("name")] if isinstance(value, Mapping) else [value]
    return any(isinstance(text, str) and text in (row.get("name"), row.get("asset")) for text in texts)


def _hidden(task: JsonObject, destinations: Destinations, report: ReadReport) -> frozenset[int]:
    """Returns the landmarks that the storyboard hides."""
    found = set()
    for field in ("hidden_from_wizard", "hidden_from_co_wizard"):
        names = task.get(field)
        for name in names if isinstance(names, list) else ():
            row = destinations.find(name)
            if row is None:
                report.keep(f"task.json: {field} {str(plain(name))[:40]!r}")
            else:
                found.add(row)
    return frozenset(found)


def _subgoals(config: JsonObject, task: JsonObject, destinations: Destinations, report: ReadReport) -> list[SubgoalRow]:
    """Returns the subgoals of `task.json` and `config.json`; fields that one file lacks are those of the other."""
    own, others = _rows(task.get("subgoals")), _rows(_dig(config, "task").get("subgoals"))
    if len(own) == len(others):
        own = [{**other, **row} for row, other in zip(own, others, strict=True)]
    rows = own or others
    found = [destinations.find(row.get("destination", row.get("landmark"))) for row in rows]
    numbers = {k: number for number, k in enumerate(k for k, landmark in enumerate(found) if landmark is not None)}
    subgoals = []
    for k, row in enumerate(rows):
        landmark = found[k]
        if landmark is None:
            report.keep(f"task: subgoal to {str(plain(row.get('destination', row.get('landmark'))))[:40]!r}")
            continue
        until = row.get("delete_after_subgoal")
        has_until = not isinstance(until, bool) and whole_of(until) is not None
        subgoals.append(
            SubgoalRow(
                description=_text(row.get("description")),
                landmark=landmark,
                after=_after(row.get("after"), k, numbers, report),
                trigger=_flag(row.get("trigger")),
                delete=_flag(row.get("delete")) or has_until,
                change=_text(row.get("change")) or None,
                extra=plain_object({name: value for name, value in row.items() if name not in _SUBGOAL_FIELDS}),
            )
        )
    return subgoals


_SUBGOAL_FIELDS: Final = ("description", "trigger", "delete", "change", "after")


def _after(value: object, own: int, numbers: dict[int, int], report: ReadReport) -> list[int]:
    """Returns the preceding subgoals, numbered among those that are kept."""
    after = set()
    for item in value if isinstance(value, list) else [] if value is None else [value]:
        number = None if isinstance(item, bool) else whole_of(item)
        if number is None or number == own or number not in numbers:
            report.keep(f"task: after {str(plain(item))[:40]} of a subgoal")
        else:
            after.add(numbers[number])
    return sorted(after)


def _flag(value: object) -> bool:
    """Returns a flag, which some files give as a text or a number."""
    return str(value).strip().casefold() in ("true", "1", "1.0", "yes")
