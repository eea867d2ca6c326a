"""Rules of the road that the car broke: red lights, stop signs, leaving the road, driving against the traffic.

Everything is read off the way that the car took, whoever drove it: nothing here asks what it was told or meant to do.
Collisions, the fifth kind, are found where bodies move (`boxes`, `world`).
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology import ObjectClass
from dorothie_gym.world.compiling import allocating
from dorothie_gym.world.config import FRAME_RATE
from dorothie_gym.world.junctions import AT_LINE, STANDING
from dorothie_gym.world.network.network import TownNetwork
from dorothie_gym.world.network.polyline import IntArray, local_coordinates, value_at
from dorothie_gym.world.town.lights import LightColour
from dorothie_gym.world.town.model import Array, SignalKind
from dorothie_gym.world.town.right_of_way import right_of_way

OFF_ROAD = 0.5
"""The car has left the road when its middle is farther than this outside of every lane, connectors included [m]."""

AGAINST = math.cos(math.radians(120.0))
"""Cosine of the angle to a lane from which on the car drives against it (CARLA's scenario runner, WrongLaneTest)."""

LEVEL = 2.5
"""Lanes further above or below the car are another road's [m]."""

NEARBY = 10.0
"""How far around the car lanes are looked at [m]: more than half of any lane's width."""

OVER = 1.0
"""Off the road, or against the traffic, is over when it has not been so for this long; then it may count anew [s]."""

FORGET = 12.0
"""Who has stood at a stop sign and is this far from its line has to stand again [m]."""


class Infraction(enum.StrEnum):
    """A kind of breach of the rules, other than collisions."""

    RED_LIGHT = "red_light"
    """The front of the car passes the end of its lane while the lane's light is red."""
    STOP_SIGN = "stop_sign"
    """It passes the end of a lane with a stop sign and has not stood there with its front within `AT_LINE`."""
    OFF_ROAD = "off_road"
    """Its middle is farther than `OFF_ROAD` outside of every lane's area, and it is not turning round."""
    WRONG_WAY = "wrong_way"
    """Its middle is on lanes that all run against it, outside junctions, and it is not turning round."""


@dataclass(frozen=True, kw_only=True)
class Breach:
    """That a rule was broken, when, where, and which light or sign tells so.

    Attributes:
        kind: of infraction.
        frame: physics frame.
        lane: lane that was left over its end, that is nearest (off the road), or that is driven against.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Track:
    """The way of a car: its poses at successive frames; the first is the last one of the track before.

    Attributes:
        frame: number of the first pose's frame.
        x: of its middle (n,) [m]; `y` likewise.
        headings: (n,) [rad].
        speeds: (n,) [m/s].
        heights: of the road under it (n,) [m].
        turning: whether it was turning round, as it may across the lanes of a road (n,).
        length: of the car [m].
    """

    frame: int
    x: Array
    y: Array
    headings: Array
    speeds: Array
    heights: Array
    turning: NDArray[np.bool_]
    length: float


@dataclass(frozen=True, eq=False)
class _Lines:
    """Ends of lanes with a light or stop sign (m,): place [m], direction, half width and height [m], lane, signal."""

    x: Array
    y: Array
    cosines: Array
    sines: Array
    halves: Array
    heights: Array
    lanes: tuple[int, ...]
    signals: tuple[tuple[SignalKind, int], ...]

    @classmethod
    def of(cls, network: TownNetwork) -> _Lines:
        town, rules = network.town, right_of_way(network.town)
        found = {
            lane: (signal.kind, signal.id)
            for signal in town.signals
            if signal.kind in (SignalKind.TRAFFIC_LIGHT, SignalKind.STOP)
            for lane in signal.lanes
            if rules.control(lane) is signal.kind
        }
        lanes = [town.lanes[lane] for lane in sorted(found)]
        headings = np.array([lane.headings[-1] for lane in lanes])
        ends = np.array([lane.points[-1] for lane in lanes]).reshape(-1, 3)
        return cls(
            x=ends[:, 0], y=ends[:, 1], cosines=np.cos(headings), sines=np.sin(headings),
            halves=np.array([lane.widths[-1] for lane in lanes]) / 2, heights=ends[:, 2],
            lanes=tuple(sorted(found)), signals=tuple(found[lane] for lane in sorted(found)),
        )  # fmt: skip


class InfractionWatch:
    """Looks at the way of one car, stretch by stretch, and tells each breach of a rule once."""

    def __init__(self, network: TownNetwork) -> None:
        self._network = network
        self._town = network.town
        self._lines = _Lines.of(network)
        lanes = [self._town.lanes[network.lane_id(index)] for index in network.lanes_dict()]
        self._ids = [lane.id for lane in lanes]
        self._connectors = np.array([lane.in_junction for lane in lanes])
        self._stood: set[int] = set()  # lines at which the car has come to a stand
        self._last: dict[Infraction, int] = {}  # frames at which it was off the road, or against the traffic

    def look(self, track: Track) -> list[Breach]:
        """Breaches on a stretch of way, in the order in which they happened."""
        found = self._at_lines(track) if self._lines.lanes else []
        for k in range(1, len(track.x)):
            if not track.turning[k]:
                found += self._beside_lanes(track, k)
        return sorted(found, key=lambda breach: breach.frame)

    # --- lines ------------------------------------------------------------------------------------------------------

    def _at_lines(self, track: Track) -> list[Breach]:
        """Lines that the car's front passed though it should not have."""
        lines = self._lines
        c, s = np.cos(track.headings), np.sin(track.headings)
        dx = (track.x + track.length / 2 * c)[:, None] - lines.x  # (n, m)
        dy = (track.y + track.length / 2 * s)[:, None] - lines.y
        beyond, across = dx * lines.cosines + dy * lines.sines, dy * lines.cosines - dx * lines.sines
        facing = c[:, None] * lines.cosines + s[:, None] * lines.sines > 0.5
        on = facing & (np.abs(across) <= lines.halves) & (np.abs(track.heights[:, None] - lines.heights) <= LEVEL)
        passed = on[1:] & (beyond[:-1] <= 0.0) & (beyond[1:] > 0.0) & ~track.turning[1:, None]
        stands = on & (beyond <= 0.0) & (beyond >= -AT_LINE) & (track.speeds < STANDING)[:, None]
        found: list[Breach] = []
        for k in range(1, len(track.x)):
            self._stood.update(int(j) for j in np.flatnonzero(stands[k - 1]))
            crossed = np.flatnonzero(passed[k - 1])
            if len(crossed):  # on the border of two lanes it is on the one whose middle is nearer
                j = int(crossed[np.argmin(np.abs(across[k, crossed]))])
                found += self._judge(j, track, k)
                self._stood.discard(j)
        self._stood = {j for j in self._stood if math.hypot(dx[-1, j], dy[-1, j]) < FORGET}
        return found

    def _judge(self, j: int, track: Track, k: int) -> list[Breach]:
        kind, signal = self._lines.signals[j]
        lane = self._lines.lanes[j]
        if kind is SignalKind.TRAFFIC_LIGHT:
            # what it showed when the frame began: so the car was let in
            broken = self._town.light(lane, (track.frame + k - 1) / FRAME_RATE) is LightColour.RED
            infraction, other = Infraction.RED_LIGHT, ObjectClass.TRAFFIC_LIGHT
        else:
            broken = j not in self._stood
            infraction, other = Infraction.STOP_SIGN, ObjectClass.TRAFFIC_SIGN
        if not broken:
            return []
        station = self._town.lanes[lane].length
        return [self._breach(infraction, track, k, lane=lane, station=station, key=signal, other=other)]

    # --- lanes ------------------------------------------------------------------------------------------------------

    def _beside_lanes(self, track: Track, k: int) -> list[Breach]:
        table = self._network.table
        x, y, height = float(track.x[k]), float(track.y[k]), float(track.heights[k])
        outside, against, row, station = _survey(
            table.points, table.offsets, table.ends, table.boxes, self._connectors,
            x, y, float(track.headings[k]), height,
        )  # fmt: skip
        broken = {Infraction.OFF_ROAD: outside > OFF_ROAD, Infraction.WRONG_WAY: bool(against)}
        found: list[Breach] = []
        for kind in (kind for kind, is_broken in broken.items() if is_broken):
            frame = track.frame + k
            last = self._last.get(kind)
            self._last[kind] = frame
            if last is not None and frame - last <= OVER * FRAME_RATE:
                continue
            if row < 0:
                index = self._network.get_closest_lane_index(np.array([x, y]), height=height)
                row = self._network.row(index)
                station = float(
                    np.clip(self._network.get_lane(index).local_coordinates(np.array([x, y]))[0], 0.0, None)
                )
            lane = self._ids[row]
            station = min(max(station, 0.0), self._town.lanes[lane].length)
            found.append(self._breach(kind, track, k, lane=lane, station=station))
        return found

    def _breach(
        self, kind: Infraction, track: Track, k: int, *, lane: int, station: float,
        key: int | None = None, other: ObjectClass | None = None,
    ) -> Breach:  # fmt: skip
        return Breach(
            kind=kind, frame=track.frame + k, lane=lane, station=float(station),
            x=float(track.x[k]), y=float(track.y[k]), key=key, other=other,
        )  # fmt: skip


@allocating
def _survey(
    points: Array, offsets: IntArray, ends: Array, boxes: Array, connectors: NDArray[np.bool_],
    x: float, y: float, heading: float, height: float,
) -> tuple[float, bool, int, float]:  # fmt: skip
    """How far outside of all lanes a place is [m], whether all lanes it is on run against a heading, and the nearest.

    Returns:
        Distance to the nearest lane's area (negative inside), whether it is on lanes and all of them run the other
        way (connectors never do), row of the nearest lane (-1: none nearby) and the station on it [m].
    """
    outside, nearest, at = np.inf, -1, 0.0
    with_it, against = False, False
    for row in range(len(boxes)):
        if x < boxes[row, 0] - NEARBY or x > boxes[row, 2] + NEARBY:
            continue
        if y < boxes[row, 1] - NEARBY or y > boxes[row, 3] + NEARBY:
            continue
        station, lateral = local_coordinates(points, offsets, ends, row, x, y)
        if abs(value_at(points, offsets, row, 4, station) - height) > LEVEL:
            continue
        length = points[offsets[row + 1] - 1, 2]
        side = abs(lateral) - 0.5 * value_at(points, offsets, row, 5, station)
        out = max(side, -station, station - length)
        if out < outside:
            outside, nearest, at = out, row, station
        if out > 0.0:
            continue
        if connectors[row] or math.cos(heading - value_at(points, offsets, row, 3, station)) > AGAINST:
            with_it = True
        else:
            against = True
    return outside, against and not with_it, nearest, at
