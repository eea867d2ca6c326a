"""Signals and crosswalks of a road, from their XML elements to records."""

from __future__ import annotations

import numpy as np

from dorothie_gym.world.town.model import Array
from dorothie_gym.world.town.opendrive.elements import SPEED_UNITS, Element, ElementReader
from dorothie_gym.world.town.opendrive.records import CrosswalkRecord, SignalRecord

# Where an object's corners may be: in its own frame, or on its road.
_CORNERS = (("cornerLocal", ("u", "v")), ("cornerRoad", ("s", "t")))


def read_signals(reader: ElementReader, road: Element) -> tuple[SignalRecord, ...]:
    """Signals and references to signals of other roads, in the file's order."""
    return tuple(_signal(reader, e) for e in road.iterfind("signals/*") if e.tag in ("signal", "signalReference"))


def read_crosswalks(reader: ElementReader, road: Element) -> tuple[CrosswalkRecord, ...]:
    """Objects that are crosswalks and have an outline, or a length and a width."""
    objects = (e for e in road.iterfind("objects/object") if e.get("type", "").lower() == "crosswalk")
    return tuple(crossing for e in objects if (crossing := _crosswalk(reader, e)) is not None)


def _signal(reader: ElementReader, element: Element) -> SignalRecord:
    return SignalRecord(
        id=reader.integer(element, "id"),
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
    """Value of a sign, a limit in m/s; -1 and an empty text say that it has none."""
    if element.get("value") in (None, "", "-1"):
        return None
    value = reader.number(element, "value") * SPEED_UNITS.get(element.get("unit") or "km/h", 1.0)
    return value if value >= 0.0 else None


def _crosswalk(reader: ElementReader, element: Element) -> CrosswalkRecord | None:
    """The first outline counts: it is the outer one."""
    for tag, names in _CORNERS:
        outline = next((o for o in element.iter("outline") if o.find(tag) is not None), None)
        if outline is not None:
            corners = np.array([[reader.number(c, name) for name in names] for c in outline.iterfind(tag)])
            break
    else:
        tag, corners = "cornerLocal", _rectangle(reader, element)
    if len(corners) < 3:
        return None
    return CrosswalkRecord(
        s=reader.number(element, "s"),
        t=reader.number(element, "t", 0.0),
        heading=reader.number(element, "hdg", 0.0),
        corners=_open_ring(corners),
        on_road=tag == "cornerRoad",
    )


def _rectangle(reader: ElementReader, element: Element) -> Array:
    """Corners (4, 2) of an object that has only a length and a width; none if it has not even these."""
    u, v = (0.5 * reader.number(element, name, 0.0) for name in ("length", "width"))
    return np.array([[-u, -v], [u, -v], [u, v], [-u, v]]) if u > 0.0 and v > 0.0 else np.empty((0, 2))


def _open_ring(corners: Array) -> Array:
    """Outline without the repeated first corner at its end."""
    return corners[:-1] if len(corners) > 3 and np.allclose(corners[0], corners[-1]) else corners
