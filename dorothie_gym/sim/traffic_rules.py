"""Infractions of the ego and their detection: red lights, stop signs, stretches off the road or against the traffic."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.maps.model import LEVEL_HEIGHT, Array
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.lane_lookup import LOOKUP_CELL, closest_segment, coordinates, value_near
from dorothie_gym.sim.state.codes import COLLISION, NOBODY, OFF_ROAD, RED_LIGHT, STOP_SIGN, WRONG_WAY, Colour, EventCode
from dorothie_gym.sim.state.records import POSE, BreachRecord, EventRecord
from dorothie_gym.sim.state.town_arrays import OFF_ROAD_MARGIN
from dorothie_gym.sim.state.world_arrays import WorldArrays
from dorothie_gym.sim.traffic.junctions import colour_at
from dorothie_gym.sim.traffic.parameters import AT_LINE, TRAFFIC_STANDING
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined
from dorothie_gym.support.compilation.records import plain
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.sim.network.network import TownNetwork
    from dorothie_gym.sim.state.record_views import ArrayHolder
    from dorothie_gym.sim.state.town_arrays import TownArrays
    from dorothie_gym.sim.state.town_records import LaneRecord, StopLineRecord
    from dorothie_gym.sim.state.world_arrays import WorldArrays

AGAINST = pm.cos(math.radians(120.0))
"""Cosine of the angle to a lane above which the car drives against it (CARLA's scenario runner, WrongLaneTest)."""

NEARBY = 10.0
"""Range around the car for the nearest lane [m]: more than half of any lane's width."""

BREACH_PAUSE = FRAME_RATE
"""Time without being off the road, or against the traffic, after which it counts as a new breach [frames]."""

FORGET = 12.0
"""Distance from a stop line at which a stop there is forgotten [m]."""

X, Y, HEADING, SPEED, HEIGHT, TURNING = range(len(POSE))
"""Columns of poses."""


@compiled
def watch(town: TownArrays, world: WorldArrays) -> None:
    """Watches the ego over the last call of `sim.step.step`: counts its breaches, and lists all but collisions.

    A car that stood all the time breaks no rule; an infraction in progress continues.

    Args:
        town: arrays of the town.
        world: arrays of the world; counts, list and marks of the lines are written.
    """
    poses, state, count = world.poses, world.watch[0], int(world.car[0].frames)
    frame = world.clock[0].frame - count
    for n in range(world.car[0].events):
        if world.events[n].code == EventCode.COLLISION:
            state.counts[COLLISION] += 1
    if _stands(poses, count):
        for kind in range(len(state.last)):
            if state.last[kind] == frame:
                state.last[kind] = frame + count
        return
    near = _lines_near(town, world, count)
    for k in range(1, count + 1):
        if near > 0:
            _look_at_lines(town, world, k, frame + k, near)
        if poses[k, TURNING] == 0.0:
            _look_beside_lanes(town, world, k, frame + k)
    if near > 0:
        _forget(town, world, count, near)


@inlined
def _stands(poses: Array, last: int) -> bool:
    """Returns whether the ego is where it was, and stands."""
    same = poses[0, X] == poses[last, X] and poses[0, Y] == poses[last, Y] and poses[0, HEADING] == poses[last, HEADING]
    return bool(same and poses[0, SPEED] == 0.0 and poses[last, SPEED] == 0.0)


@compiled
def _list(world: WorldArrays, k: int, frame: int, kind: int, lane: int, station: float, signal: int) -> None:
    """Counts and lists a breach at pose k."""
    poses = world.poses
    world.watch[0].counts[kind] += 1
    breach = world.breaches[world.car[0].breaches]
    world.car[0].breaches += 1
    breach.frame, breach.kind, breach.lane, breach.station, breach.signal = frame, kind, lane, station, signal
    breach.x, breach.y, breach.height = poses[k, X], poses[k, Y], poses[k, HEIGHT]


# --- Lines ------------------------------------------------------------------------------------------------------------


@inlined
def _lines_near(town: TownArrays, world: WorldArrays, last: int) -> int:
    """Lists the lines that may have been passed, and forgets stops at all others; returns the number of lines."""
    lines, marks, poses, length = town.lines, world.marks, world.poses, world.vehicles[0].length
    x, y, extent2 = poses[0, X], poses[0, Y], 0.0
    for k in range(1, last + 1):
        dx, dy = poses[k, X] - x, poses[k, Y] - y
        extent2 = max(extent2, dx * dx + dy * dy)
    # the front is no farther beyond a passed line than the distance since the previous pose
    reach = 3.0 * math.sqrt(extent2) + 2.0 * length + FORGET
    near = 0
    for j in range(len(lines)):
        line = lines[j]
        dx, dy, far = line.x - x, line.y - y, reach + line.half_width
        if dx * dx + dy * dy <= far * far:
            marks[near].near = j
            near += 1
        else:
            marks[j].stood = False
    return near


@inlined
def _look_at_lines(town: TownArrays, world: WorldArrays, k: int, frame: int, near: int) -> None:
    """Records a stop at pose k - 1, and the line that the front has passed since."""
    poses, half = world.poses, 0.5 * world.vehicles[0].length
    c, s = pm.cos(poses[k - 1, HEADING]), pm.sin(poses[k - 1, HEADING])
    before_x, before_y = poses[k - 1, X] + half * c, poses[k - 1, Y] + half * s
    cos, sin = pm.cos(poses[k, HEADING]), pm.sin(poses[k, HEADING])
    x, y = poses[k, X] + half * cos, poses[k, Y] + half * sin
    stands, turning = poses[k - 1, SPEED] < TRAFFIC_STANDING, poses[k, TURNING] != 0.0
    passed, best = NOBODY, math.inf
    for n in range(near):
        j = world.marks[n].near
        line = town.lines[j]
        before = (before_x - line.x) * line.cos + (before_y - line.y) * line.sin
        if before > 0.0:
            continue
        if stands and before >= -AT_LINE:
            if _is_on(line, before_x, before_y, c, s, poses[k - 1, HEIGHT]):
                world.marks[j].stood = True
        if turning or (x - line.x) * line.cos + (y - line.y) * line.sin <= 0.0:
            continue
        across = abs((y - line.y) * line.cos - (x - line.x) * line.sin)
        # on the border of two lanes the one with the nearer centre counts
        if across < best and _is_on(line, x, y, cos, sin, poses[k, HEIGHT]):
            passed, best = j, across
    if passed == NOBODY:
        return
    line, mark = town.lines[passed], world.marks[passed]
    station = town.lanes[line.lane].length
    if line.is_stop:
        if not mark.stood:
            _list(world, k, frame, STOP_SIGN, int(line.lane), station, int(line.signal))
    elif (
        colour_at(town, line.lane, (frame - 1) / FRAME_RATE) == Colour.RED
    ):  # when the frame began: so the car was let in
        _list(world, k, frame, RED_LIGHT, int(line.lane), station, int(line.signal))
    mark.stood = False


@inlined
def _is_on(line: StopLineRecord, x: float, y: float, cos: float, sin: float, height: float) -> bool:
    """Returns whether a pose is on the lane of a line, before or beyond it, and in the direction of the lane."""
    across = (y - line.y) * line.cos - (x - line.x) * line.sin
    facing = cos * line.cos + sin * line.sin
    return bool(facing > 0.5 and abs(across) <= line.half_width and abs(height - line.height) <= LEVEL_HEIGHT)


@inlined
def _forget(town: TownArrays, world: WorldArrays, k: int, near: int) -> None:
    """Forgets stops at lines that are far from the front."""
    poses, half = world.poses, 0.5 * world.vehicles[0].length
    x = poses[k, X] + half * pm.cos(poses[k, HEADING])
    y = poses[k, Y] + half * pm.sin(poses[k, HEADING])
    for n in range(near):
        j = world.marks[n].near
        dx, dy = x - town.lines[j].x, y - town.lines[j].y
        if dx * dx + dy * dy >= FORGET * FORGET:
            world.marks[j].stood = False


# --- Lanes ------------------------------------------------------------------------------------------------------------


@inlined
def _look_beside_lanes(town: TownArrays, world: WorldArrays, k: int, frame: int) -> None:
    """Lists a car off the road or against the traffic."""
    off_road, against = _state(town, world.poses, k)
    if off_road:
        _list_lasting(town, world, k, frame, OFF_ROAD)
    if against:
        _list_lasting(town, world, k, frame, WRONG_WAY)


@compiled
def _list_lasting(town: TownArrays, world: WorldArrays, k: int, frame: int, kind: int) -> None:
    """Lists a breach unless the previous one of its kind ended only a moment ago."""
    state = world.watch[0]
    last = state.last[kind]
    state.last[kind] = frame
    if frame - last > BREACH_PAUSE:
        _, _, lane, station = _survey(town, world.poses, k)
        _list(world, k, frame, kind, lane, station, int(NOBODY))


@inlined
def _state(town: TownArrays, poses: Array, k: int) -> tuple[bool, bool]:
    """Returns whether the car is off the road, and whether it is against the traffic.

    A place that is at most `OFF_ROAD_MARGIN` outside of a lane is no farther from its centre than half its width and
    twice `OFF_ROAD_MARGIN`. Cells list all lanes that close, except very wide ones.
    """
    if town.wide:
        outside, against, _, _ = _survey(town, poses, k)
        return outside > OFF_ROAD_MARGIN, against
    x, y = poses[k, X], poses[k, Y]
    column, row = (x - town.origin[0]) / LOOKUP_CELL, (y - town.origin[1]) / LOOKUP_CELL
    if not (0.0 <= column < town.cells.shape[1] and 0.0 <= row < town.cells.shape[0]):
        return True, False
    i, j = int(row), int(column)
    off_road, against = True, False
    for e in range(town.cells[i, j, 0], town.cells[i, j, 1]):
        entry = town.entries[e]
        lane = town.lanes[entry.lane]
        at, share, gap = closest_segment(town.points, entry.first, entry.last, x, y)
        out, station, _ = _outside(town.points, lane, at, share, gap, poses, k)
        off_road = off_road and out > OFF_ROAD_MARGIN
        if out <= 0.0:
            if _is_with(town.points, lane, at, station, poses[k, HEADING]):
                return False, False
            against = True
    return off_road, against


@inlined
def _outside(
    points: Array, lane: LaneRecord, at: int, share: float, gap: float, poses: Array, k: int
) -> tuple[float, float, bool]:
    """Returns a pose's distance outside of a lane (negative inside, inf at another height), and its station [m]."""
    station, lateral = coordinates(points, lane, at, share, gap, poses[k, X], poses[k, Y])
    if abs(value_near(points, lane, at, 4, station) - poses[k, HEIGHT]) > LEVEL_HEIGHT:
        return math.inf, station, False
    side = abs(lateral) - 0.5 * value_near(points, lane, at, 5, station)
    return max(side, -station, station - points[lane.last, 2]), station, True


@inlined
def _is_with(points: Array, lane: LaneRecord, at: int, station: float, heading: float) -> bool:
    """Returns whether a heading on a lane is not against it; in junctions none is."""
    return bool(lane.junction >= 0 or pm.cos(heading - value_near(points, lane, at, 3, station)) > AGAINST)


@compiled
def _survey(town: TownArrays, poses: Array, k: int) -> tuple[float, bool, int, float]:
    """Measures a pose against all lanes.

    Returns:
        Distance to the nearest lane's area (negative inside), whether it is on lanes and all of them run the other
        way, the nearest lane (-1: none nearby), and the station on it [m].
    """
    x, y = poses[k, X], poses[k, Y]
    outside, nearest, rank, station = math.inf, NOBODY, 0, 0.0
    with_it, against = False, False
    for number in range(len(town.lanes)):
        lane = town.lanes[number]
        if x < lane.left_edge - NEARBY or x > lane.right_edge + NEARBY:
            continue
        if y < lane.low_edge - NEARBY or y > lane.high_edge + NEARBY:
            continue
        at, share, gap = closest_segment(town.points, lane.first, lane.last - 1, x, y)
        out, place, is_level = _outside(town.points, lane, at, share, gap, poses, k)
        if is_level and (out < outside or (out == outside and lane.rank < rank)):
            outside, nearest, rank, station = out, number, lane.rank, place
        if out <= 0.0:
            if _is_with(town.points, lane, at, place, poses[k, HEADING]):
                with_it = True
            else:
                against = True
    return outside, against and not with_it, nearest, station


# --- Infractions ------------------------------------------------------------------------------------------------------
# Infractions of the ego: red lights, stop signs, leaving the road, driving against the traffic.
#
# They follow from the trajectory alone, regardless of the driver, and are counted and listed by `sim.traffic_rules`;
# collisions, the fifth kind, are detected in `sim.collisions`. This module reads the lists.


class WorldEventKind(enum.StrEnum):
    """Kind of an event of the ego."""

    HAZARD_STOP = "hazard_stop"
    HAZARD_END = "hazard_end"
    COLLISION = "collision"
    RED_LIGHT = "red_light"
    """The front of the car passes the end of its lane while the lane's light is red."""
    STOP_SIGN = "stop_sign"
    """It passes the end of a lane with a stop sign and has not stood there with its front within `AT_LINE`."""
    OFF_ROAD = "off_road"
    """Its centre is farther than `OFF_ROAD_MARGIN` outside of every lane's area, and it is not turning round."""
    WRONG_WAY = "wrong_way"
    """Its centre is on lanes that all run against it, outside junctions, and it is not turning round."""


INFRACTION_KINDS = (
    WorldEventKind.COLLISION,
    WorldEventKind.RED_LIGHT,
    WorldEventKind.STOP_SIGN,
    WorldEventKind.OFF_ROAD,
    WorldEventKind.WRONG_WAY,
)
"""Kinds of infractions, in the order of `codes.Breach`; their data names place and counterpart."""

_RULES = frozenset(INFRACTION_KINDS) - {WorldEventKind.COLLISION}
_SIGNALS = {WorldEventKind.RED_LIGHT: ObjectClass.TRAFFIC_LIGHT, WorldEventKind.STOP_SIGN: ObjectClass.TRAFFIC_SIGN}
"""Class of the signal that is disregarded."""


@dataclass(frozen=True, kw_only=True)
class WorldEvent:
    """Something that happened to the car, at a frame."""

    frame: int
    kind: WorldEventKind
    data: Mapping[str, object] = field(default_factory=dict)


class WorldEventLog(CachedViews):
    """Events of the ego, read from the lists that the compiled loops keep of them."""

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_counts_of", "_own_counts")

    _counts_of: WorldArrays | None = None

    def __init__(self, network: TownNetwork, holder: ArrayHolder) -> None:
        """Reads the lists in `holder.arrays`, which may be replaced by others with more room."""
        self._network, self._town, self._holder = network, network.town, holder
        self._events: list[WorldEvent] = []

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of infractions so far (5,), in the order of `INFRACTION_KINDS`; a view."""
        arrays = self._holder.arrays
        if arrays is not self._counts_of:
            self._counts_of, self._own_counts = arrays, plain(arrays.watch)["counts"][0]
        counts: NDArray[np.int64] = self._own_counts
        return counts

    @property
    def infractions(self) -> Mapping[WorldEventKind, int]:
        """Number of infractions so far by kind, including collisions caused by others."""
        return dict(zip(INFRACTION_KINDS, self.counts.tolist(), strict=True))

    def note(self, events: int, breaches: int) -> None:
        """Records a number of events and infractions of the last call of `sim.step.step`."""
        arrays = self._holder.arrays
        for event in arrays.events[:events]:
            self._note_event(event)
        for breach in arrays.breaches[:breaches]:
            self._note_breach(breach)

    def take(self) -> list[WorldEvent]:
        """Returns the recorded events in the order of their frames, and forgets them."""
        if not self._events:
            return []
        events, self._events = sorted(self._events, key=lambda event: (event.frame, event.kind in _RULES)), []
        return events

    def _note_event(self, event: EventRecord) -> None:
        """Records a hazard stop or a collision."""
        frame, kind = int(event.frame), ObjectClass(int(event.kind))
        if event.code == EventCode.HAZARD_STOP:
            self._add(WorldEventKind.HAZARD_STOP, frame, reason=kind.label, distance=round(float(event.value), 2))
        elif event.code == EventCode.HAZARD_END:
            seconds = round(float(event.value) / FRAME_RATE, 2)
            self._add(WorldEventKind.HAZARD_END, frame, reason=kind.label, seconds=seconds)
        else:
            self._add(
                WorldEventKind.COLLISION,
                frame,
                **_place(int(event.lane), float(event.station), float(event.x), float(event.y)),
                key=int(event.key),
                other=kind.label,
                own_fault=bool(event.own),
                speed=round(float(event.value), 2),
            )

    def _note_breach(self, breach: BreachRecord) -> None:
        """Records an infraction, with the light or sign, or the nearest lane."""
        kind, lane, station = INFRACTION_KINDS[breach.kind], int(breach.lane), float(breach.station)
        x, y = float(breach.x), float(breach.y)
        if lane < 0:
            place = np.array([x, y])
            index = self._network.get_closest_lane_index(place, height=float(breach.height))
            lane = self._network.lane_id(index)
            station = float(self._network.get_lane(index).local_coordinates(place)[0])
        station = min(max(station, 0.0), self._town.lanes[lane].length)
        key, other = (int(breach.signal), _SIGNALS[kind].label) if kind in _SIGNALS else (None, None)
        self._add(kind, int(breach.frame), **_place(lane, station, x, y), key=key, other=other)

    def _add(self, kind: WorldEventKind, frame: int, **data: object) -> None:
        self._events.append(WorldEvent(frame=frame, kind=kind, data=data))


def _place(lane: int, station: float, x: float, y: float) -> dict[str, object]:
    return {"lane": lane, "station": round(station, 2), "x": round(x, 3), "y": round(y, 3)}
