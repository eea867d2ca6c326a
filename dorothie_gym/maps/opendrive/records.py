"""Records of an OpenDRIVE file: the parts relevant for driving, validated but not interpreted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dorothie_gym.maps.import_notes import ImportNotes
from dorothie_gym.maps.link_types import LinkType
from dorothie_gym.maps.model import Array
from dorothie_gym.maps.opendrive.geometry import Cubics, ReferenceLine
from dorothie_gym.maps.town import LightProgramme

DRIVING_TYPES = frozenset(
    ("driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane", "mwyEntry", "mwyExit")
)
"""One-way lane types for all cars: "driving", and the lane types of ramps.

Excluded are "bidirectional" (a central turn lane for both directions) and lanes for buses, taxis or parking.
"""

SIDEWALK_TYPES = frozenset(("sidewalk", "walking"))
"""Lane types of sidewalks; the second is the name in OpenDRIVE 1.8."""


@dataclass(frozen=True, kw_only=True)
class LaneRecord:
    """Lane of a lane section.

    Attributes:
        id: lane number; 0 is the reference line, positive to its left.
        type: OpenDRIVE lane type.
        width: profile over the distance from the section's start.
        border: profile of the lateral position of the outer edge, positive left, if the file contains this instead of
            widths.
        predecessors, successors: linked lane numbers before and after it along the reference line.
        speeds: (offset from the section's start [m], limit [m/s]).
        changes: lane changes permitted by the outer road marks, one entry for each mark ("none", "both", "increase",
            "decrease"); empty if unspecified.
        reversed: whether traffic runs against the rule of its side.
        level: whether it stays level where its road is tilted.
        access: (offset from the start of its profiles [m], whether cars have access from there); cars have access
            where nothing is said.
        closed: whether cars have no access.
        begins: whether it is no part of the lane before it in driving direction, although that leads nowhere else.
        turn: type of the turn over it, where the file says it.
        shift: distance from the start of its profiles to the start of its section [m]; not 0 where a section was
            divided, or continues the lanes of the one before.
    """

    id: int
    type: str
    width: Cubics
    border: Cubics | None = None
    predecessors: tuple[int, ...] = ()
    successors: tuple[int, ...] = ()
    speeds: tuple[tuple[float, float], ...] = ()
    changes: tuple[str, ...] = ()
    reversed: bool = False
    level: bool = False
    access: tuple[tuple[float, bool], ...] = ()
    closed: bool = False
    begins: bool = False
    turn: LinkType | None = None
    shift: float = 0.0

    @property
    def drives(self) -> bool:
        """Whether it is a lane for cars."""
        return self.type in DRIVING_TYPES and not self.closed

    @property
    def is_closed(self) -> bool:
        """Whether it has no width anywhere in its section."""
        return self.border is None and not np.any(self.width.rows[:, 1:])


@dataclass(frozen=True, kw_only=True)
class SectionRecord:
    """Part of a road with constant lanes, from `start` to `end` [m]; lanes by number."""

    start: float
    end: float
    lanes: dict[int, LaneRecord]


@dataclass(frozen=True, kw_only=True)
class RoadLink:
    """Link at one end of a road: to the "start" or "end" of a road, or to a junction.

    The parser completes links without a contact point.
    """

    is_road: bool
    id: int
    contact: str = ""


@dataclass(frozen=True, kw_only=True)
class SignalRecord:
    """Sign or light of a road.

    Attributes:
        id: number of its id.
        type, dynamic, value: attributes in the file.
        s, t, z: road coordinates [m] and height above the road [m].
        heading: angle relative to the road [rad].
        orientation: "+", "-" or "none".
        lanes: ranges (from, to) of lane numbers that it applies to; empty if unspecified.
        reference: whether the record refers to a signal of another road.
    """

    id: int
    type: str = ""
    dynamic: bool = False
    value: float | None = None
    s: float
    t: float
    z: float = 0.0
    heading: float = 0.0
    orientation: str = "none"
    lanes: tuple[tuple[int, int], ...] = ()
    reference: bool = False


@dataclass(frozen=True, kw_only=True)
class CrosswalkRecord:
    """Crosswalk: road coordinates, and corners (n, 2) in local (u, v) or road (s, t) coordinates [m]."""

    s: float
    t: float
    heading: float
    corners: Array
    on_road: bool


@dataclass(frozen=True, kw_only=True)
class RoadRecord:
    """Road.

    Attributes:
        id: number of its id.
        name: its id in the file.
        street: name of its street; empty if the file has none.
        length: [m].
        junction: junction that the road crosses, or -1.
        right_hand: traffic keeps to the right.
        line, elevation, offset: reference line, its height and the lateral shift of the lanes.
        superelevation: roll angle of the road about its reference line [rad]; the left side is up if it is positive.
        sections: lane sections in order.
        predecessor, successor: links at its start and end.
        speeds: (from s [m], limit [m/s]).
        signals, crosswalks: signals and crosswalks of the road.
    """

    id: int
    name: str
    street: str = ""
    length: float
    junction: int
    right_hand: bool
    line: ReferenceLine
    elevation: Cubics
    superelevation: Cubics
    offset: Cubics
    sections: tuple[SectionRecord, ...]
    predecessor: RoadLink | None
    successor: RoadLink | None
    speeds: tuple[tuple[float, float], ...] = ()
    signals: tuple[SignalRecord, ...] = ()
    crosswalks: tuple[CrosswalkRecord, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ConnectionRecord:
    """Connection in a junction: links from lanes of the incoming road to lanes of the connecting road.

    Attributes:
        incoming, connecting: numbers of the roads.
        contact: end of the connecting road at the incoming road, "start" or "end".
        lanes: pairs (lane of the incoming road, lane of the connecting road); empty for equal lane numbers.
        direct: whether the junction has no connecting roads: the linked road starts or ends at it, and its lanes may
            also lead back.
    """

    incoming: int
    connecting: int
    contact: str
    lanes: tuple[tuple[int, int], ...]
    direct: bool = False


@dataclass(frozen=True, kw_only=True)
class OpenDriveRecords:
    """Contents of a file.

    Attributes:
        source: the file, as named by the user.
        notes: notes, to which later steps add.
        roads: roads in the order of the file, by number.
        junctions: connections by junction number.
        programmes: light programmes by junction number, where the file has them.
        own: whether the file is one of ours, which name the streets of all roads that have one.
    """

    source: str
    notes: ImportNotes
    roads: dict[int, RoadRecord]
    junctions: dict[int, tuple[ConnectionRecord, ...]] = field(default_factory=dict)
    programmes: dict[int, LightProgramme] = field(default_factory=dict)
    own: bool = False
