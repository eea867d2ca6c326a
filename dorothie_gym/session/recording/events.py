"""Events of a session: types, encoding, and typed records of moves, utterances, actions and infractions."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from dorothie_gym.dialogue.propositions import Proposition, read_meaning
from dorothie_gym.errors import OntologyError, SessionError, short_repr
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.ontology.spellings import parse_act, parse_physical_action
from dorothie_gym.session.recording.files import MAX_FRAME, Fields, canonical, canonical_object, from_line, to_line
from dorothie_gym.sim.config import FRAME_RATE

EXCHANGE_UNIT: Final = "exchange_unit"
"""Field of the first dialogue move of an exchange, where people have annotated it: exception ("environmental", "task",
"none" or null) that the exchange handles, end ("fulfilled", "abandoned" or null)."""

TRANSACTION_UNIT: Final = "transaction_unit"
"""Field of the first dialogue move of a transaction, where people have annotated it: goal (landmark label or null), end
("completed", "interrupted", "abandoned" or null)."""


class EventType(enum.StrEnum):
    """Types of events, with the fields of their `data` (JSON types only)."""

    DIALOGUE_MOVE = "DialogueMove"
    """One dialogue act: utterance (number), text (of the whole utterance), span (words of this act), move, slots
    ({slot label: [value labels]}), exchange (number or null), start and end [s]; if known, transaction
    (number), recognised (words that a speech recogniser returned for the whole utterance), fluent (words of this act
    without hesitations, restarts and withdrawn names, where it has any), meaning (the propositions of the span, see
    `dialogue.propositions`), audio (name of the file with this act's audio), `EXCHANGE_UNIT` and `TRANSACTION_UNIT`."""
    PHYSICAL_ACTION = "PhysicalAction"
    """Effective action of the Co-Wizard: action (label), angle (degrees, positive left, or null), up (or
    null)."""
    BELIEF_UPDATE = "BeliefUpdate"
    """Mental action: action (label) and its arguments (junctions, landmarks, landmark, status, x, y)."""
    EXCEPTION = "Exception"
    """Effective exception: kind (lower-case name) and its arguments; for a task exception, the subgoal and
    its landmark, by label and by row of the header's landmarks (row)."""
    MESSAGE = "Message"
    """Message of the Ad-Wizard to the participant: text."""
    REFUSAL = "Refusal"
    """Well-formed action that was not carried out: action, reason."""
    HAZARD_STOP = "HazardStop"
    """The car begins to brake for an object ahead: reason (object class label), distance [m]."""
    HAZARD_END = "HazardEnd"
    """The car drives on: reason, seconds."""
    SUBGOAL = "Subgoal"
    """Status change of a subgoal: subgoal (number), landmark (label), status (label), cause (arrival, trigger, ...)."""
    COLLISION = "Collision"
    """The car hits an object: other (class label), key (number of the object, constant while it is
    there), lane, station [m], x, y [m] (where the car is), own_fault (bool), speed [m/s]. Older recordings lack place
    and key."""
    RED_LIGHT = "RedLight"
    """The car passes a red light: lane (that it leaves), station, x, y [m], key (id of the signal), other (class label
    of the signal)."""
    STOP_SIGN = "StopSign"
    """The car passes a stop sign without standing before it: as RED_LIGHT."""
    OFF_ROAD = "OffRoad"
    """The car leaves the road: lane (the nearest), station, x, y [m]; key and other are null."""
    WRONG_WAY = "WrongWay"
    """The car drives against the traffic: lane (that it is on), station, x, y [m]; key and other are null."""
    END = "End"
    """End of the session: success (bool), reason (an `EndReason`, or that of another version or corpus)."""
    OTHER = "Other"
    """Type unknown to this version: its name is in `Event.extra`, and the data is kept unchanged."""


class EndReason(enum.StrEnum):
    """Reasons for the end of a session: those of the engine, and those of people who break it off."""

    ARRIVED = "arrived"
    """The destination, the last live subgoal, was reached."""
    OUT_OF_TIME = "out of time"
    """The time limit of the session was reached."""
    LEFT = "left"
    """A person left and did not come back in time."""
    ENDED = "ended"
    """The experimenter ended the session."""
    TECHNICAL = "technical"
    """The program that ran the session failed or was stopped."""

    @property
    def breaks_off(self) -> bool:
        """Whether people or the program ended the session between two decisions, and not the engine."""
        return self not in (EndReason.ARRIVED, EndReason.OUT_OF_TIME)


INFRACTIONS = (EventType.COLLISION, EventType.RED_LIGHT, EventType.STOP_SIGN, EventType.OFF_ROAD, EventType.WRONG_WAY)
"""Events that report an infraction of the traffic rules."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Event of a session.

    Attributes:
        frame: physics frame at 30 Hz (of a dialogue move: the frame in which its utterance ended).
        type: type of the event.
        source: role that caused it; the car itself is `Role.AGENT`.
        flagged: whether it is a prediction point (dialogue moves of the participant and the Co-Wizard,
            navigation actions of the Co-Wizard).
        data: JSON-able details, see `EventType`.
        extra: further fields of the event (JSON types).
    """

    frame: int
    type: EventType
    source: Role
    flagged: bool = False
    data: Mapping[str, object] = field(default_factory=dict)
    extra: Mapping[str, object] = field(default_factory=dict)

    @property
    def type_name(self) -> str:
        """Name of the type in the file; for an event of another version or corpus, its original name."""
        return str(self.extra.get("type", self.type.value)) if self.type is EventType.OTHER else self.type.value

    @property
    def time(self) -> float:
        """Seconds since the start of the session."""
        return self.frame / FRAME_RATE


# --- Typed records ---------------------------------------------------------------------------------------------------

_OBJECT_CLASSES = {kind.label: kind for kind in ObjectClass}
_PLACE_FIELDS = ("lane", "station", "x", "y", "key", "other")


@dataclass(frozen=True, kw_only=True)
class MoveRecord:
    """Dialogue move.

    Attributes:
        index: number of its event in the session.
        frame: frame in which its utterance ended.
        speaker: role that spoke.
        utterance: number of its utterance.
        text: words of the whole utterance.
        span: words of this move.
        act: move and slots.
        exchange: number of the exchange; None if unknown.
        start, end: start and end of the utterance [s].
        flagged: whether it is a prediction point.
        transaction: number of the transaction; None if unknown.
        recognised: words that a speech recogniser returned for the whole utterance; None without a recogniser.
        meaning: propositions that the speaker states, asks or requests; empty if they are unknown.
        fluent: words of this move without hesitations, restarts and withdrawn names; None if it has none.
    """

    index: int
    frame: int
    speaker: Role
    utterance: int
    text: str
    span: str
    act: DialogueAct
    exchange: int | None
    start: float
    end: float
    flagged: bool
    transaction: int | None = None
    recognised: str | None = None
    meaning: tuple[Proposition, ...] = ()
    fluent: str | None = None


@dataclass(frozen=True, kw_only=True)
class ActionRecord:
    """Physical action.

    Attributes:
        index: number of its event in the session.
        frame: frame of the action.
        source: role that acted.
        action: the action.
        angle: its argument [degrees, positive left]; None if it has none or it was not recorded.
        up: direction of a change of speed or light; None for other actions.
        flagged: whether it is a prediction point.
    """

    index: int
    frame: int
    source: Role
    action: PhysicalAction
    angle: float | None
    up: bool | None
    flagged: bool


@dataclass(frozen=True, kw_only=True)
class InfractionRecord:
    """Infraction of the traffic rules.

    Attributes:
        index: number of its event in the session.
        frame: frame of the infraction.
        type: the rule: one of `events.INFRACTIONS`.
        lane: lane of the car; None if not recorded, like `station`.
        station: distance along the lane [m].
        x: x coordinate of the car [m], or None; `y` is the y coordinate.
        key: number of the counterpart (of a body, or of a light or sign); None without one.
        other: class of the counterpart; None without one.
        own_fault: whether the car ran into the counterpart of a collision; True for the other types.
    """

    index: int
    frame: int
    type: EventType
    lane: int | None
    station: float | None
    x: float | None
    y: float | None
    key: int | None
    other: ObjectClass | None
    own_fault: bool


@dataclass(frozen=True, kw_only=True)
class UtteranceRecord:
    """Utterance with its moves, in order of their spans."""

    number: int
    speaker: Role
    text: str
    start: float
    end: float
    moves: tuple[MoveRecord, ...]

    @property
    def frame(self) -> int:
        """Frame at which its last move was recorded."""
        return max(move.frame for move in self.moves)


def move_record(event: Event, index: int, where: str = "event") -> MoveRecord:
    """Returns the move of an event of type `DIALOGUE_MOVE`; raises `SessionError` naming the field."""
    data = Fields(event.data, f"{where}, data")
    return MoveRecord(
        index=index,
        frame=event.frame,
        speaker=event.source,
        utterance=data.integer("utterance", 0),
        text=data.text("text"),
        span=data.text("span"),
        act=_act(data),
        exchange=data.optional("exchange", data.integer),
        start=data.number("start"),
        end=data.number("end"),
        flagged=event.flagged,
        transaction=data.if_given("transaction", data.integer),
        recognised=data.if_given("recognised", data.text),
        meaning=_meaning(data),
        fluent=data.if_given("fluent", data.text),
    )


def _meaning(data: Fields) -> tuple[Proposition, ...]:
    rows = data.if_given("meaning", data.anything)
    try:
        return () if rows is None else read_meaning(rows, "field 'meaning'")
    except ValueError as error:
        raise SessionError(f"{data.where}: {error}") from None


def action_record(event: Event, index: int, where: str = "event") -> ActionRecord:
    """Returns the action of an event of type `PHYSICAL_ACTION`; raises `SessionError` naming the field."""
    data = Fields(event.data, f"{where}, data")
    try:
        action = parse_physical_action(data.text("action"))
    except OntologyError as error:
        raise SessionError(f"{data.where}: field 'action': {error}") from None
    return ActionRecord(
        index=index,
        frame=event.frame,
        source=event.source,
        action=action,
        angle=data.optional("angle", data.number),
        up=data.optional("up", data.flag),
        flagged=event.flagged,
    )


def infraction_record(event: Event, index: int, where: str = "event") -> InfractionRecord:
    """Returns the infraction of an event of `INFRACTIONS`; raises `SessionError` naming the field."""
    data = Fields({**dict.fromkeys(_PLACE_FIELDS), **event.data}, f"{where}, data")
    other = data.optional("other", data.text)
    if other is not None and other not in _OBJECT_CLASSES:
        raise data.error("other", "the label of an object class")
    collision = event.type is EventType.COLLISION
    place = data.integer if not collision else lambda name: data.optional(name, data.integer)
    number = data.number if not collision else lambda name: data.optional(name, data.number)
    return InfractionRecord(
        index=index,
        frame=event.frame,
        type=event.type,
        lane=place("lane"),
        station=number("station"),
        x=number("x"),
        y=number("y"),
        key=data.optional("key", data.integer),
        other=None if other is None else _OBJECT_CLASSES[other],
        own_fault=data.flag("own_fault") if collision else True,
    )


def utterance_records(moves: Iterable[MoveRecord]) -> tuple[UtteranceRecord, ...]:
    """Returns the utterances that the moves belong to, in order of their first move."""
    groups: dict[tuple[Role, int], list[MoveRecord]] = {}
    for move in moves:
        groups.setdefault((move.speaker, move.utterance), []).append(move)
    return tuple(
        UtteranceRecord(
            number=group[0].utterance,
            speaker=group[0].speaker,
            text=group[0].text,
            start=group[0].start,
            end=group[0].end,
            moves=tuple(group),
        )
        for group in groups.values()
    )


def check_event(event: Event, where: str = "event") -> None:
    """Raises `SessionError` naming the field if the data of an event does not match its type."""
    if event.type is EventType.DIALOGUE_MOVE:
        move_record(event, 0, where)
    elif event.type is EventType.PHYSICAL_ACTION:
        action_record(event, 0, where)
    elif event.type in INFRACTIONS:
        infraction_record(event, 0, where)


def _act(data: Fields) -> DialogueAct:
    slots: dict[str, Sequence[str]] = {}
    for slot, values in data.mapping("slots").items():
        if not isinstance(values, list | tuple) or not all(isinstance(value, str) for value in values):
            raise SessionError(
                f"{data.where}: field 'slots.{slot}' is {short_repr(values)}; it must be a list of texts"
            )
        slots[slot] = values
    move = data.text("move")
    try:
        return parse_act(move, slots)
    except OntologyError as error:
        raise SessionError(f"{data.where}: fields 'move' and 'slots': {error}") from None


# --- Encoding as one line of `events.jsonl` ---------------------------------------------------------------------------

EVENT_FIELDS: Final = ("frame", "type", "source", "flagged", "data")
"""Fields of a line that are not the event's `extra`."""

_TYPES: Final = {kind.value: kind for kind in EventType}
_ROLES: Final = {role.value: role for role in Role}


def encode_event(event: Event, *, check: bool = True) -> str:
    """Returns the event as JSON on one line, keys always in the same order.

    Args:
        event: the event.
        check: whether its data is checked; events that were read are already checked.

    Raises:
        SessionError: its data does not match its type or cannot be written; the message names the field.
    """
    where = f"event {event.type.value} at frame {event.frame}"
    extra = canonical_object(event.extra, f"{where}: extra")
    values = {
        "frame": canonical(event.frame, f"{where}: frame"),
        "type": event.type_name,
        "source": event.source.value,
        "flagged": canonical(event.flagged, f"{where}: flagged"),
        "data": canonical(event.data, f"{where}: data"),
    }
    known = ("type",) if event.type is EventType.OTHER else ()
    clash = sorted(set(extra) & set(EVENT_FIELDS) - set(known))
    if clash:
        raise SessionError(f"{where}: extra has {clash[0]!r}, which is a field of its own")
    if check:
        event_of(values, where)  # data that cannot be read back must not be written
    return to_line({**values, **{name: value for name, value in extra.items() if name not in known}})


def decode_event(line: str, where: str) -> Event:
    """Returns the event of a line; raises `SessionError` with `where` and the field if it is malformed."""
    return event_of(from_line(line, where), where)


def event_of(values: Mapping[str, object], where: str) -> Event:
    """Returns the event of a line's fields.

    A type unknown to this version gives an event of type `OTHER`; unknown fields become its `extra`.

    Raises:
        SessionError: a field is missing or wrong; the message holds `where` and the field.
    """
    fields = Fields(values, where)
    frame = fields.integer("frame", 0)
    if frame >= MAX_FRAME:
        raise fields.error("frame", f"below {MAX_FRAME}")
    name, source = fields.text("type"), fields.text("source")
    if source not in _ROLES:
        raise fields.error("source", f"one of {', '.join(_ROLES)}")
    kind = _TYPES.get(name, EventType.OTHER)
    extra = fields.others(EVENT_FIELDS) if len(values) > len(EVENT_FIELDS) else {}
    if kind is EventType.OTHER and name != kind.value:
        extra = {"type": name, **extra}
    event = Event(
        frame=frame,
        type=kind,
        source=_ROLES[source],
        flagged=fields.flag("flagged"),
        data=fields.mapping("data"),
        extra=extra,
    )
    check_event(event, where)
    return event
