"""Lane sections of the roads of an OpenDRIVE file, resolved so that each has all lanes of both sides of its road."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

from dorothie_gym.maps.import_notes import NoteKind
from dorothie_gym.maps.link_types import LANE_CHANGES, LinkType
from dorothie_gym.maps.opendrive.elements import Element, ElementReader, describe
from dorothie_gym.maps.opendrive.own_data import LANE_BEGINS, TURN
from dorothie_gym.maps.opendrive.records import DRIVING_TYPES, LaneRecord, SectionRecord

if TYPE_CHECKING:
    from dorothie_gym.maps.opendrive.geometry import Cubics

# Tolerance for the start of a lane section beyond the end of its road [m]: exporters round.
ROUNDING = 0.1

# Shortest part of a lane section that is divided where the access to a lane changes [m].
SHORTEST_PART = 1.0

# Road users whose permission includes the cars of a town, and whose prohibition keeps these away.
_PERMITTED = frozenset(("passengerCar", "autonomousTraffic", "simulator", "throughTraffic", "none"))
_PROHIBITED = frozenset(("passengerCar",))


def read_sections(reader: ElementReader, road: Element, length: float, right_hand: bool) -> tuple[SectionRecord, ...]:
    """Returns the lane sections of a road in the order of s.

    A section of one side only (`singleSide`, OpenDRIVE 1.4 to 1.8) has the lanes of the section before it on the other
    side. A section in which cars lose or gain the access to a lane is divided there.

    Args:
        reader: reader with the notes.
        road: the road.
        length: its length [m].
        right_hand: whether traffic keeps to the right on it.

    Raises:
        TownError: the road has no lane section that can be understood.
    """
    found = _ordered(reader, road, length)
    ends = [*(start for start, _ in found[1:]), max(length, found[-1][0])]
    sections: list[SectionRecord] = []
    for (start, element), end in zip(found, ends, strict=True):
        lanes: dict[int, LaneRecord] = {}
        elements = element.iterfind("*/lane")
        for lane in reader.attempts(NoteKind.LANE, elements, lambda e: _lane(reader, e, right_hand)):
            if lane.id in lanes:
                where = f"{describe(element)} / lane {lane.id}"
                reader.notes.dropped(NoteKind.LANE, where, "another lane of its section has the same id")
            lanes[lane.id] = lane
        section = SectionRecord(start=start, end=end, lanes=lanes)
        if element.get("singleSide") == "true" and sections:
            sections[-1], section = _continue_side(sections[-1], section)
        sections.append(section)
    return tuple(part for section in sections for part in _divided(section))


def _ordered(reader: ElementReader, road: Element, length: float) -> list[tuple[float, Element]]:
    """Returns the lane sections of a road with their starts [m], in the order of s."""

    def placed(element: Element) -> tuple[float, Element]:
        start = reader.number(element, "s")
        if not -ROUNDING <= start <= length + ROUNDING:
            reader.fail(element, f"the lane sections of its road must start between 0 and its length of {length:g} m")
        return start, element

    elements = road.findall("lanes/laneSection")
    if not elements:
        reader.fail(road, "has no lane section")
    found = list(reader.attempts(NoteKind.SECTION, elements, placed))
    if not found:
        reader.fail(road, "has no lane section between its start and its end")
    if any(later[0] < earlier[0] for earlier, later in pairwise(found)):
        reader.notes.repaired(NoteKind.SECTION, describe(road), "its lane sections were not in the order of s")
        found.sort(key=lambda row: row[0])
    return found


def _continue_side(before: SectionRecord, section: SectionRecord) -> tuple[SectionRecord, SectionRecord]:
    """Continues the lanes of a side on which a section has none; returns the section before it and the section."""
    sides = [side for side in (1, -1) if not any(number * side > 0 for number in section.lanes)]
    carried = {n: lane for n, lane in before.lanes.items() if any(n * side > 0 for side in sides)}
    return _joined(before, carried), replace(
        section, lanes=section.lanes | _onward(carried, section.start - before.start)
    )


def _joined(section: SectionRecord, lanes: dict[int, LaneRecord]) -> SectionRecord:
    """Returns a section some of whose lanes continue in the next one under the same numbers."""
    return replace(section, lanes=section.lanes | {n: replace(lane, successors=(n,)) for n, lane in lanes.items()})


def _onward(lanes: dict[int, LaneRecord], shift: float) -> dict[int, LaneRecord]:
    """Returns lanes as they continue in a section that starts later [m]."""
    return {n: replace(lane, predecessors=(n,), shift=lane.shift + shift, begins=False) for n, lane in lanes.items()}


def _divided(section: SectionRecord) -> Iterator[SectionRecord]:
    """Yields the parts of a section in which cars have access to the same lanes."""
    restricted = {n: lane for n, lane in section.lanes.items() if lane.access and lane.type in DRIVING_TYPES}
    if not restricted:
        yield section
        return
    starts = [0.0]
    changes = {offset - lane.shift for lane in restricted.values() for offset, _ in lane.access}
    for change in sorted(changes):
        if change - starts[-1] >= SHORTEST_PART and section.end - section.start - change >= SHORTEST_PART:
            starts.append(change)
    ends = [*starts[1:], section.end - section.start]
    lanes = section.lanes
    for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
        middle = 0.5 * (start + end)
        closed = {n: replace(lane, closed=not _is_open(section.lanes[n], middle)) for n, lane in lanes.items()}
        part = SectionRecord(start=section.start + start, end=section.start + end, lanes=closed)
        lanes = _onward(lanes, end - start)
        yield part if k == len(starts) - 1 else _joined(part, part.lanes)


def _is_open(lane: LaneRecord, offset: float) -> bool:
    """Returns whether cars have access to a lane at a distance from the start of its section [m]."""
    return next((is_open for start, is_open in reversed(lane.access) if start <= offset + lane.shift), True)


# --- Lanes -----------------------------------------------------------------------------------------------------------


def _lane(reader: ElementReader, lane: Element, right_hand: bool) -> LaneRecord:
    width = reader.cubics(lane, "width", "sOffset")
    number = reader.integer(lane, "id")
    record = LaneRecord(
        id=number,
        type=lane.get("type", "none") if number != 0 else "none",  # lane 0 is the centre line, without a width
        width=width,
        border=_border(reader, lane) if len(width.rows) == 0 else None,
        predecessors=_links(reader, lane, "predecessor"),
        successors=_links(reader, lane, "successor"),
        speeds=tuple((reader.number(e, "sOffset", 0.0), v) for e, v in reader.speeds(lane.iterfind("speed"))),
        changes=tuple(str(e.get("laneChange")) for e in lane.iterfind("roadMark") if e.get("laneChange")),
        level=lane.get("level") == "true",
    )
    if record.type not in DRIVING_TYPES:
        return record
    if len(width.rows) == 0 and record.border is None:
        reader.fail(lane, "is a driving lane without a width or border element")
    backward = _runs_against(reader, lane, (number < 0) == right_hand)
    begins = any(data.get("code") == LANE_BEGINS for data in lane.iterfind("userData"))
    return replace(record, reversed=backward, access=_access(reader, lane), begins=begins, turn=_turn(lane))


def _turn(lane: Element) -> LinkType | None:
    """Returns the type of the turn over a lane of our own files; None where they say none that there is."""
    said = {str(data.get("value")) for data in lane.iterfind("userData") if data.get("code") == TURN}
    return next((kind for kind in LinkType if kind not in LANE_CHANGES and said == {kind.value}), None)


def _border(reader: ElementReader, lane: Element) -> Cubics | None:
    border = reader.cubics(lane, "border", "sOffset")
    return border if len(border.rows) else None


def _links(reader: ElementReader, lane: Element, side: str) -> tuple[int, ...]:
    """Returns the linked lane numbers at one end; from OpenDRIVE 1.6 on there may be several."""
    elements = lane.iterfind(f"link/{side}")
    return tuple(dict.fromkeys(reader.attempts(NoteKind.LANE_LINK, elements, lambda e: reader.integer(e, "id"))))


def _runs_against(reader: ElementReader, lane: Element, forward: bool) -> bool:
    """Returns whether traffic runs against the rule of a lane's side.

    OpenDRIVE 1.8 has the attribute `direction`; RoadRunner writes the direction along the road (`travelDir`).

    Args:
        reader: reader with the notes.
        lane: the lane.
        forward: whether its side runs along the reference line.
    """
    direction = lane.get("direction", "")
    vector = lane.find("userData/vectorLane")
    travel = "" if vector is None else vector.get("travelDir", "")
    if direction == "both" or (not direction and travel == "bidirectional"):
        way = "is for both directions; one direction is driven, that of its side of the road"
        reader.notes.assumed(NoteKind.DIRECTION, describe(lane), way)
        return False
    if direction:
        return direction == "reversed"
    return travel == ("backward" if forward else "forward")


def _access(reader: ElementReader, lane: Element) -> tuple[tuple[float, bool], ...]:
    """Returns where cars lose or gain access along a lane: offset [m], and whether they have access from there.

    Restrictions are attributes up to OpenDRIVE 1.7 and child elements in 1.8; without a rule they deny. All elements of
    one offset count together: whoever is not permitted by any of them is denied.
    """
    rules: defaultdict[float, set[tuple[bool, str]]] = defaultdict(set)
    for element in lane.iterfind("access"):
        offset = reader.attempt(NoteKind.ACCESS, partial(reader.number, element, "sOffset", 0.0))
        users = [element.get("restriction"), *(child.get("type") for child in element.iterfind("restriction"))]
        if offset is not None:
            allows = element.get("rule", "deny") == "allow"
            rules[offset].update((allows, user) for user in users if user)
    found = []
    for offset in sorted(rules):
        permitted = {user for allows, user in rules[offset] if allows}
        prohibited = {user for allows, user in rules[offset] if not allows}
        found.append((offset, not prohibited & _PROHIBITED and (not permitted or bool(permitted & _PERMITTED))))
    if not all(is_open for _, is_open in found):
        reader.notes.dropped(NoteKind.ACCESS, describe(lane), "is closed to cars; at least a part is not driven on")
    return tuple(found)
