"""Infractions of the ego: red lights, stop signs, leaving the road, driving against the traffic.

They follow from the ego's trajectory alone, whatever drove it. Collisions, the fifth kind, are detected in
`sim.collisions`.
"""

from __future__ import annotations

import enum
import functools
import math
import weakref
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dorothie_gym.copying import Lookups, shared
from dorothie_gym.maps.model import Array, SignalKind
from dorothie_gym.maps.polyline import WIDTH
from dorothie_gym.maps.right_of_way import right_of_way
from dorothie_gym.maps.traffic_lights import LightColour
from dorothie_gym.ontology import ObjectClass
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.records import FindingRecord, LineMarkRecord, RecordArray, StopLineRecord, empty_records
from dorothie_gym.sim.state.town_arrays import town_arrays
from dorothie_gym.sim.traffic_rules import HEIGHT, WIDE_LANE, FindingKind, WatchArrays, X, Y, watch

LONG_AGO = -(1 << 40)
"""A frame before all others."""


class Infraction(enum.StrEnum):
    """A kind of breach of the rules, other than collisions."""

    RED_LIGHT = "red_light"
    """The front of the car passes the end of its lane while the lane's light is red."""
    STOP_SIGN = "stop_sign"
    """It passes the end of a lane with a stop sign and has not stood there with its front within `AT_LINE`."""
    OFF_ROAD = "off_road"
    """Its middle is farther than `OFF_ROAD_MARGIN` outside of every lane's area, and it is not turning round."""
    WRONG_WAY = "wrong_way"
    """Its middle is on lanes that all run against it, outside junctions, and it is not turning round."""


@dataclass(frozen=True, kw_only=True)
class Breach:
    """A breach of a rule: frame, place, and the light or sign.

    Attributes:
        kind: of infraction.
        frame: physics frame.
        lane: lane that was left over its end, nearest lane (off the road), or lane driven against.
        station: distance along it [m].
        x: of the car's middle [m]; `y` likewise.
        key: id of the signal, None where there is none.
        other: class of the signal, None where there is none.
    """

    kind: Infraction
    frame: int
    lane: int
    station: float
    x: float
    y: float
    key: int | None = None
    other: ObjectClass | None = None


class InfractionWatch(Lookups):
    """Watch over the trajectory of one car, which reports each breach of a rule once."""

    LOOKED_UP: ClassVar[Sequence[str]] = ("_arrays",)

    def __init__(self, network: TownNetwork, length: float) -> None:
        """Begins to watch a car of a length [m]."""
        self._network, self._town, self._length = network, network.town, length
        self._lines = _lines(network)
        self._wide = bool(network.table.points[:, WIDTH].max() > WIDE_LANE)
        self._marks, self._last = empty_records(LineMarkRecord, len(self._lines.lanes)), np.full(2, LONG_AGO)

    @functools.cached_property
    def _arrays(self) -> WatchArrays:
        town = town_arrays(self._network)
        return WatchArrays(
            town.points, town.lanes, town.origin, town.cells, town.entries, self._lines.records,
            self._marks, self._last, empty_records(FindingRecord, 0),
        )  # fmt: skip

    def look(self, poses: Array, frame: int) -> list[Breach]:
        """Returns the breaches on a stretch of the trajectory in the order in which they happened.

        Args:
            poses: of the car at successive frames (n + 1, 6), C-contiguous, columns `records.POSE`; the first
                is the last one of the stretch before.
            frame: of the first pose.
        """
        if len(self._arrays.found) < 3 * len(poses):
            room = empty_records(FindingRecord, 3 * len(poses))
            self._arrays = self._arrays._replace(found=room)
        count = watch(self._arrays, poses, frame, self._length, self._wide)
        found: list[Breach] = []
        for station, k, kind, number in self._arrays.found[:count].tolist() if count else ():
            if kind in (FindingKind.LIGHT, FindingKind.STOP_SIGN):
                found += self._at_line(number, frame + k, poses[k])
            else:
                breach = Infraction.OFF_ROAD if kind == FindingKind.OFF_ROAD else Infraction.WRONG_WAY
                found.append(self._beside_lanes(breach, number, station, frame + k, poses[k]))
        return found

    def wait(self, first: int, last: int) -> None:
        """Lets the car stand between two frames; a breach in progress continues."""
        for k, frame in enumerate(self._arrays.last.tolist()):
            if frame == first:
                self._arrays.last[k] = last

    def _at_line(self, line: int, frame: int, pose: Array) -> list[Breach]:
        """Returns the breach of passing a line, if any: at a stop sign without a stand, or at a red light."""
        kind, signal = self._lines.signals[line]
        lane = self._lines.lanes[line]
        infraction, other = Infraction.STOP_SIGN, ObjectClass.TRAFFIC_SIGN
        if kind is SignalKind.TRAFFIC_LIGHT:
            # what it showed when the frame began: so the car was let in
            if self._town.light(lane, (frame - 1) / FRAME_RATE) is not LightColour.RED:
                return []
            infraction, other = Infraction.RED_LIGHT, ObjectClass.TRAFFIC_LIGHT
        return [
            Breach(
                kind=infraction, frame=frame, lane=lane, station=self._town.lanes[lane].length,
                x=float(pose[X]), y=float(pose[Y]), key=signal, other=other,
            )
        ]  # fmt: skip

    def _beside_lanes(self, kind: Infraction, lane: int, station: float, frame: int, pose: Array) -> Breach:
        """Returns the breach of being off the road or against the traffic, at the nearest lane."""
        x, y = float(pose[X]), float(pose[Y])
        if lane < 0:
            place = np.array([x, y])
            index = self._network.get_closest_lane_index(place, height=float(pose[HEIGHT]))
            lane = self._network.lane_id(index)
            station = float(self._network.get_lane(index).local_coordinates(place)[0])
        station = min(max(station, 0.0), self._town.lanes[lane].length)
        return Breach(kind=kind, frame=frame, lane=lane, station=station, x=x, y=y)


