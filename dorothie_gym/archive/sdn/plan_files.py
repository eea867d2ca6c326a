"""Events of `plan.json`, `detailed_plan.json` and `ad_wizardlog.csv` that the event log may lack."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.archive.sdn.event_log import goals_of, plan_of
from dorothie_gym.archive.sdn.files import (
    AD_WIZARD_FILE,
    DETAILED_PLAN_FILE,
    PLAN_FILE,
    JsonObject,
    frame_of,
    number_of,
    plain,
    read_csv,
    read_rows,
    text_of,
    whole_of,
)
from dorothie_gym.archive.sdn.landmark_names import landmark_name
from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.actions import MentalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_exception, parse_goal_status, parse_prop
from dorothie_gym.ontology.world_exceptions import ExceptionKind
from dorothie_gym.session.recording.events import Event, EventType
from dorothie_gym.session.recording.files import MAX_EVENTS
from dorothie_gym.session.recording.header import SessionHeader, SubgoalRow
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH

if TYPE_CHECKING:
    from dorothie_gym.session.recording.validation import ReadReport

_PROP: Final = ("id", "x", "y", "z", "pitch", "yaw", "roll")
_AREA: Final = ("x0", "x1", "y0", "y1")
MESSAGE_TYPES: Final = ("message", "messages", "msg", "send_message")


class ViewReader:
    """Reader of the three files, which yields the events that the event log lacks.

    Args:
        folder: folder of the session.
        first_frame: frame (10 Hz) at which the session begins.
        report: receives unknown and left-out values.
    """

    def __init__(self, folder: Path, first_frame: int, report: ReadReport) -> None:
        self._folder = folder
        self._first = first_frame
        self._report = report

    def events(self, known: Sequence[Event], header: SessionHeader) -> tuple[list[Event], SessionHeader]:
        """Returns the events that `known` lacks, and the header with subgoals that only the plan holds."""
        plan, header = self._plan(header)
        found = [*plan, *self._detailed_plan(), *self._ad_wizard()]
        left = Counter(_key(event) for event in known)
        new = []
        for event in found:
            key = _key(event)
            if left[key]:
                left[key] -= 1  # each event of the log accounts for one row
            else:
                new.append(event)
        return new, header

    def _plan(self, header: SessionHeader) -> tuple[list[Event], SessionHeader]:
        subgoals = list(header.subgoals)
        events = []
        for row in self._rows(PLAN_FILE):
            try:
                landmark = landmark_name(row.get("landmark")).label
                status = parse_goal_status(text_of(row.get("status"))).label
            except OntologyError as error:
                self._report.keep(f"{PLAN_FILE}: row left out ({error})")
                continue
            number = self._subgoal(landmark, subgoals, header)
            if number is None:
                self._report.keep(f"{PLAN_FILE}: landmark {landmark} is none of config.json (row left out)")
                continue
            data = {"subgoal": number, "landmark": landmark, "status": status, "cause": "plan"}
            events.append(self._event(row, EventType.SUBGOAL, Role.AGENT, data))
        return events, replace(header, subgoals=subgoals)

    def _subgoal(self, landmark: str, subgoals: list[SubgoalRow], header: SessionHeader) -> int | None:
        """Returns the number of the subgoal at a landmark, which is added if only the plan holds it."""
        for k, subgoal in enumerate(subgoals):
            if header.landmarks[subgoal["landmark"]]["name"] == landmark:
                return k
        rows = [k for k, row in enumerate(header.landmarks) if row["name"] == landmark]
        if not rows:
            return None
        subgoals.append(
            SubgoalRow(description="", landmark=rows[0], after=[], trigger=False, delete=False, change=None)
        )
        return len(subgoals) - 1

    def _detailed_plan(self) -> list[Event]:
        events = []
        for row in self._rows(DETAILED_PLAN_FILE):
            kinds = (
                ("junctions", MentalAction.PLAN_UPDATE, plan_of),
                ("objective", MentalAction.GOAL_UPDATE, goals_of),
            )
            for field, action, read in kinds:
                if row.get(field) is None:
                    continue
                arguments = read(row[field])
                if arguments is None:
                    self._report.keep(f"{DETAILED_PLAN_FILE}: {field} {str(row[field])[:40]!r} (left out)")
                    continue
                data = {"action": action.label, **arguments}
                events.append(self._event(row, EventType.BELIEF_UPDATE, Role.CO_WIZARD, data))
        return events

    def _ad_wizard(self) -> list[Event]:
        path = self._folder / AD_WIZARD_FILE
        if not path.is_file():
            self._report.miss(AD_WIZARD_FILE)
            return []
        events = []
        for number, line in enumerate(read_csv(path, MAX_EVENTS)):
            frame = whole_of(line[1]) if len(line) > 2 else None
            if frame is None or frame < 0:
                if line and number:  # the first line may be a header
                    self._report.repair(f"{AD_WIZARD_FILE}: lines without a frame were left out")
                continue
            events.append(self._exception({"frame": frame}, line[2], line[3:]))
        return events

    def _exception(self, row: dict[str, object], name: str, values: list[str]) -> Event:
        if name.casefold() in MESSAGE_TYPES:
            return self._event(row, EventType.MESSAGE, Role.AD_WIZARD, {"text": plain(", ".join(values))})
        try:
            kind = parse_exception(name)
        except OntologyError:
            kind = ExceptionKind.NONE
        data = _arguments(kind, values)
        if data is None:
            self._report.keep(f"{AD_WIZARD_FILE}: type {name[:40]!r}")
            kept = {"from": Role.AD_WIZARD.sdn_names[0], "values": plain(values)}
            return self._event(row, EventType.OTHER, Role.AD_WIZARD, kept, {"type": f"sdn:{str(plain(name))[:80]}"})
        return self._event(row, EventType.EXCEPTION, Role.AD_WIZARD, {"kind": kind.name.lower(), **data})

    def _rows(self, name: str) -> list[JsonObject]:
        if not (self._folder / name).is_file():
            self._report.miss(name)
            return []
        rows = read_rows(self._folder / name, self._report)
        usable = [row for row in rows if frame_of(row) is not None]
        self._report.repair(f"{name}: rows without a frame were left out", len(rows) - len(usable))
        return sorted(usable, key=lambda row: frame_of(row) or 0)

    def _event(
        self,
        row: JsonObject,
        kind: EventType,
        source: Role,
        data: dict[str, object],
        extra: dict[str, object] | None = None,
    ) -> Event:
        frame = FRAMES_PER_TENTH * max((frame_of(row) or 0) - self._first, 0)
        return Event(frame=frame, type=kind, source=source, data=data, extra=extra or {})


def _arguments(kind: ExceptionKind, values: list[str]) -> dict[str, object] | None:
    """Returns the data of an exception of the Ad-Wizard; None if the layout's description does not name it."""
    numbers = [number_of(value) for value in values]
    if kind is ExceptionKind.WEATHER and len(values) == 2 and numbers[1] is not None:
        return {"parameter": values[0], "value": numbers[1]}
    if kind is ExceptionKind.PLACE_PROP and len(values) >= 1:
        try:
            prop = str(parse_prop(values[0]))
        except OntologyError:
            prop = str(plain(values[0]))
        given = dict(zip(_PROP, values[1:], strict=False))
        places = {name: number_of(value) for name, value in given.items() if name != "id"}
        return {"prop": prop, **{name: place for name, place in places.items() if place is not None}}
    if kind in (ExceptionKind.SPAWN_PEDESTRIANS, ExceptionKind.SPAWN_VEHICLES) and numbers and numbers[0] is not None:
        area = dict(zip(_AREA, numbers[1:5], strict=False))
        return {"count": int(numbers[0]), **{name: value for name, value in area.items() if value is not None}}
    return None


def _key(event: Event) -> str:
    """Returns a key that is equal for two records of one event."""
    return repr(_common(event))


def _common(event: Event) -> tuple[object, ...]:
    data, tenth = event.data, event.frame // FRAMES_PER_TENTH
    if event.type is EventType.EXCEPTION:
        return tenth, event.type, data.get("kind"), data.get("parameter"), data.get("prop")
    if event.type is EventType.SUBGOAL:
        return tenth, event.type, data.get("landmark"), data.get("status")
    if event.type is EventType.BELIEF_UPDATE:
        places = data.get("junctions", data.get("landmarks"))
        return tenth, event.type, data.get("action"), places
    if event.type is EventType.MESSAGE:
        return tenth, event.type, " ".join(str(data.get("text")).replace(",", " ").split())
    return tenth, event.type_name, str(data)
