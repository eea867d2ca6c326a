"""Parser of OpenDRIVE files into records; all faults are reported as `TownError` with file, element and reason."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, TypeAlias

import numpy as np
from lxml import etree

from dorothie_gym.errors import InputFileError, TownError, short_repr
from dorothie_gym.maps.opendrive.geometry import (
    NO_CUBICS,
    Arc,
    Cubics,
    Polynomial,
    Primitive,
    ReferenceLine,
    Spiral,
    poly3,
)
from dorothie_gym.maps.opendrive.records import (
    ConnectionRecord,
    CrosswalkRecord,
    LaneRecord,
    OpenDriveRecords,
    RoadLink,
    RoadRecord,
    SectionRecord,
    SignalRecord,
)
from dorothie_gym.support.input_files import MAX_OPENDRIVE, MAX_XML_ELEMENTS, read_file

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array

# Type of XML elements; the stubs of lxml name the class with an underscore.
Element: TypeAlias = etree._Element

# Metres per second of each unit; limits without a unit are in m/s (OpenDRIVE 1.4, section 5.3.2.2).
SPEED_UNITS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704}

# Largest magnitude of a number. Ids, angles and metres of real maps stay far below it.
MAX_NUMBER = 2.0**40

# Grouping elements, which names of elements omit.
_GROUPS = ("left", "right", "center", "lanes", "planView", "signals", "objects")


def describe(element: Element) -> str:
    """Returns the name of an element for messages, e.g. `road 12 / laneSection 0 / lane -1`."""
    parts = []
    for node in (*reversed(list(element.iterancestors())), element):
        parent = node.getparent()
        if parent is None or node.tag in _GROUPS:
            continue
        name = node.get("id")
        if name is None and len(siblings := parent.findall(node.tag)) > 1:
            name = str(siblings.index(node))
        parts.append(f"{node.tag} {name}" if name is not None else str(node.tag))
    where = " / ".join(parts) or str(element.tag)
    return f"{where} (line {element.sourceline})" if element.sourceline else where


class ElementReader:
    """Reader of the attributes of elements; raises `TownError` with file and element.

    Attributes:
        source: the file, as named by the user.
    """

    def __init__(self, source: str) -> None:
        self.source = source

    def root(self) -> Element:
        """Returns the root element; namespaces are removed from all names."""
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            text = read_file(Path(self.source), MAX_OPENDRIVE)
        except OSError as error:
            raise TownError(self.source, "file", f"cannot be opened: {error.strerror or error}") from error
        except InputFileError as error:
            raise TownError(self.source, "file", f"cannot be opened: {error.reason}") from None
        if text.count(b"<") > MAX_XML_ELEMENTS or text.count(b"=") > 8 * MAX_XML_ELEMENTS:
            raise TownError(self.source, "file", f"has more than {MAX_XML_ELEMENTS} elements; it is not read")
        try:
            root = etree.fromstring(text, parser)
        except etree.XMLSyntaxError as error:
            line = f"line {error.lineno}" if error.lineno else "file"
            raise TownError(self.source, line, f"is not complete XML: {error.msg}") from error
        except ValueError as error:
            raise TownError(self.source, "file", f"is not XML: {error}") from error
        if str(root.tag).startswith("{"):
            for element in root.iter("*"):
                element.tag = etree.QName(element).localname
        if root.tag != "OpenDRIVE":
            self.fail(root, "is not an OpenDRIVE file; its outermost element must be OpenDRIVE")
        return root

    def fail(self, element: Element, reason: str) -> NoReturn:
        """Raises the error for an element."""
        raise TownError(self.source, describe(element), reason)

    def text(self, element: Element, name: str) -> str:
        """Returns a required attribute."""
        text = element.get(name)
        if text is None:
            self.fail(element, f"attribute {name} is missing")
        return text

    def number(self, element: Element, name: str, default: float | None = None) -> float:
        """Returns a finite number; a missing attribute gives the default, if there is one."""
        if default is not None and element.get(name) is None:
            return default
        text = self.text(element, name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= MAX_NUMBER:
            self.fail(element, f"attribute {name} must be a number up to {MAX_NUMBER:g}, not {short_repr(text)}")
        return value

    def integer(self, element: Element, name: str) -> int:
        """Returns a required integer."""
        text = self.text(element, name)
        try:
            value = int(text)
        except ValueError:
            value = None
        if value is None or not abs(value) <= MAX_NUMBER:
            self.fail(element, f"attribute {name} must be a whole number up to {MAX_NUMBER:g}, not {short_repr(text)}")
        return value

    def cubics(self, parent: Element, path: str, start: str) -> Cubics:
        """Returns a profile: rows of start and four coefficients, sorted by start."""
        rows = [[self.number(e, name) for name in (start, "a", "b", "c", "d")] for e in parent.iterfind(path)]
        return Cubics(np.array(sorted(rows, key=lambda row: row[0]))) if rows else NO_CUBICS

    def speed(self, element: Element) -> float | None:
        """Returns a speed limit [m/s], or None if the file states that there is none or that it is unknown."""
        if element.get("max", "") in ("no limit", "undefined"):
            return None
        unit = element.get("unit") or "m/s"
        if unit not in SPEED_UNITS:
            self.fail(element, f"attribute unit must be one of {', '.join(SPEED_UNITS)}, not {short_repr(unit)}")
        limit = self.number(element, "max") * SPEED_UNITS[unit]
        return limit if limit > 0.0 else None


# --- Signals and crosswalks ------------------------------------------------------------------------------------------
# Corner elements of an object: in its own frame, or on its road.
_CORNERS = (("cornerLocal", ("u", "v")), ("cornerRoad", ("s", "t")))


def read_signals(reader: ElementReader, road: Element) -> tuple[SignalRecord, ...]:
    """Returns signals and references to signals of other roads, in the order of the file."""
    return tuple(_signal(reader, e) for e in road.iterfind("signals/*") if e.tag in ("signal", "signalReference"))


def read_crosswalks(reader: ElementReader, road: Element) -> tuple[CrosswalkRecord, ...]:
    """Returns the crosswalk objects with an outline, or with length and width."""
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
    """Returns the value of a sign, limits in m/s; None for -1 and an empty text."""
    if element.get("value") in (None, "", "-1"):
        return None
    value = reader.number(element, "value") * SPEED_UNITS.get(element.get("unit") or "km/h", 1.0)
    return value if value >= 0.0 else None


def _crosswalk(reader: ElementReader, element: Element) -> CrosswalkRecord | None:
    """Reads a crosswalk from its first outline, which is the outer one."""
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
    """Returns the corners (4, 2) of an object with length and width only, or none without these."""
    u, v = (0.5 * reader.number(element, name, 0.0) for name in ("length", "width"))
    return np.array([[-u, -v], [u, -v], [u, v], [-u, v]]) if u > 0.0 and v > 0.0 else np.empty((0, 2))


def _open_ring(corners: Array) -> Array:
    """Returns the outline without a repeated first corner at its end."""
    return corners[:-1] if len(corners) > 3 and np.allclose(corners[0], corners[-1]) else corners


# --- Roads and junctions ---------------------------------------------------------------------------------------------
# Largest length of a road [m]; a longer one is an error that would exhaust memory.
LONGEST_ROAD = 100_000.0

# Largest total length of lanes [m], for the same reason. Roads of a CARLA map of 10 km x 10 km have 800 km of lanes.
LONGEST_LANES = 4_000_000.0

# Tolerance for the start of a lane section beyond the end of its road [m]: exporters round.
ROUNDING = 0.1

# Shapes of the elements of a reference line.
_SHAPES = ("line", "arc", "spiral", "poly3", "paramPoly3")


def parse_opendrive(path: str | Path) -> OpenDriveRecords:
    """Reads a file into records.

    Raises:
        TownError: the file is missing, is not OpenDRIVE, breaks off, or has an element that cannot be understood.
    """
    return _Parser(str(path)).parse()


class _Parser(ElementReader):
    """Parser of roads, reference lines, and links of roads and lanes."""

    def parse(self) -> OpenDriveRecords:
        root = self.root()
        roads: dict[int, RoadRecord] = {}
        for element in root.iterfind("road"):
            road = self._road(element)
            if road.id in roads:
                self.fail(element, "another road has the same id; give each road its own")
            roads[road.id] = road
        if not roads:
            self.fail(root, "has no roads; export the map again")
        sections = (section for road in roads.values() for section in road.sections)
        lanes = sum((section.end - section.start) * len(section.lanes) for section in sections)
        if lanes > LONGEST_LANES:
            self.fail(root, f"has {lanes / 1000:,.0f} km of lanes; at most {LONGEST_LANES / 1000:,.0f} km are read")
        junctions = {}
        for element in root.iterfind("junction"):
            connections = (self._connection(c, roads) for c in element.iterfind("connection"))
            junctions[self.integer(element, "id")] = tuple(c for c in connections if c is not None)
        self._check_road_links(root, roads, junctions)
        return OpenDriveRecords(source=self.source, roads=roads, junctions=junctions)

    def _road(self, road: Element) -> RoadRecord:
        length = self.number(road, "length")
        if not 0.0 <= length <= LONGEST_ROAD:
            self.fail(road, f"attribute length must lie in 0 to {LONGEST_ROAD:g} m, but is {length:g}")
        return RoadRecord(
            id=self.integer(road, "id"),
            length=length,
            junction=self.integer(road, "junction") if road.get("junction") else -1,
            right_hand=road.get("rule", "RHT").upper() != "LHT",
            line=self._line(road),
            elevation=self.cubics(road, "elevationProfile/elevation", "s"),
            superelevation=self.cubics(road, "lateralProfile/superelevation", "s"),
            offset=self.cubics(road, "lanes/laneOffset", "s"),
            sections=self._sections(road, length),
            predecessor=self._road_link(road, "predecessor"),
            successor=self._road_link(road, "successor"),
            speeds=tuple(
                (self.number(kind, "s"), speed)
                for kind in road.iterfind("type")
                for element in kind.iterfind("speed")
                if (speed := self.speed(element)) is not None
            ),
            signals=read_signals(self, road),
            crosswalks=read_crosswalks(self, road),
        )

    def _line(self, road: Element) -> ReferenceLine:
        starts, primitives = [], []
        for element in road.iterfind("planView/geometry"):
            row = [self.number(element, name) for name in ("s", "x", "y", "hdg", "length")]
            if row[4] < 0.0:
                self.fail(element, f"attribute length must not be negative, but is {row[4]:g}")
            shape = next((child for child in element.iterchildren("*") if child.tag != "userData"), None)
            if shape is None:
                self.fail(element, f"has no shape; it needs one of {', '.join(_SHAPES)}")
            starts.append(row)
            primitives.append(self._primitive(shape, row[4]) if row[4] > 0.0 else Arc())
        if not primitives:
            self.fail(road, "has no geometry")
        table = np.array(starts)
        order = np.argsort(table[:, 0], kind="stable")
        return ReferenceLine(table[order], [primitives[k] for k in order])

    def _primitive(self, shape: Element, length: float) -> Primitive:
        if shape.tag == "line":
            return Arc()
        if shape.tag == "arc":
            return Arc(self.number(shape, "curvature"))
        if shape.tag == "spiral":
            return Spiral(self.number(shape, "curvStart"), self.number(shape, "curvEnd"))
        if shape.tag == "poly3":
            a, b, c, d = (self.number(shape, name) for name in "abcd")
            return poly3(a, b, c, d, length)
        if shape.tag == "paramPoly3":
            u = tuple(self.number(shape, f"{name}U") for name in "abcd")
            v = tuple(self.number(shape, f"{name}V") for name in "abcd")
            span = None if shape.get("pRange") == "arcLength" else 1.0
            return Polynomial((u[0], u[1], u[2], u[3]), (v[0], v[1], v[2], v[3]), span=span)
        self.fail(shape, f"unknown geometry {shape.tag}; known are {', '.join(_SHAPES)}")

    def _sections(self, road: Element, length: float) -> tuple[SectionRecord, ...]:
        elements = road.findall("lanes/laneSection")
        if not elements:
            self.fail(road, "has no lane section")
        starts = [self.number(e, "s") for e in elements]
        if any(later < earlier for earlier, later in itertools.pairwise(starts)):
            self.fail(road, "its lane sections are not in the order of s")
        if starts[0] < -ROUNDING or starts[-1] > length + ROUNDING:
            self.fail(road, f"its lane sections must start between 0 and its length of {length:g} m")
        ends = [*starts[1:], max(length, starts[-1])]
        return tuple(
            SectionRecord(start=start, end=end, lanes={lane.id: lane for lane in map(self._lane, e.iterfind("*/lane"))})
            for e, start, end in zip(elements, starts, ends, strict=True)
        )

    def _lane(self, lane: Element) -> LaneRecord:
        width = self.cubics(lane, "width", "sOffset")
        number = self.integer(lane, "id")
        record = LaneRecord(
            id=number,
            type=lane.get("type", "none") if number != 0 else "none",  # lane 0 is the centre line, without a width
            width=width,
            border=self._border(lane) if len(width.rows) == 0 else None,
            predecessor=self._lane_link(lane, "predecessor"),
            successor=self._lane_link(lane, "successor"),
            speeds=tuple(
                (self.number(e, "sOffset"), speed)
                for e in lane.iterfind("speed")
                if (speed := self.speed(e)) is not None
            ),
            changes=tuple(str(e.get("laneChange")) for e in lane.iterfind("roadMark") if e.get("laneChange")),
        )
        if record.drives and len(width.rows) == 0 and record.border is None:
            self.fail(lane, "is a driving lane without a width or border element")
        return record

    def _border(self, lane: Element) -> Cubics | None:
        border = self.cubics(lane, "border", "sOffset")
        return border if len(border.rows) else None

    def _lane_link(self, lane: Element, side: str) -> int | None:
        link = lane.find(f"link/{side}")
        return None if link is None else self.integer(link, "id")

    def _road_link(self, road: Element, side: str) -> RoadLink | None:
        """Returns the road or junction at an end of a road; None for -1, or for a position midway along another road.

        This occurs at virtual junctions (OpenDRIVE 1.6): a side road leaves a main road without lanes that end
        there: such a road has no continuation at that end.
        """
        link = road.find(f"link/{side}")
        if link is None or link.get("elementId") == "-1" or link.get("elementS") is not None:
            return None
        is_road = link.get("elementType", "road") == "road"
        contact = self._contact(link) if is_road else ""
        return RoadLink(is_road=is_road, id=self.integer(link, "elementId"), contact=contact)

    def _contact(self, element: Element) -> str:
        contact = self.text(element, "contactPoint")
        if contact not in ("start", "end"):
            self.fail(element, f"attribute contactPoint must be start or end, not {contact!r}")
        return contact

    def _connection(self, element: Element, roads: dict[int, RoadRecord]) -> ConnectionRecord | None:
        """Returns a connection by a connecting road or, in a direct junction (OpenDRIVE 1.7), to the linked road."""
        direct = element.get("connectingRoad") is None
        other = "linkedRoad" if direct else "connectingRoad"
        if element.get(other) is None:
            return None  # in a virtual junction a connection may lead nowhere
        incoming, connecting = self.integer(element, "incomingRoad"), self.integer(element, other)
        for name, road in (("incomingRoad", incoming), (other, connecting)):
            if road not in roads:
                self.fail(element, f"attribute {name} refers to road {road}, which is not in the file")
        return ConnectionRecord(
            incoming=incoming,
            connecting=connecting,
            contact=self._contact(element),
            lanes=tuple((self.integer(e, "from"), self.integer(e, "to")) for e in element.iterfind("laneLink")),
            direct=direct,
        )

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
                    self.fail(element if found is None else found, f"refers to {kind} {link.id}, not in the file")
