"""Session events from SDN's event log."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from dorothie_gym.archive.sdn.files import (
    MORE,
    OURS,
    JsonObject,
    frame_of,
    more_of,
    number_of,
    plain,
    plain_object,
    whole_of,
)
from dorothie_gym.archive.sdn.landmark_names import landmark_name
from dorothie_gym.archive.sdn.moves import MoveReader, read_speech
from dorothie_gym.errors import OntologyError, SessionError
from dorothie_gym.ontology.actions import (
    LANE_SWITCH_LEFT,
    LANE_SWITCH_RIGHT,
    NAVIGATION_ACTIONS,
    ArgumentKind,
    MentalAction,
    PhysicalAction,
)
from dorothie_gym.ontology.labelled_enums import normalise
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_goal_status, parse_mental_action, parse_physical_action, parse_role
from dorothie_gym.session.recording.events import Event, EventType, check_event
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.session.recording.validation import ReadReport

if TYPE_CHECKING:
    from dorothie_gym.archive.sdn.audio import AudioFiles

RIGHT: Final = 2
"""Value of a LaneSwitch to the right; 1 and 3 are left (spec: sdn-format)."""

LEFT: Final = 3
"""Value written for a LaneSwitch to the left; the published code reads it as +90 degrees."""

_SIDES: Final = {"left": LEFT, "right": RIGHT, "directionleft": LEFT, "directionright": RIGHT}
_ARGUMENTS: Final = ("angle", "roadid", "direction", "speed", "light")

_ON: Final = {"on": True, "off": False, "true": True, "false": False, "1": True, "0": False}


@dataclass
class ActionReader:
    """Turns the values of rows into the data of actions and beliefs.

    Attributes:
        report: receives unknown values.
        lane_switches: counts of the values of LaneSwitch.
        roads: road of each JTurn that names one, by number of the JTurn, counted from 0.
        turns: number of JTurns read so far.
    """

    report: ReadReport
    lane_switches: Counter[str] = field(default_factory=Counter)
    roads: dict[int, int] = field(default_factory=dict)
    turns: int = 0

    def physical(self, val: JsonObject) -> dict[str, object]:
        """Returns the data of a physical action, with the angle of a JTurn as in the file.

        Raises:
            OntologyError: the action is unknown.
        """
        name = val.get("act")
        number = whole_of(name) if not isinstance(name, str) or name.isdecimal() else None
        if number is not None and number in PhysicalAction._value2member_map_:
            action = PhysicalAction(number)
        else:
            action = parse_physical_action(str(name))
        angle: float | None = None
        up: bool | None = None
        slot_type, value = _argument(val)
        kind = action.argument
        if kind is ArgumentKind.ANGLE:
            angle = self._turn(slot_type, value)
        elif kind is ArgumentKind.SIDE:
            angle = self._side(value)
        elif kind is ArgumentKind.SPEED_STEP:
            step = number_of(value)
            up = None if not step else step > 0
        elif kind is ArgumentKind.SWITCH:
            up = value if isinstance(value, bool) else _ON.get(str(value).strip().casefold())
        if kind is not ArgumentKind.NONE and angle is None and up is None:
            self.report.miss(f"argument of {action.label}")
        return {"action": action.label, "angle": angle, "up": up}

    def belief(self, val: JsonObject) -> dict[str, object]:
        """Returns the data of a belief update; unknown arguments are kept.

        Raises:
            OntologyError: the update is unknown.
        """
        action = parse_mental_action(str(val.get("act")))
        value = val.get("slot_val")
        arguments: dict[str, object] | None = {}
        if action is MentalAction.PLAN_UPDATE:
            arguments = plan_of(value)
        elif action is MentalAction.GOAL_UPDATE:
            arguments = goals_of(value)
        elif action is MentalAction.STATUS_UPDATE:
            arguments = _status_of(value)
        elif action is MentalAction.KNOWLEDGE_UPDATE:
            arguments = _guess_of(value)
        if arguments is None:
            self.report.keep(f"argument of {action.label}")
            return {"action": action.label, "sdn": plain_object(val)}
        return {"action": action.label, **arguments}

    def _turn(self, slot_type: object, value: object) -> float | None:
        turn = self.turns
        self.turns += 1
        if normalise(str(slot_type)) == "roadid":
            road = whole_of(value)
            if road is not None:
                self.roads[turn] = road
            return None
        angle = number_of(value)
        return None if angle is None else (angle + 180.0) % 360.0 - 180.0

    def _side(self, value: object) -> float | None:
        number = _SIDES.get(normalise(value), whole_of(value)) if isinstance(value, str) else whole_of(value)
        self.lane_switches[str(value)[:20]] += 1
        if number is None or number not in (1, RIGHT, LEFT):
            return None
        return LANE_SWITCH_RIGHT if number == RIGHT else LANE_SWITCH_LEFT


def _argument(val: JsonObject) -> tuple[object, object]:
    """Returns type and value of the argument of an action, which some files wrap in an object."""
    slot_type, value = val.get("slot_type"), val.get("slot_val")
    if not isinstance(value, Mapping):
        return slot_type, value
    if "slot_type" in value:
        return value["slot_type"], value.get("slot_val")
    if len(value) == 1:
        return next(iter(value.items()))
    named = next((name for name in value if normalise(str(name)) in _ARGUMENTS), None)
    return (slot_type, None) if named is None else (named, value[named])


def plan_of(value: object) -> dict[str, object] | None:
    """Returns the junctions of a plan; None if the value is not a plan."""
    items = value if isinstance(value, list) else [value]
    junctions = [whole_of(item.get("junction_id") if isinstance(item, Mapping) else item) for item in items]
    return None if None in junctions else {"junctions": junctions}


def goals_of(value: object) -> dict[str, object] | None:
    """Returns the landmarks of goals; None if the value holds none."""
    items = value if isinstance(value, list) else [value]
    try:
        return {"landmarks": [landmark_name(item).label for item in items]}
    except OntologyError:
        return None


def _status_of(value: object) -> dict[str, object] | None:
    if isinstance(value, Mapping):
        value = [value.get("landmark", value), value.get("status")]
    if not isinstance(value, list) or len(value) != 2:
        return None
    landmark, status = value
    try:
        return {"landmark": landmark_name(landmark).label, "status": parse_goal_status(str(status)).label}
    except OntologyError:
        return None


def _guess_of(value: object) -> dict[str, object] | None:
    if isinstance(value, Mapping):
        landmark = value.get("landmark", value.get("asset"))
        value = [value.get("x"), value.get("y"), *([] if landmark is None else [landmark])]
    if not isinstance(value, list) or len(value) not in (2, 3):
        return None
    x, y = number_of(value[0]), number_of(value[1])
    if x is None or y is None:
        return None
    guess: dict[str, object] = {"x": x, "y": y}
    if len(value) == 3 and isinstance(value[2], str | Mapping):
        try:
            guess["landmark"] = landmark_name(value[2]).label
        except OntologyError:
            return None
    return guess


# --- Rows of the log -------------------------------------------------------------------------------------------------

_KINDS: Final = {
    "dialoguemove": EventType.DIALOGUE_MOVE,
    "dialogue": EventType.DIALOGUE_MOVE,
    "physicalaction": EventType.PHYSICAL_ACTION,
    "physical": EventType.PHYSICAL_ACTION,
    "beliefupdate": EventType.BELIEF_UPDATE,
    "planning": EventType.BELIEF_UPDATE,
}
_NATIVE: Final = {kind.value.casefold(): kind for kind in EventType} | {"exception": EventType.EXCEPTION}

_FIELDS: Final = {
    "frame", "type", "from", "to", "flag", "act", "val", "utterance", "utterance_gt", "utterance_filename", MORE,
}  # fmt: skip

SPEECH: Final = "speech"

FOREIGN: Final = "sdn:"
"""Prefix of the type of a row that is kept unchanged."""


def sorted_rows(rows: Sequence[JsonObject], name: str, report: ReadReport) -> list[JsonObject]:
    """Returns the rows with a frame and a type, in order of their frames."""
    usable = [row for row in rows if frame_of(row) is not None and isinstance(row.get("type"), str)]
    report.repair(f"{name}: rows without a frame or a type were left out", len(rows) - len(usable))
    frames = [frame_of(row) or 0 for row in usable]
    report.repair(
        f"{name}: rows were out of order by frame, and were put in order",
        sum(later < earlier for earlier, later in itertools.pairwise(frames)),
    )
    return sorted(usable, key=lambda row: frame_of(row) or 0)


class LogReader:
    """Reads the rows of a log.

    Args:
        rows: the rows, sorted.
        first_frame: frame (10 Hz) at which the session begins.
        name: name of the file, for the report.
        report: receives missing, unknown and repaired values.
        audio: the audio files of the session; None for sessions of this package that have none.
    """

    def __init__(
        self,
        rows: Sequence[JsonObject],
        first_frame: int,
        name: str,
        report: ReadReport,
        *,
        audio: AudioFiles | None,
    ) -> None:
        self._rows = rows
        self._first = first_frame
        self._name = name
        self._report = report
        self.actions = ActionReader(report)
        speech = read_speech((row for row in rows if _type(row) == SPEECH), report, role_of)
        self._moves = MoveReader(speech, first_frame, report, audio=audio)
        if speech:
            report.facts["stretches_of_speech"] = len(speech)

    def events(self) -> list[Event]:
        """Returns the events, in the order of the rows."""
        return [self._event(row) for row in self._rows if _type(row) != SPEECH]

    def _event(self, row: JsonObject) -> Event:
        frame, kind = frame_of(row) or 0, _KINDS.get(_type(row))
        try:
            if isinstance(row.get(OURS), Mapping):
                return self._ours(row, frame)
            source = role_of(row)
            if kind is None or source is None:
                raise OntologyError(f"type {row['type']!r} or from {row.get('from')!r} is unknown")
            data, flagged = self._read(kind, row, frame, source)
            data.update(self._rest(row, kind.value))
            extra = more_of(row)
            time = self._time(frame)
            event = Event(frame=time, type=kind, source=source, flagged=flagged, data=data, extra=extra)
            check_event(event, "")
        except (OntologyError, SessionError) as error:
            return self._unknown(row, frame, str(error))
        return event

    def _read(self, kind: EventType, row: JsonObject, frame: int, source: Role) -> tuple[dict[str, object], bool]:
        """Returns the data of a row, and whether it is a prediction point."""
        val = row.get("val")
        val = val if isinstance(val, Mapping) else {}
        if kind is EventType.DIALOGUE_MOVE:
            is_sample = "act" not in row and "act" in val
            data = self._moves.sample(row, val, frame, source) if is_sample else self._moves.release(row, frame, source)
            return data, self._flag(row, source in (Role.PARTICIPANT, Role.CO_WIZARD))
        if kind is EventType.PHYSICAL_ACTION:
            data = {**self.actions.physical(val), **more_of(val)}
            navigates = parse_physical_action(str(data["action"])) in NAVIGATION_ACTIONS
            return data, self._flag(row, source is Role.CO_WIZARD and navigates)
        return {**self.actions.belief(val), **more_of(val)}, self._flag(row, False)

    def _flag(self, row: JsonObject, otherwise: bool) -> bool:
        if "flag" not in row:
            self._report.miss(f"{self._name}: flag (taken from the kind of event)")
            return otherwise
        return str(row["flag"]).strip().casefold() in ("true", "1", "1.0")

    def _rest(self, row: JsonObject, kind: str) -> dict[str, object]:
        """Returns the unknown fields of a row."""
        rest = {name: value for name, value in row.items() if name not in _FIELDS}
        for name in rest:
            self._report.keep(f"{self._name}: field {str(name)!r} of {kind}")
        return {"sdn": plain_object(rest)} if rest else {}

    def _ours(self, row: JsonObject, frame: int) -> Event:
        """Returns an event of this package that the layout cannot represent."""
        ours, val = row[OURS], row.get("val")
        name = str(plain(row["type"])).strip()
        kind = _NATIVE.get(name.casefold(), EventType.OTHER)
        extra = ours.get("extra") if isinstance(ours, Mapping) else None
        event = Event(
            frame=self._time(frame),
            type=kind,
            source=role_of(row) or Role.AGENT,
            flagged=bool(row.get("flag")),
            data=plain_object(val) if isinstance(val, Mapping) else {},
            extra={
                **({"type": name} if kind is EventType.OTHER else {}),
                **(plain_object(extra) if isinstance(extra, Mapping) else {}),
            },
        )
        check_event(event, f"{self._name}, frame {frame}")
        return event

    def _unknown(self, row: JsonObject, frame: int, reason: str) -> Event:
        name = str(plain(row["type"])).strip()[:80]
        self._report.keep(f"{self._name}: row of type {name!r} ({reason.strip(': ')[:120]})")
        rest = {key: value for key, value in row.items() if key not in ("frame", "type")}
        return Event(
            frame=self._time(frame),
            type=EventType.OTHER,
            source=role_of(row) or Role.AGENT,
            data=plain_object(rest),
            extra={"type": FOREIGN + name},
        )

    def _time(self, frame: int) -> int:
        return FRAMES_PER_TENTH * max(frame - self._first, 0)


def role_of(row: JsonObject) -> Role | None:
    """Returns the role that is the source of a row; None for an unknown name."""
    name = row.get("from")
    try:
        return parse_role(name.strip()) if isinstance(name, str) else None
    except OntologyError:
        return None


def _type(row: JsonObject) -> str:
    return str(row["type"]).strip().casefold()
