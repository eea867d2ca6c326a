"""Signals and crosswalks of the roads of an OpenDRIVE file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.errors import TownError
from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.opendrive.elements import SPEED_UNITS, Element, ElementReader
from dorothie_gym.maps.opendrive.records import CrosswalkRecord, SignalRecord

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

# Corner elements of an object: in its own frame, or on its road.
_CORNERS = (("cornerLocal", ("u", "v")), ("cornerRoad", ("s", "t")))


def read_signals(reader: ElementReader, road: Element) -> tuple[SignalRecord, ...]:
    """Returns signals and references to signals of other roads, in the order of the file."""
    found = (e for e in road.iterfind("signals/*") if e.tag in ("signal", "signalReference"))
    return tuple(reader.attempts(NoteKind.SIGNAL, found, lambda element: _signal(reader, element)))


def read_crosswalks(reader: ElementReader, road: Element) -> tuple[CrosswalkRecord, ...]:
    """Returns the crosswalk objects with an outline, or with length and width."""
    objects = (e for e in road.iterfind("objects/object") if e.get("type", "").lower() == "crosswalk")
    return tuple(reader.attempts(NoteKind.CROSSWALK, objects, lambda element: _crosswalk(reader, element)))


def _signal(reader: ElementReader, element: Element) -> SignalRecord:
    return SignalRecord(
        id=reader.reference(element, "id", "signal", reader.signals),
        type=element.get("type", ""),
        dynamic=element.get("dynamic") == "yes",
        value=_value(reader, element),
        s=reader.number(element, "s"),
        t=reader.number(element, "t", 0.0),
        z=reader.number(element, "zOffset", 0.0),
        heading=reader.number(element, "hOffset", 0.0),
        orientation=element.get("orientation", "none"),
        lanes=tuple((reader.integer(e, "fromLane"), reader.integer(e, "toLane")) for e in element.iterfind("validity")),
        reference=element.tag == "signalReference",
    )


def _value(reader: ElementReader, element: Element) -> float | None:
    """Returns the value of a sign, limits in m/s; None for -1 and an empty text."""
    if element.get("value") in (None, "", "-1"):
        return None
    try:
        value = reader.number(element, "value") * SPEED_UNITS.get(element.get("unit") or "km/h", 1.0)
    except TownError as error:  # the sign stands there, whatever is written on it
        reader.notes.assumed(NoteKind.SIGNAL, error.element, f"has no value: {error.reason}")
        return None
    return value if value >= 0.0 else None


def _crosswalk(reader: ElementReader, element: Element) -> CrosswalkRecord:
    """Reads a crosswalk from its first outline, which is the outer one."""
    for tag, names in _CORNERS:
        outline = next((o for o in element.iter("outline") if o.find(tag) is not None), None)
        if outline is not None:
            corners = np.array([[reader.number(c, name) for name in names] for c in outline.iterfind(tag)])
            break
    else:
        tag, corners = "cornerLocal", _rectangle(reader, element)
    if len(corners) < 3:
        reader.fail(element, "has neither an outline of three corners nor a length and a width")
    return CrosswalkRecord(
        s=reader.number(element, "s"),
        t=reader.number(element, "t", 0.0),
        heading=reader.number(element, "hdg", 0.0),
        corners=_open_ring(corners),
        on_road=tag == "cornerRoad",
    )


def _rectangle(reader: ElementReader, element: Element) -> Array:
    """Returns the corners (4, 2) of an object with length and width only, or none without these."""
    u, v = (0.5 * reader.number(element, name, 0.0) for name in ("length", "width"))
    return np.array([[-u, -v], [u, -v], [u, v], [-u, v]]) if u > 0.0 and v > 0.0 else np.empty((0, 2))


def _open_ring(corners: Array) -> Array:
    """Returns the outline without a repeated first corner at its end."""
    return corners[:-1] if len(corners) > 3 and np.allclose(corners[0], corners[-1]) else corners
