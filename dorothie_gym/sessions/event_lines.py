"""An event as one line of `events.jsonl`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from dorothie_gym.ontology import Role
from dorothie_gym.sessions.encoding import canonical, from_line, to_line
from dorothie_gym.sessions.errors import SessionError
from dorothie_gym.sessions.events import Event, EventType
from dorothie_gym.sessions.fields import Fields
from dorothie_gym.sessions.layout import MAX_FRAME
from dorothie_gym.sessions.records import check_event

EVENT_FIELDS: Final = ("frame", "type", "source", "flagged", "data")
"""Fields of a line that are not the event's `extra`."""

_TYPES: Final = {kind.value: kind for kind in EventType}
_ROLES: Final = {role.value: role for role in Role}


def encode_event(event: Event, *, check: bool = True) -> str:
    """Returns the event as JSON on one line, keys always in the same order.

    Args:
        event: the event.
        check: whether its data is checked; what was read was checked then.

    Raises:
        SessionError: its data is not what its type says, or cannot be written; the message names the field.
    """
    where = f"event {event.type.value} at frame {event.frame}"
    extra = canonical(event.extra, f"{where}: extra")
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
        event_of(values, where)  # what cannot be read back must not be written
    return to_line({**values, **{name: value for name, value in extra.items() if name not in known}})


def decode_event(line: str, where: str) -> Event:
    """Reads what `encode_event` returned; raises `SessionError`, beginning with `where`, naming the field."""
    return event_of(from_line(line, where), where)


def event_of(values: Mapping[str, Any], where: str) -> Event:
    """Returns the event of a line's fields.

    A type that this version does not know gives an event of type `OTHER`, and fields that it does not know its `extra`.

    Raises:
        SessionError: a field is missing or wrong; the message begins with `where` and names it.
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
