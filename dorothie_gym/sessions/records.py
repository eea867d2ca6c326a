"""Events read as what they are: moves, utterances, physical actions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from dorothie_gym.ontology import (
    DialogueAct,
    ObjectClass,
    OntologyError,
    PhysicalAction,
    Role,
    parse_act,
    parse_physical_action,
)
from dorothie_gym.sessions.errors import SessionError, shown
from dorothie_gym.sessions.events import INFRACTIONS, Event, EventType
from dorothie_gym.sessions.fields import Fields

_OBJECT_CLASSES = {kind.label: kind for kind in ObjectClass}
_PLACE_FIELDS = ("lane", "station", "x", "y", "key", "other")


@dataclass(frozen=True, kw_only=True)
class MoveRecord:
    """One dialogue move.

    Attributes:
        index: number of its event in the session.
        frame: frame at which its utterance was over.
        speaker: who spoke.
        utterance: number of its utterance.
        text: words of the whole utterance.
        span: words of this move.
        act: move and slots.
        exchange: number of the exchange, None where unknown.
        start, end: when the utterance began and was over [s].
        flagged: whether it is a point of the benchmark.
        transaction: number of the transaction, None where unknown.
        recognised: what a speech recogniser heard of the whole utterance, None where there was none.
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


@dataclass(frozen=True, kw_only=True)
class ActionRecord:
    """One physical action.

    Attributes:
        index: number of its event in the session.
        frame: when it was done.
        source: who did it.
        action: the action.
        angle: its argument [degrees, positive left]; None where it has none or the recording does not know it.
        up: direction of a change of speed or light, None for other actions.
        flagged: whether it is a point of the benchmark.
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
    """One breach of the rules of the road.

    Attributes:
        index: number of its event in the session.
        frame: when it happened.
        type: which rule: one of `events.INFRACTIONS`.
        lane: where it happened, None where the recording does not know it; `station` likewise.
        station: distance along the lane [m].
        x: of the car [m], or None; `y` likewise.
        key: number of the counterpart (of a body, or of a light or sign), None where there is none.
        other: class of the counterpart, None where there is none.
        own_fault: of a collision: whether the car ran into it; True for the others.
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
    """The moves of one utterance, in order of their spans."""

    number: int
    speaker: Role
    text: str
    start: float
    end: float
    moves: tuple[MoveRecord, ...]


def move_record(event: Event, index: int, where: str = "event") -> MoveRecord:
    """Returns the move that an event of type `DIALOGUE_MOVE` holds; raises `SessionError` naming the field."""
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
    )


def action_record(event: Event, index: int, where: str = "event") -> ActionRecord:
    """Returns the action that an event of type `PHYSICAL_ACTION` holds; raises `SessionError` naming the field."""
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
    """Returns the breach that an event of `INFRACTIONS` tells of; raises `SessionError` naming the field."""
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
    """Does nothing if the event holds what its type says; raises `SessionError` naming the field otherwise."""
    if event.type is EventType.DIALOGUE_MOVE:
        move_record(event, 0, where)
    elif event.type is EventType.PHYSICAL_ACTION:
        action_record(event, 0, where)
    elif event.type in INFRACTIONS:
        infraction_record(event, 0, where)


def _act(data: Fields) -> DialogueAct:
    slots = data.mapping("slots")
    for slot, values in slots.items():
        if not isinstance(values, list | tuple) or not all(isinstance(value, str) for value in values):
            raise SessionError(f"{data.where}: field 'slots.{slot}' is {shown(values)}; it must be a list of texts")
    return _parse(data.text("move"), slots, data.where)


def _parse(move: str, slots: Mapping[str, Any], where: str) -> DialogueAct:
    try:
        return parse_act(move, slots)
    except OntologyError as error:
        raise SessionError(f"{where}: fields 'move' and 'slots': {error}") from None
