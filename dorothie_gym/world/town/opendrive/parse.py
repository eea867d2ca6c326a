"""Reading an OpenDRIVE file into records; what cannot be read is one `TownError` with file, element and reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dorothie_gym.world.town.opendrive.elements import Element, ElementReader
from dorothie_gym.world.town.opendrive.geometry import Arc, Cubics, Polynomial, Primitive, ReferenceLine, Spiral, poly3
from dorothie_gym.world.town.opendrive.parse_furniture import read_crosswalks, read_signals
from dorothie_gym.world.town.opendrive.records import (
    ConnectionRecord,
    LaneRecord,
    OpenDriveRecords,
    RoadLink,
    RoadRecord,
    SectionRecord,
)

# A longer road is a slip of the pen, and would be sampled until memory ends [m].
LONGEST_ROAD = 100_000.0

# How far behind the end of its road a lane section may start: exporters round [m].
ROUNDING = 0.1

# Shapes that an element of a reference line may have.
_SHAPES = ("line", "arc", "spiral", "poly3", "paramPoly3")


def parse_opendrive(path: str | Path) -> OpenDriveRecords:
    """Reads a file into records.

    Raises:
        TownError: the file is missing, is not OpenDRIVE, breaks off, or has an element that cannot be understood.
    """
    return _Parser(str(path)).parse()


class _Parser(ElementReader):
    """Reads roads, where they run, and how they and their lanes are joined."""

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
            self.fail(road, "has no geometry, so that nobody knows where it runs")
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
        if any(later < earlier for earlier, later in zip(starts, starts[1:], strict=False)):
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
        record = LaneRecord(
            id=self.integer(lane, "id"),
            type=lane.get("type", "none"),
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
        """What a road meets; nothing where the file says -1, or a place midway along another road.

        The latter is how a virtual junction (OpenDRIVE 1.6) lets a side road out of a main road, which has no lane that
        ends there: such a road stays without a way on at that end.
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
        """A connection by a connecting road, or in a direct junction (OpenDRIVE 1.7) straight to the linked road."""
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
