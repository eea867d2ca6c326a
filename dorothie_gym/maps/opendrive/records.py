"""What an OpenDRIVE file says, as records: the parts that matter for driving, checked, nothing interpreted yet."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.opendrive.geometry import Cubics, ReferenceLine

DRIVING = frozenset(
    ("driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane", "mwyEntry", "mwyExit")
)
"""Lane types that everybody drives on in one direction: "driving", and what OpenDRIVE calls the lanes of ramps.

Not "bidirectional" (a turn lane for both directions in the middle), nor lanes for buses, taxis or parking.
"""

SIDEWALK = frozenset(("sidewalk", "walking"))
"""Lane types of pavements; the second is OpenDRIVE 1.8's name."""


@dataclass(frozen=True, kw_only=True)
class LaneRecord:
    """One lane of one lane section.

    Attributes:
        id: lane number; 0 is the reference line, positive to its left.
        type: OpenDRIVE lane type.
        width: profile over the distance from the section's start.
        border: profile of the outer edge's place beside the reference line, positive left, where the file gives this
            instead of widths.
        predecessor, successor: lane numbers before and behind it along the reference line, if linked.
        speeds: (offset from the section's start [m], limit [m/s]).
        changes: what the outer road mark says about changing lanes, one entry a mark ("none", "both", "increase",
            "decrease"); empty where the file does not say.
    """

    id: int
    type: str
    width: Cubics
    border: Cubics | None = None
    predecessor: int | None
    successor: int | None
    speeds: tuple[tuple[float, float], ...] = ()
    changes: tuple[str, ...] = ()

    @property
    def drives(self) -> bool:
        """Whether it is a lane for cars, of the kind that we keep."""
        return self.type in DRIVING

    @property
    def is_closed(self) -> bool:
        """Whether it has no width anywhere in its section: a lane that the file only announces."""
        return self.border is None and not np.any(self.width.rows[:, 1:])


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
        superelevation: roll angle of the road about its reference line [rad]; the left side is up if it is positive.
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
    """A way into a junction: which lanes of the incoming road go on in which lanes of the connecting road.

    Attributes:
        incoming, connecting: the roads.
        contact: end of the connecting road, "start" or "end", that meets the incoming one.
        lanes: pairs (lane of the incoming road, lane of the connecting road); none where equal lanes are meant.
        direct: the junction has no roads of its own: the connecting road is one that leads on from it, and its lanes
            may as well lead back.
    """

    incoming: int
    connecting: int
    contact: str
    lanes: tuple[tuple[int, int], ...]
    direct: bool = False


@dataclass(frozen=True, kw_only=True)
class OpenDriveRecords:
    """A whole file: roads in its order, connections of each junction."""

    source: str
    roads: dict[int, RoadRecord]
    junctions: dict[int, tuple[ConnectionRecord, ...]] = field(default_factory=dict)
