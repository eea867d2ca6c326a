"""Reading an OpenDRIVE file into records; what cannot be read is one `TownError` with file, element and reason."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NoReturn, TypeAlias

import numpy as np
from lxml import etree

from dorothie_gym.world.town.model import Array, TownError
from dorothie_gym.world.town.opendrive.geometry import Arc, Cubics, Polynomial, Primitive, ReferenceLine, Spiral, poly3
from dorothie_gym.world.town.opendrive.records import (
    ConnectionRecord,
    CrosswalkRecord,
    LaneRecord,
    OpenDriveRecords,
    RoadLink,
    RoadRecord,
    SectionRecord,
    SignalRecord,
)

# The kind of XML node that lxml calls an element; its stubs name the class with an underscore.
Element: TypeAlias = etree._Element

# Metres per second in one unit; a limit without a unit is in m/s (OpenDRIVE 1.4, section 5.3.2.2).
SPEED_UNITS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704}

# A longer road is a slip of the pen, and would be sampled until memory ends [m].
LONGEST_ROAD = 100_000.0

# How far behind the end of its road a lane section may start: exporters round [m].
ROUNDING = 0.1


def parse_opendrive(path: str | Path) -> OpenDriveRecords:
    """Reads a file into records.

    Raises:
        TownError: the file is missing, is not OpenDRIVE, breaks off, or has an element that cannot be understood.
    """
    return _Parser(str(path)).parse()


def describe(element: Element) -> str:
    """Name of an element for a person who looks for it, e.g. `road 12 / laneSection 0 / lane -1`."""
    parts = []
    for node in (*reversed(list(element.iterancestors())), element):
        parent = node.getparent()
        if parent is None or node.tag in ("left", "right", "center", "lanes", "planView", "signals", "objects"):
            continue
        name = node.get("id")
        if name is None and len(siblings := parent.findall(node.tag)) > 1:
            name = str(siblings.index(node))
        parts.append(f"{node.tag} {name}" if name is not None else str(node.tag))
    where = " / ".join(parts) or str(element.tag)
    return f"{where} (line {element.sourceline})" if element.sourceline else where


class _Parser:
    """Holds the file's name while its elements are read."""

    def __init__(self, source: str) -> None:
        self.source = source

    def parse(self) -> OpenDriveRecords:
        root = self._root()
        roads: dict[int, RoadRecord] = {}
        for element in root.iterfind("road"):
            road = self._road(element)
            if road.id in roads:
                self._fail(element, "another road has the same id; give each road its own")
            roads[road.id] = road
        if not roads:
            self._fail(root, "has no roads; export the map again")
        junctions = {}
        for element in root.iterfind("junction"):
            connections = (self._connection(c, roads) for c in element.iterfind("connection"))
            junctions[self._integer(element, "id")] = tuple(c for c in connections if c is not None)
        self._check_road_links(root, roads, junctions)
        return OpenDriveRecords(source=self.source, roads=roads, junctions=junctions)

    def _root(self) -> Element:
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            text = Path(self.source).read_bytes()
        except (OSError, ValueError) as error:  # ValueError: a null character in the path
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise TownError(self.source, "file", f"cannot be opened: {reason}") from error
        try:
            root = etree.fromstring(text, parser)
        except etree.XMLSyntaxError as error:
            line = f"line {error.lineno}" if error.lineno else "file"
            raise TownError(self.source, line, f"is not complete XML: {error.msg}") from error
        except ValueError as error:
            raise TownError(self.source, "file", f"is not XML: {error}") from error
        if root.tag != "OpenDRIVE":
            self._fail(root, "is not an OpenDRIVE file; its outermost element must be OpenDRIVE")
        return root

    def _fail(self, element: Element, reason: str) -> NoReturn:
        raise TownError(self.source, describe(element), reason)

    def _text(self, element: Element, name: str) -> str:
        text = element.get(name)
        if text is None:
            self._fail(element, f"attribute {name} is missing")
        return text

    def _number(self, element: Element, name: str, default: float | None = None) -> float:
        if default is not None and element.get(name) is None:
            return default
        text = self._text(element, name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self._fail(element, f"attribute {name} must be a number, not {text!r}")
        return value

    def _integer(self, element: Element, name: str) -> int:
        text = self._text(element, name)
        try:
            return int(text)
        except ValueError:
            self._fail(element, f"attribute {name} must be a whole number, not {text!r}")

    def _rows(self, parent: Element, path: str, start: str) -> Cubics:
        rows = [[self._number(e, name) for name in (start, "a", "b", "c", "d")] for e in parent.iterfind(path)]
        table = np.array(rows, dtype=float).reshape(-1, 5)
        return Cubics(table[np.argsort(table[:, 0], kind="stable")])

    def _road(self, road: Element) -> RoadRecord:
        length = self._number(road, "length")
        if not 0.0 <= length <= LONGEST_ROAD:
            self._fail(road, f"attribute length must lie in 0 to {LONGEST_ROAD:g} m, but is {length:g}")
        return RoadRecord(
            id=self._integer(road, "id"),
            length=length,
            junction=self._integer(road, "junction"),
            right_hand=road.get("rule", "RHT").upper() != "LHT",
            line=self._line(road),
            elevation=self._rows(road, "elevationProfile/elevation", "s"),
            offset=self._rows(road, "lanes/laneOffset", "s"),
            sections=self._sections(road, length),
            predecessor=self._road_link(road, "predecessor"),
            successor=self._road_link(road, "successor"),
            speeds=tuple(
                (self._number(kind, "s"), speed)
                for kind in road.iterfind("type")
                for element in kind.iterfind("speed")
                if (speed := self._speed(element)) is not None
            ),
            signals=tuple(
                self._signal(e) for e in road.iterfind("signals/*") if e.tag in ("signal", "signalReference")
            ),
            crosswalks=tuple(
                crossing
                for e in road.iterfind("objects/object")
                if e.get("type", "").lower() == "crosswalk" and (crossing := self._crosswalk(e)) is not None
            ),
        )

    def _line(self, road: Element) -> ReferenceLine:
        starts, primitives = [], []
        for element in road.iterfind("planView/geometry"):
            row = [self._number(element, name) for name in ("s", "x", "y", "hdg", "length")]
            if row[4] < 0.0:
                self._fail(element, f"attribute length must not be negative, but is {row[4]:g}")
            shape = next(iter(element.iterchildren("*")), None)
            if shape is None:
                self._fail(element, "has no shape; it needs line, arc, spiral, poly3 or paramPoly3")
            if row[4] > 0.0:
                starts.append(row)
                primitives.append(self._primitive(shape, row[4]))
        if not primitives:
            self._fail(road, "has no geometry, so that nobody knows where it runs")
        table = np.array(starts)
        order = np.argsort(table[:, 0], kind="stable")
        return ReferenceLine(table[order], [primitives[k] for k in order])

    def _primitive(self, shape: Element, length: float) -> Primitive:
        if shape.tag == "line":
            return Arc()
        if shape.tag == "arc":
            return Arc(self._number(shape, "curvature"))
        if shape.tag == "spiral":
            return Spiral(self._number(shape, "curvStart"), self._number(shape, "curvEnd"))
        if shape.tag == "poly3":
            a, b, c, d = (self._number(shape, name) for name in "abcd")
            return poly3(a, b, c, d, length)
        if shape.tag == "paramPoly3":
            u = tuple(self._number(shape, f"{name}U") for name in "abcd")
            v = tuple(self._number(shape, f"{name}V") for name in "abcd")
            span = None if shape.get("pRange") == "arcLength" else 1.0
            return Polynomial((u[0], u[1], u[2], u[3]), (v[0], v[1], v[2], v[3]), span=span)
        self._fail(shape, f"unknown geometry {shape.tag}; known are line, arc, spiral, poly3 and paramPoly3")

    def _sections(self, road: Element, length: float) -> tuple[SectionRecord, ...]:
        elements = road.findall("lanes/laneSection")
        if not elements:
            self._fail(road, "has no lane section")
        starts = [self._number(e, "s") for e in elements]
        if any(later < earlier for earlier, later in zip(starts, starts[1:], strict=False)):
            self._fail(road, "its lane sections are not in the order of s")
        if starts[0] < -ROUNDING or starts[-1] > length + ROUNDING:
            self._fail(road, f"its lane sections must start between 0 and its length of {length:g} m")
        ends = [*starts[1:], max(length, starts[-1])]
        return tuple(
            SectionRecord(start=start, end=end, lanes={lane.id: lane for lane in map(self._lane, e.iterfind("*/lane"))})
            for e, start, end in zip(elements, starts, ends, strict=True)
        )

    def _lane(self, lane: Element) -> LaneRecord:
        number, kind = self._integer(lane, "id"), lane.get("type", "none")
        width = self._rows(lane, "width", "sOffset")
        if kind == "driving" and len(width.rows) == 0:
            self._fail(lane, "is a driving lane without a width element")
        return LaneRecord(
            id=number,
            type=kind,
            width=width,
            predecessor=self._lane_link(lane, "predecessor"),
            successor=self._lane_link(lane, "successor"),
            speeds=tuple(
                (self._number(e, "sOffset"), speed)
                for e in lane.iterfind("speed")
                if (speed := self._speed(e)) is not None
            ),
            changes=tuple(str(e.get("laneChange")) for e in lane.iterfind("roadMark") if e.get("laneChange")),
        )

    def _lane_link(self, lane: Element, side: str) -> int | None:
        link = lane.find(f"link/{side}")
        return None if link is None else self._integer(link, "id")

    def _speed(self, element: Element) -> float | None:
        """Limit [m/s]; None where the file says that there is none or that it is not known."""
        if element.get("max", "") in ("no limit", "undefined"):
            return None
        unit = element.get("unit") or "m/s"
        if unit not in SPEED_UNITS:
            self._fail(element, f"attribute unit must be one of {', '.join(SPEED_UNITS)}, not {unit!r}")
        limit = self._number(element, "max") * SPEED_UNITS[unit]
        return limit if limit > 0.0 else None

    def _road_link(self, road: Element, side: str) -> RoadLink | None:
        link = road.find(f"link/{side}")
        if link is None:
            return None
        is_road = link.get("elementType", "road") == "road"
        contact = self._contact(link) if is_road else ""
        return RoadLink(is_road=is_road, id=self._integer(link, "elementId"), contact=contact)

    def _contact(self, element: Element) -> str:
        contact = self._text(element, "contactPoint")
        if contact not in ("start", "end"):
            self._fail(element, f"attribute contactPoint must be start or end, not {contact!r}")
        return contact

    def _connection(self, element: Element, roads: dict[int, RoadRecord]) -> ConnectionRecord | None:
        if element.get("connectingRoad") is None:  # a virtual or direct junction of OpenDRIVE 1.6: links say it all
            return None
        incoming, connecting = self._integer(element, "incomingRoad"), self._integer(element, "connectingRoad")
        for name, road in (("incomingRoad", incoming), ("connectingRoad", connecting)):
            if road not in roads:
                self._fail(element, f"attribute {name} refers to road {road}, which is not in the file")
        lanes = tuple((self._integer(e, "from"), self._integer(e, "to")) for e in element.iterfind("laneLink"))
        return ConnectionRecord(incoming=incoming, connecting=connecting, contact=self._contact(element), lanes=lanes)

    def _check_road_links(
        self,
        root: Element,
        roads: dict[int, RoadRecord],
        junctions: dict[int, tuple[ConnectionRecord, ...]],
    ) -> None:
        for element, road in zip(root.iterfind("road"), roads.values(), strict=True):
            for side, link in (("predecessor", road.predecessor), ("successor", road.successor)):
                if link is not None and link.id not in (roads if link.is_road else junctions):
                    kind = "road" if link.is_road else "junction"
                    found = element.find(f"link/{side}")
                    self._fail(element if found is None else found, f"refers to {kind} {link.id}, not in the file")

    def _signal(self, element: Element) -> SignalRecord:
        value = element.get("value")
        return SignalRecord(
            id=self._integer(element, "id"),
            type=element.get("type", ""),
            dynamic=element.get("dynamic") == "yes",
            value=None if value is None else self._signal_value(element, value),
            s=self._number(element, "s"),
            t=self._number(element, "t", 0.0),
            z=self._number(element, "zOffset", 0.0),
            heading=self._number(element, "hOffset", 0.0),
            orientation=element.get("orientation", "none"),
            lanes=tuple(
                (self._integer(e, "fromLane"), self._integer(e, "toLane")) for e in element.iterfind("validity")
            ),
            reference=element.tag == "signalReference",
        )

    def _signal_value(self, element: Element, text: str) -> float | None:
        """Value of a sign, a limit in m/s; -1 and an empty text say that it has none."""
        if text in ("", "-1"):
            return None
        unit = SPEED_UNITS.get(element.get("unit") or "km/h", 1.0)
        value = self._number(element, "value")
        return value * unit if value >= 0.0 else None

    def _crosswalk(self, element: Element) -> CrosswalkRecord | None:
        local, road = element.findall(".//cornerLocal"), element.findall(".//cornerRoad")
        names, corners = (("u", "v"), local) if local else (("s", "t"), road)
        if len(corners) < 3:
            return None
        return CrosswalkRecord(
            s=self._number(element, "s"),
            t=self._number(element, "t"),
            heading=self._number(element, "hdg", 0.0),
            corners=_open_ring(np.array([[self._number(e, name) for name in names] for e in corners])),
            on_road=not local,
        )


def _open_ring(corners: Array) -> Array:
    """Outline without the repeated first corner at its end."""
    return corners[:-1] if len(corners) > 3 and np.allclose(corners[0], corners[-1]) else corners
