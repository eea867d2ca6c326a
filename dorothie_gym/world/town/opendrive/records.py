"""What an OpenDRIVE file says, as records: the parts that matter for driving, checked, nothing interpreted yet."""

from __future__ import annotations

from dataclasses import dataclass, field

from dorothie_gym.world.town.model import Array
from dorothie_gym.world.town.opendrive.geometry import Cubics, ReferenceLine


@dataclass(frozen=True, kw_only=True)
class LaneRecord:
    """One lane of one lane section.

    Attributes:
        id: lane number; 0 is the reference line, positive to its left.
        type: OpenDRIVE lane type, "driving" for the lanes that we keep.
        width: profile over the distance from the section's start.
        predecessor, successor: lane numbers before and behind it along the reference line, if linked.
        speeds: (offset from the section's start [m], limit [m/s]).
        changes: what the outer road mark says about changing lanes, one entry a mark ("none", "both", "increase",
            "decrease"); empty where the file does not say.
    """

    id: int
    type: str
    width: Cubics
    predecessor: int | None
    successor: int | None
    speeds: tuple[tuple[float, float], ...] = ()
    changes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SectionRecord:
    """A stretch of road with constant lanes, from `start` to `end` [m]; lanes by number."""

    start: float
    end: float
    lanes: dict[int, LaneRecord]


@dataclass(frozen=True, kw_only=True)
class RoadLink:
    """What a road meets at one end: a road at its "start" or "end", or a junction."""

    is_road: bool
    id: int
    contact: str = ""


@dataclass(frozen=True, kw_only=True)
class SignalRecord:
    """A sign or light of a road.

    Attributes:
        id: the file's own number.
        type, dynamic, value: as the file says.
        s, t, z: place on the road [m] and height above it [m].
        heading: angle against the road [rad].
        orientation: "+", "-" or "none".
        lanes: ranges (from, to) of lane numbers that it rules; empty where the file does not say.
        reference: the record stands for a signal of another road.
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
    """A crossing: its place on the road, and its corners (n, 2), local (u, v) or on the road (s, t) [m]."""

    s: float
    t: float
    heading: float
    corners: Array
    on_road: bool


@dataclass(frozen=True, kw_only=True)
class RoadRecord:
    """A road.

    Attributes:
        id: the file's own number.
        length: [m].
        junction: junction that the road crosses, or -1.
        right_hand: traffic keeps to the right.
        line, elevation, offset: reference line, its height and the lateral shift of the lanes.
        sections: lane sections in order.
        predecessor, successor: what it meets at its start and end.
        speeds: (from s [m], limit [m/s]).
        signals, crosswalks: what stands on it.
    """

    id: int
    length: float
    junction: int
    right_hand: bool
    line: ReferenceLine
    elevation: Cubics
    offset: Cubics
    sections: tuple[SectionRecord, ...]
    predecessor: RoadLink | None
    successor: RoadLink | None
    speeds: tuple[tuple[float, float], ...] = ()
    signals: tuple[SignalRecord, ...] = ()
    crosswalks: tuple[CrosswalkRecord, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ConnectionRecord:
    """A way into a junction: which lanes of the incoming road go on in which lanes of the connecting road."""

    incoming: int
    connecting: int
    contact: str
    lanes: tuple[tuple[int, int], ...]


@dataclass(frozen=True, kw_only=True)
class OpenDriveRecords:
    """A whole file: roads in its order, connections of each junction."""

    source: str
    roads: dict[int, RoadRecord]
    junctions: dict[int, tuple[ConnectionRecord, ...]] = field(default_factory=dict)
