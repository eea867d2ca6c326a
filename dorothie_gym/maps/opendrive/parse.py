"""Parser of OpenDRIVE files into records; what it cannot understand is dropped with a note."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from dorothie_gym.errors import TownError
from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.model import NO_JUNCTION
from dorothie_gym.maps.opendrive.elements import Element, ElementReader, describe
from dorothie_gym.maps.opendrive.geometry import Arc, Polynomial, Primitive, ReferenceLine, Spiral, poly3
from dorothie_gym.maps.opendrive.lane_sections import read_sections
from dorothie_gym.maps.opendrive.objects import read_crosswalks, read_signals
from dorothie_gym.maps.opendrive.own_data import VENDOR
from dorothie_gym.maps.opendrive.programmes import read_programmes
from dorothie_gym.maps.opendrive.records import ConnectionRecord, OpenDriveRecords, RoadLink, RoadRecord
from dorothie_gym.maps.opendrive.street_names import street_name
from dorothie_gym.maps.opendrive.traffic_rule import refuse_mixed_rules
from dorothie_gym.support import portable_arrays as pn

if TYPE_CHECKING:
    from dorothie_gym.maps.import_notes import ImportNotes
    from dorothie_gym.maps.model import Array

# Largest length of a road [m]; a longer one is an error that would exhaust memory.
LONGEST_ROAD = 100_000.0

# Largest total length of lanes [m], for the same reason. Roads of a CARLA map of 10 km x 10 km have 800 km of lanes.
LONGEST_LANES = 4_000_000.0

# Shapes of the elements of a reference line.
_SHAPES = ("line", "arc", "spiral", "poly3", "paramPoly3")

# Traffic rules of roads (OpenDRIVE 1.5 and later).
_RULES = ("LHT", "RHT")


def parse_opendrive(path: str | Path) -> OpenDriveRecords:
    """Reads a file into records, with notes on all that was dropped, repaired or assumed.

    Raises:
        TownError: the file is missing, is not OpenDRIVE, breaks off, is too large, or no road can be understood.
    """
    return _Parser(str(path)).parse()


class _Parser(ElementReader):
    """Parser of roads, reference lines, and links of roads."""

    def parse(self) -> OpenDriveRecords:
        root = self.root()
        self.number_ids(root)
        self._rule = _common_rule(root)
        header = root.find("header")
        self._own = header is not None and header.get("vendor") == VENDOR
        roads: dict[int, RoadRecord] = {}
        elements: dict[int, Element] = {}
        for element in root.iterfind("road"):
            road = self.attempt(NoteKind.ROAD, functools.partial(self._road, element))
            if road is None:
                continue
            if road.id in roads:
                self.notes.dropped(NoteKind.ROAD, describe(element), "another road has the same id")
            else:
                roads[road.id], elements[road.id] = road, element
        if not roads:
            refuse_empty(self.source, self.notes, "has no roads; export the map again")
        refuse_mixed_rules(self.source, roads)
        sections = (section for road in roads.values() for section in road.sections)
        lanes = sum((section.end - section.start) * len(section.lanes) for section in sections)
        if lanes > LONGEST_LANES:
            self.fail(root, f"has {lanes / 1000:,.0f} km of lanes; at most {LONGEST_LANES / 1000:,.0f} km are read")
        named = dict.fromkeys(number for e in root.iterfind("junction") if (number := self._junction(e)) is not None)
        for number, road in roads.items():
            roads[number] = self._linked(road, elements[number], roads, named)
        junctions: dict[int, tuple[ConnectionRecord, ...]] = {}
        for element in root.iterfind("junction"):
            number = self._junction(element)
            if number is not None:
                found = self.attempts(
                    NoteKind.CONNECTION, element.iterfind("connection"), lambda e: self._connection(e, roads)
                )
                junctions[number] = (*junctions.get(number, ()), *found)
            else:
                self.notes.dropped(NoteKind.JUNCTION, describe(element), "has no id")
        return OpenDriveRecords(
            source=self.source,
            notes=self.notes,
            roads=roads,
            junctions=junctions,
            programmes=read_programmes(self, root),
            own=self._own,
        )

    def _junction(self, element: Element) -> int | None:
        """Returns the number of a junction, or None if it has no id."""
        return self.junctions.get(element.get("id", ""))

    def _road(self, road: Element) -> RoadRecord:
        length = self.number(road, "length")
        if not 0.0 <= length <= LONGEST_ROAD:
            self.fail(road, f"attribute length must lie in 0 to {LONGEST_ROAD:g} m, but is {length:g}")
        right_hand = self._right_hand(road)
        return RoadRecord(
            id=self.reference(road, "id", "road", self.roads),
            name=self.text(road, "id"),
            street=street_name(road.get("name", ""), own=self._own),
            length=length,
            junction=self._crossed(road),
            right_hand=right_hand,
            line=self._line(road),
            elevation=self.cubics(road, "elevationProfile/elevation", "s"),
            superelevation=self.cubics(road, "lateralProfile/superelevation", "s"),
            offset=self.cubics(road, "lanes/laneOffset", "s"),
            sections=read_sections(self, road, length, right_hand),
            predecessor=None,  # links are read when all roads are known
            successor=None,
            speeds=tuple(
                (self.number(kind, "s", 0.0), speed)
                for kind in road.iterfind("type")
                for _, speed in self.speeds(kind.iterfind("speed"))
            ),
            signals=read_signals(self, road),
            crosswalks=read_crosswalks(self, road),
        )

    def _right_hand(self, road: Element) -> bool:
        """Returns whether traffic keeps to the right on a road; one without a rule follows the others."""
        rule = road.get("rule", "").upper()
        if rule not in _RULES and self._rule == "LHT":
            self.notes.assumed(NoteKind.TRAFFIC, describe(road), "has no rule LHT or RHT; that of other roads is LHT")
        return (rule if rule in _RULES else self._rule) != "LHT"

    def _crossed(self, road: Element) -> int:
        """Returns the junction that a road crosses, or -1; it need not be in the file."""
        number = self.junctions.get(road.get("junction") or "-1")
        return NO_JUNCTION if number is None else number

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
            a, b, c, d = (self.coefficient(shape, name) for name in "abcd")
            return poly3(a, b, c, d, length)
        if shape.tag == "paramPoly3":
            u = tuple(self.coefficient(shape, f"{name}U") for name in "abcd")
            v = tuple(self.coefficient(shape, f"{name}V") for name in "abcd")
            span = None if shape.get("pRange") == "arcLength" else 1.0
            return Polynomial((u[0], u[1], u[2], u[3]), (v[0], v[1], v[2], v[3]), span=span)
        self.fail(shape, f"unknown geometry {shape.tag}; known are {', '.join(_SHAPES)}")

    # --- Links of roads ----------------------------------------------------------------------------------------------

    def _linked(
        self, road: RoadRecord, element: Element, roads: dict[int, RoadRecord], junctions: dict[int, None]
    ) -> RoadRecord:
        """Returns a road with its links; those to roads and junctions that the file lacks are dropped."""
        links = [
            self.attempt(
                NoteKind.ROAD_LINK, functools.partial(self._road_link, element, side, (road, place), roads, junctions)
            )
            for place, side in enumerate(("predecessor", "successor"))
        ]
        return replace(road, predecessor=links[0], successor=links[1])

    def _road_link(
        self,
        element: Element,
        side: str,
        end: tuple[RoadRecord, int],
        roads: dict[int, RoadRecord],
        junctions: dict[int, None],
    ) -> RoadLink | None:
        """Returns the road or junction at an end of a road; None for -1, or for a position midway along another road.

        This occurs at virtual junctions (OpenDRIVE 1.6): a side road leaves a main road without lanes that end
        there: such a road has no continuation at that end.
        """
        link = element.find(f"link/{side}")
        if link is None or link.get("elementId") == "-1" or link.get("elementS") is not None:
            return None
        is_road = link.get("elementType", "road") == "road"
        kind, numbers = ("road", self.roads) if is_road else ("junction", self.junctions)
        number = self.reference(link, "elementId", kind, numbers)
        if number not in (roads if is_road else junctions):
            self.fail(link, f"refers to {kind} {link.get('elementId')}, which was dropped or is not in the file")
        contact = self._contact(link, _place(*end), roads[number]) if is_road else ""
        return RoadLink(is_road=is_road, id=number, contact=contact)

    def _contact(self, element: Element, place: Array, road: RoadRecord) -> str:
        """Returns the end of a road that touches a place (2,); without a contact point, the nearer one."""
        contact = element.get("contactPoint", "")
        if contact in ("start", "end"):
            return contact
        gaps = [float(pn.hypot(*(_place(road, end) - place))) for end in (0, 1)]
        nearer = "start" if gaps[0] <= gaps[1] else "end"
        reason = f"has no contactPoint start or end; the nearer one is the {nearer} of road {road.name}"
        self.notes.assumed(NoteKind.ROAD_LINK, describe(element), reason)
        return nearer

    def _connection(self, element: Element, roads: dict[int, RoadRecord]) -> ConnectionRecord | None:
        """Returns a connection by a connecting road or, in a direct junction (OpenDRIVE 1.7), to the linked road."""
        direct = element.get("connectingRoad") is None
        other = "linkedRoad" if direct else "connectingRoad"
        if element.get(other) is None:
            return None  # in a virtual junction a connection may lead nowhere
        incoming, connecting = (self.reference(element, name, "road", self.roads) for name in ("incomingRoad", other))
        for name, road in (("incomingRoad", incoming), (other, connecting)):
            if road not in roads:
                self.fail(element, f"attribute {name} refers to road {element.get(name)}, which was dropped")
        links = self.attempts(
            NoteKind.LANE_LINK,
            element.iterfind("laneLink"),
            lambda e: (self.integer(e, "from"), self.integer(e, "to")),
        )
        return ConnectionRecord(
            incoming=incoming,
            connecting=connecting,
            contact=self._connection_contact(element, roads[incoming], roads[connecting]),
            lanes=tuple(links),
            direct=direct,
        )

    def _connection_contact(self, element: Element, incoming: RoadRecord, connecting: RoadRecord) -> str:
        """Returns the end of the connecting road at the incoming road; without a contact point, that of its link."""
        if element.get("contactPoint") in ("start", "end"):
            return str(element.get("contactPoint"))
        for contact, link in (("start", connecting.predecessor), ("end", connecting.successor)):
            if link is not None and link.is_road and link.id == incoming.id:
                reason = f"has no contactPoint start or end; road {connecting.name} is linked at its {contact}"
                self.notes.assumed(NoteKind.CONNECTION, describe(element), reason)
                return contact
        self.fail(element, "attribute contactPoint must be start or end, and no end of its road is linked")


def _common_rule(root: Element) -> str:
    """Returns the rule of the roads that have one, LHT or RHT; by default, and where they differ, RHT."""
    rules = {road.get("rule", "").upper() for road in root.iterfind("road")}
    return "LHT" if "LHT" in rules and "RHT" not in rules else "RHT"


def _place(road: RoadRecord, end: int) -> Array:
    """Returns the position (2,) of the start (0) or end (1) of a road in the frame of the file [m]."""
    x, y, _ = road.line.place(np.array([end * road.length]))
    return np.array([float(x[0]), float(y[0])])


def refuse_empty(source: str, notes: ImportNotes, reason: str) -> NoReturn:
    """Raises the error for a map without a driving lane; it names the first loss, or the reason without one."""
    loss = notes.first_loss()
    if loss is None:
        raise TownError(source, "OpenDRIVE", reason)
    raise TownError(source, loss.element, f"{loss.message}; no driving lane is left")
