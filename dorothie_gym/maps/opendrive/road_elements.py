"""Elements of a road in OpenDRIVE 1.8: plan view, heights, lanes, crosswalks and signals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree

from dorothie_gym.maps.model import NO_STREET, SignalKind
from dorothie_gym.maps.opendrive.cross_sections import height_rows
from dorothie_gym.maps.opendrive.furniture import SIGNAL_TYPES
from dorothie_gym.maps.opendrive.geometry import Arc, Cubics, Polynomial
from dorothie_gym.maps.opendrive.own_data import LANE_BEGINS, TURN
from dorothie_gym.maps.opendrive.road_links import LaneAt, RoadTip, begun_inside
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.maps.link_types import LinkType
    from dorothie_gym.maps.opendrive.cross_sections import CrossSection, SectionLane
    from dorothie_gym.maps.opendrive.elements import Element
    from dorothie_gym.maps.opendrive.geometry import Primitive
    from dorothie_gym.maps.opendrive.road_layout import RoadLayout
    from dorothie_gym.maps.opendrive.road_links import RoadLinks
    from dorothie_gym.maps.opendrive.roadside import CrosswalkPlace, SignalPlace
    from dorothie_gym.maps.town import Town

_TYPE_OF: dict[SignalKind, str] = {
    kind: number for number, kind in reversed(SIGNAL_TYPES.items()) if kind is not SignalKind.OTHER
}

# Numbers of signals on which other readers rely: CARLA's lights are three-coloured, its signs have a subtype.
_ANY = "-1"

_MARK_WIDTH = 0.12  # of road marks [m]

# Size of lights and signs [m].
_SIGNAL_HEIGHT, _SIGNAL_WIDTH = 1.0, 0.5


def number(value: float) -> str:
    """Returns a number with as many digits as it needs."""
    return repr(float(value) + 0.0)


def rounded(value: float) -> str:
    """Returns a number with twelve digits: millionths of a millimetre in a town."""
    return f"{float(value) + 0.0:.12g}"


class RoadElements:
    """Writer of the roads of a town.

    Args:
        town: the town.
        links: links of its roads.
        keeps_left: whether traffic keeps to the left.
    """

    def __init__(self, town: Town, links: RoadLinks, *, keeps_left: bool) -> None:
        self._town = town
        self._links = links
        self._keeps_left = keeps_left
        self._turns: dict[int, set[LinkType]] = {}
        for link in town.links:
            if town.lanes[link.target].in_junction and not town.lanes[link.source].in_junction:
                self._turns.setdefault(link.target, set()).add(link.type)
        self._changes = {(link.source, link.target) for link in town.links if link.type.is_lane_change}

    def write(
        self,
        parent: Element,
        road: RoadLayout,
        sections: Sequence[CrossSection],
        crosswalks: Iterable[CrosswalkPlace],
        signals: Iterable[SignalPlace],
    ) -> None:
        """Adds a road to the root of a file."""
        name = "" if road.street == NO_STREET else self._town.streets[road.street].name
        element = _add(
            parent,
            "road",
            name=name,
            length=number(road.axis.length),
            id=str(road.number),
            junction=str(road.junction),
            rule="LHT" if self._keeps_left else "RHT",
        )
        self._write_links(element, road)
        limits = [self._town.lanes[s.lane].speed_limit for s in road.strands if s.lane is not None]
        kind = _add(element, "type", s="0", type="town" if limits else "pedestrian")
        if limits:
            _add(kind, "speed", max=number(max(limits)), unit="m/s")
        _write_plan_view(element, road)
        profile = _add(element, "elevationProfile")
        for s, *cubic in height_rows(road):
            _add(profile, "elevation", s=number(s), **_cubic(*cubic))
        _add(element, "lateralProfile")
        lanes = _add(element, "lanes")
        for section in sections:
            for s, a, b in section.offset:
                _add(lanes, "laneOffset", s=number(s), **_cubic(a, b))
        for k, section in enumerate(sections):
            self._write_section(lanes, road, k, section)
        _write_crosswalks(element, crosswalks)
        _write_signals(element, road, signals)

    def _write_links(self, element: Element, road: RoadLayout) -> None:
        link = _add(element, "link")
        for tag, tip in (("predecessor", RoadTip(road.number, False)), ("successor", RoadTip(road.number, True))):
            other = self._links.roads.get(tip)
            if other is not None:
                _add(link, tag, elementType="road", elementId=str(other.road), contactPoint=other.contact)
            elif tip in self._links.junctions:
                _add(link, tag, elementType="junction", elementId=str(self._links.junctions[tip]))

    # --- Lanes -------------------------------------------------------------------------------------------------------

    def _write_section(self, parent: Element, road: RoadLayout, index: int, section: CrossSection) -> None:
        element = _add(parent, "laneSection", s=number(section.start))
        begun = set(begun_inside(road, section))
        marks = self._marks(section)
        for tag, sign in (("left", 1), ("center", 0), ("right", -1)):
            members = [lane for lane in section.lanes if lane.number * sign > 0]
            if sign == 0:
                centre = _add(_add(element, tag), "lane", id="0", type="none", level="false")
                _add_mark(centre, "solid", marks.get(0))
            elif members:
                side = _add(element, tag)
                for lane in members:
                    self._write_lane(side, road, index, lane, marks.get(lane.number), lane.number in begun)

    def _marks(self, section: CrossSection) -> dict[int, str]:
        """Returns the lane changes across the outer mark of each lane that has a lane for cars beside it."""
        lane_of = {lane.number: lane.strand.lane for lane in section.lanes if lane.strand is not None}
        marks = {}
        for inner, lane in lane_of.items():
            side = 1 if inner > 0 else -1
            outer = lane_of.get(inner + side)
            if lane is None or outer is None:
                continue
            outward, inward = (lane, outer) in self._changes, (outer, lane) in self._changes
            up, down = (outward, inward) if side > 0 else (inward, outward)
            marks[inner] = "both" if up and down else "increase" if up else "decrease" if down else "none"
        return marks

    def _write_lane(
        self, parent: Element, road: RoadLayout, index: int, lane: SectionLane, change: str | None, begins: bool
    ) -> None:
        strand = lane.strand
        kind = ("median" if abs(lane.number) == 1 else "none") if strand is None else "driving"
        if strand is not None and strand.lane is None:
            kind = "sidewalk"
        element = _add(parent, "lane", id=str(lane.number), type=kind, level="false")
        at = LaneAt(road.number, index, lane.number)
        link = _add(element, "link")
        for tag, table in (("predecessor", self._links.predecessors), ("successor", self._links.successors)):
            for other in table.get(at, ()):
                _add(link, tag, id=str(other))
        for offset, a, b in lane.widths:
            _add(element, "width", sOffset=number(offset), **_cubic(a, b))
        if strand is None:
            return
        _add_mark(element, "broken" if change not in (None, "none") else "solid", change)
        if strand.lane is not None:
            limit = self._town.lanes[strand.lane].speed_limit
            _add(element, "speed", sOffset="0", max=number(limit), unit="m/s")
            if begins:
                _add(element, "userData", code=LANE_BEGINS, value="begins")
            turns = self._turns.get(strand.lane, set())
            if len(turns) == 1:
                _add(element, "userData", code=TURN, value=str(next(iter(turns))))


def _add(parent: Element, tag: str, **attributes: str) -> Element:
    return etree.SubElement(parent, tag, attributes)


def _add_mark(lane: Element, kind: str, change: str | None) -> None:
    _add(
        lane,
        "roadMark",
        sOffset="0",
        type=kind,
        weight="standard",
        color="white",
        width=number(_MARK_WIDTH),
        laneChange=change or "none",
    )


def _cubic(a: float, b: float, c: float = 0.0, d: float = 0.0) -> dict[str, str]:
    return {name: rounded(value) for name, value in zip("abcd", (a, b, c, d), strict=True)}


def _write_plan_view(element: Element, road: RoadLayout) -> None:
    view = _add(element, "planView")
    line = road.axis.line
    for row, primitive in zip(line.starts, line.primitives, strict=True):
        s, x, y, heading, length = (number(value) for value in row)
        _write_shape(_add(view, "geometry", s=s, x=x, y=y, hdg=heading, length=length), primitive)


def _write_shape(element: Element, primitive: Primitive) -> None:
    if isinstance(primitive, Polynomial):
        names = [f"{name}{axis}" for axis in "UV" for name in "abcd"]
        values = dict(zip(names, map(number, (*primitive.u, *primitive.v)), strict=True))
        _add(element, "paramPoly3", pRange="normalized", **values)
    elif isinstance(primitive, Arc) and primitive.curvature != 0.0:
        _add(element, "arc", curvature=number(primitive.curvature))
    else:
        _add(element, "line")


# --- Crosswalks and signals ------------------------------------------------------------------------------------------


def _write_crosswalks(element: Element, places: Iterable[CrosswalkPlace]) -> None:
    objects = _add(element, "objects")
    for place in places:
        size = np.ptp(place.corners, axis=0)
        found = _add(
            objects,
            "object",
            type="crosswalk",
            id=str(place.crosswalk.id),
            name="crosswalk",
            s=number(place.s),
            t=number(place.t),
            zOffset="0",
            hdg="0",
            pitch="0",
            roll="0",
            orientation="none",
            length=rounded(size[0]),
            width=rounded(size[1]),
            height="0",
        )
        for parent in (found, _add(found, "outlines")):  # CARLA looks for the former, which older versions have
            outline = _add(parent, "outline", id="0", closed="true", outer="true")
            for u, v in place.corners:
                _add(outline, "cornerLocal", u=number(u), v=number(v), z="0", height="0")


def _write_signals(element: Element, road: RoadLayout, places: Iterable[SignalPlace]) -> None:
    signals = _add(element, "signals")
    for place in places:
        where = {
            "s": number(min(max(place.s, 0.0), road.axis.length)),
            "t": number(place.t),
            "id": str(place.signal.id),
            "orientation": "+" if place.forward else "-",
        }
        found = (
            _add(signals, "signalReference", **where)
            if place.reference
            else _add(signals, "signal", **where, **_signal(road, place))
        )
        for first, last in _runs(place.lanes):
            _add(found, "validity", fromLane=str(first), toLane=str(last))


def _signal(road: RoadLayout, place: SignalPlace) -> dict[str, str]:
    signal = place.signal
    height = signal.position[2] - float(Cubics(height_rows(road)).at(np.array([place.s]))[0])
    light = signal.kind is SignalKind.TRAFFIC_LIGHT
    turned = -signal.heading - place.heading - (np.pi if place.forward else 0.0)
    attributes = {
        "name": str(signal.kind),
        "dynamic": "yes" if light else "no",
        "zOffset": rounded(height),
        "country": "OpenDRIVE" if light else "DE",
        "type": _TYPE_OF.get(signal.kind, _ANY),
        "subtype": _ANY,
        "hOffset": number(wrap_radians(turned)),
        "pitch": "0",
        "roll": "0",
        "height": number(_SIGNAL_HEIGHT),
        "width": number(_SIGNAL_WIDTH),
    }
    if signal.value is not None:
        attributes |= {"value": rounded(signal.value * 3.6), "unit": "km/h"}
    return attributes


def _runs(lanes: Sequence[int]) -> list[tuple[int, int]]:
    """Returns the runs of successive lane numbers; for no lane, lane 0, which nobody drives on."""
    runs: list[tuple[int, int]] = []
    for lane in lanes:
        if runs and lane == runs[-1][1] + 1 != 0:
            runs[-1] = (runs[-1][0], lane)
        else:
            runs.append((lane, lane))
    return runs or [(0, 0)]