@shared
@dataclass(frozen=True, eq=False)
class _Lines:
    """Ends of lanes with a light or stop sign: `StopLineRecord` (m,), lanes, kinds and ids of signals."""

    records: RecordArray[StopLineRecord]
    lanes: tuple[int, ...]
    signals: tuple[tuple[SignalKind, int], ...]


_found_lines: weakref.WeakKeyDictionary[TownNetwork, _Lines] = weakref.WeakKeyDictionary()


def _lines(network: TownNetwork) -> _Lines:
    """Returns the lines of a town's network, found at their first use."""
    found = _found_lines.get(network)
    if found is None:
        found = _found_lines[network] = _look_for_lines(network)
    return found


def _look_for_lines(network: TownNetwork) -> _Lines:
    town, rules = network.town, right_of_way(network.town)
    found = {
        lane: (signal.kind, signal.id)
        for signal in town.signals
        if signal.kind in (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP)
        for lane in signal.lanes
        if rules.control(lane) is signal.kind
    }
    records = empty_records(StopLineRecord, len(found))
    for record, lane in zip(records, sorted(found), strict=True):
        end, heading = town.lanes[lane].points[-1], float(town.lanes[lane].headings[-1])
        record.x, record.y, record.height = end
        record.cos, record.sin = math.cos(heading), math.sin(heading)
        record.half_width = float(town.lanes[lane].widths[-1]) / 2
        record.is_stop = found[lane][0] is SignalKind.STOP
    return _Lines(records, tuple(sorted(found)), tuple(found[lane] for lane in sorted(found)))


# --- World events -----------------------------------------------------------------------------------------------------


class WorldEventKind(enum.StrEnum):
    """Kind of an event of the ego."""

    HAZARD_STOP = "hazard_stop"
    HAZARD_END = "hazard_end"
    COLLISION = "collision"
    RED_LIGHT = "red_light"
    STOP_SIGN = "stop_sign"
    OFF_ROAD = "off_road"
    WRONG_WAY = "wrong_way"


INFRACTION_KINDS = (
    WorldEventKind.COLLISION, WorldEventKind.RED_LIGHT, WorldEventKind.STOP_SIGN, WorldEventKind.OFF_ROAD,
    WorldEventKind.WRONG_WAY,
)  # fmt: skip
"""Kinds of infractions; their data names place and counterpart (`WorldEventLog.infraction`)."""


@dataclass(frozen=True, kw_only=True)
class WorldEvent:
    """Something that happened to the car, at a frame."""

    frame: int
    kind: WorldEventKind
    data: Mapping[str, object] = field(default_factory=dict)


class WorldEventLog:
    """Collects what happens to the car.

    Attributes:
        infractions: how often each rule has been broken, including collisions caused by others.
    """

    def __init__(self, network: TownNetwork, length: float) -> None:
        """Begins with nothing; `length` is that of the car [m]."""
        self._watch = InfractionWatch(network, length)
        self._events: list[WorldEvent] = []
        self.infractions: Counter[WorldEventKind] = Counter()

    def add(self, kind: WorldEventKind, frame: int, **data: object) -> None:
        """Reports something that happened at a frame."""
        self._events.append(WorldEvent(frame=frame, kind=kind, data=data))

    def infraction(
        self, kind: WorldEventKind, frame: int, *, lane: int, station: float, x: float, y: float,
        key: int | None, other: ObjectClass | None, **data: object,
    ) -> None:  # fmt: skip
        """Reports a breach of the rules.

        Args:
            kind: which rule, one of `INFRACTION_KINDS`.
            frame: when.
            lane: where; `station` how far along it [m].
            station: [m].
            x: of the car [m]; `y` likewise.
            y: [m].
            key: of what was touched, or of the light or sign that was passed.
            other: its class.
            data: what else is to be said of it.
        """
        self.infractions[kind] += 1
        place = {
            "lane": lane, "station": round(float(station), 2), "x": round(float(x), 3), "y": round(float(y), 3),
        }  # fmt: skip
        self.add(kind, frame, **place, key=key, other=None if other is None else other.label, **data)

    def close(self, poses: Array, frame: int, *, stood: bool = False) -> list[WorldEvent]:
        """Looks for breaches since the last call, and returns all events since.

        Args:
            poses: of the ego before the stretch and after each of its frames (n + 1, 6), columns `records.POSE`.
            frame: frame of the last of them.
            stood: whether it stood all the time; then there is nothing to find.
        """
        first = frame - len(poses) + 1
        if stood:
            self._watch.wait(first, frame)
        for breach in () if stood else self._watch.look(poses, first):
            self.infraction(
                WorldEventKind(breach.kind.value), breach.frame, lane=breach.lane, station=breach.station,
                x=breach.x, y=breach.y, key=breach.key, other=breach.other,
            )  # fmt: skip
        if not self._events:
            return []
        events, self._events = sorted(self._events, key=lambda event: event.frame), []
        return events
