"""An event as one line of `events.jsonl`."""

from __future__ import annotations

from typing import TypeVar

from dorothie_gym.ontology import Role
from dorothie_gym.sessions.encoding import canonical, from_line, to_line
from dorothie_gym.sessions.events import Event, EventType
from dorothie_gym.sessions.fields import Fields
from dorothie_gym.sessions.records import check_event

_Choice = TypeVar("_Choice", EventType, Role)


def encode_event(event: Event) -> str:
    """Returns the event as JSON on one line, keys always in the same order.

    Raises:
        SessionError: its data is not what its type says, or cannot be written; the message names the field.
    """
    where = f"event {event.type.value} at frame {event.frame}"
    line = to_line(
        {
            "frame": canonical(event.frame, f"{where}: frame"),
            "type": event.type.value,
            "source": event.source.value,
            "flagged": canonical(event.flagged, f"{where}: flagged"),
            "data": canonical(event.data, f"{where}: data"),
        }
    )
    decode_event(line, where)  # what cannot be read back must not be written
    return line


def decode_event(line: str, where: str) -> Event:
    """Reads what `encode_event` returned; raises `SessionError`, beginning with `where`, naming the field."""
    fields = Fields(from_line(line, where), where)
    event = Event(
        frame=fields.integer("frame", 0),
        type=_choice(fields, "type", EventType),
        source=_choice(fields, "source", Role),
        flagged=fields.flag("flagged"),
        data=fields.mapping("data"),
    )
    check_event(event, where)
    return event


def _choice(fields: Fields, name: str, choices: type[_Choice]) -> _Choice:
    text = fields.text(name)
    if text not in {choice.value for choice in choices}:
        raise fields.error(name, f"one of {', '.join(choice.value for choice in choices)}")
    return choices(text)
