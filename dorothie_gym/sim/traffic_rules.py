"""Detection of infractions on a trajectory: lines passed, stretches off the road or against the traffic.

Most stretches are settled by the lines and lanes near the car: a car whose middle is on a lane of its direction, or in
a junction, is neither off the road nor against the traffic, and a cell lists the lanes that a place may be on. The
rules themselves are described in `sim.infractions`.
"""

from __future__ import annotations

import enum
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.compilation.by_reference import by_reference
from dorothie_gym.maps.model import LEVEL_HEIGHT, Array
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.network.grid import CELL_REACH, SLACK
from dorothie_gym.sim.network.lane_lookup import LOOKUP_CELL, closest_segment, coordinates, value_near
from dorothie_gym.sim.state.codes import NOBODY
from dorothie_gym.sim.state.records import (
    POSE,
    CellEntryRecord,
    FindingRecord,
    LaneRecord,
    LineMarkRecord,
    RecordArray,
    StopLineRecord,
)
from dorothie_gym.sim.traffic.parameters import AT_LINE, TRAFFIC_STANDING

OFF_ROAD_MARGIN = 0.5
"""Distance of the car's middle outside of all lanes, connectors included, from which on it is off the road [m]."""

AGAINST = math.cos(math.radians(120.0))
"""Cosine of the angle to a lane from which on the car drives against it (CARLA's scenario runner, WrongLaneTest)."""

NEARBY = 10.0
"""Range around the car for the nearest lane [m]: more than half of any lane's width."""

BREACH_PAUSE = FRAME_RATE
"""Time without being off the road, or against the traffic, after which it counts as a new breach [frames]."""

FORGET = 12.0
"""Distance from a stop line at which a stand there is forgotten [m]."""

WIDE_LANE = 2.0 * (CELL_REACH - 2.0 * OFF_ROAD_MARGIN - SLACK)
"""Width up to which cells list all lanes that a place is within `OFF_ROAD_MARGIN` of [m]."""

X, Y, HEADING, SPEED, HEIGHT, TURNING = range(len(POSE))
"""Columns of poses."""


class FindingKind(enum.IntEnum):
    """Kind of a finding."""

    LIGHT = 0
    """A line with a light has been passed; its colour decides whether that is a breach."""
    STOP_SIGN = 1
    OFF_ROAD = 2
    WRONG_WAY = 3


@by_reference
class WatchArrays(NamedTuple):
    """Arrays for watching a car.

    Attributes:
        points: as in `TownArrays`; so `lanes`, `origin`, `cells` and `entries`.
        lanes: lanes of the town.
        origin: (2,).
        cells: (rows, columns, 2).
        entries: entries of the cells.
        lines: (m,) lines of the town.
        marks: (m,) marks of the car; written.
        last: (2,) last frames off the road, and against the traffic; written.
        found: findings, room for three a pose; written.
    """

    points: Array
    lanes: RecordArray[LaneRecord]
    origin: Array
    cells: NDArray[np.int32]
    entries: RecordArray[CellEntryRecord]
    lines: RecordArray[StopLineRecord]
    marks: RecordArray[LineMarkRecord]
    last: NDArray[np.int64]
    found: RecordArray[FindingRecord]


@compiled
def watch(arrays: WatchArrays, poses: Array, frame: int, length: float, wide: bool) -> int:
    """Watches a stretch of a trajectory.

    Args:
        arrays: of the town and of the car.
        poses: at successive frames, the first being the last one of the stretch before (n + 1, 6).
        frame: of the first pose.
        length: of the car [m].
        wide: whether some lane of the town is wider than `WIDE_LANE`.

    Returns:
        Number of findings, in the order in which they happened.
    """
    count = 0
    near = _lines_near(arrays, poses, length)
    for k in range(1, len(poses)):
        if near > 0:
            count = _at_lines(arrays, poses, k, length, near, count)
        if poses[k, TURNING] == 0.0:
            count = _beside_lanes(arrays, poses, k, frame + k, wide, count)
    if near > 0:
        _forget(arrays, poses, length, near)
    return count


# --- Lines ------------------------------------------------------------------------------------------------------------


@inlined
def _lines_near(arrays: WatchArrays, poses: Array, length: float) -> int:
    """Lists the lines that may have been passed, and forgets stands at all others; returns the number of lines."""
    lines, marks = arrays.lines, arrays.marks
    x, y, extent2 = poses[0, X], poses[0, Y], 0.0
    for k in range(1, len(poses)):
        dx, dy = poses[k, X] - x, poses[k, Y] - y
        extent2 = max(extent2, dx * dx + dy * dy)
    # the front is no farther beyond a passed line than its way since the pose before
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
def _at_lines(arrays: WatchArrays, poses: Array, k: int, length: float, near: int, count: int) -> int:
    """Notes a stand at pose k - 1, and the line that the front has passed since; returns the number of findings."""
    c, s = math.cos(poses[k - 1, HEADING]), math.sin(poses[k - 1, HEADING])
    before_x, before_y = poses[k - 1, X] + 0.5 * length * c, poses[k - 1, Y] + 0.5 * length * s
    cos, sin = math.cos(poses[k, HEADING]), math.sin(poses[k, HEADING])
    x, y = poses[k, X] + 0.5 * length * cos, poses[k, Y] + 0.5 * length * sin
    stands, turning = poses[k - 1, SPEED] < TRAFFIC_STANDING, poses[k, TURNING] != 0.0
    passed, best = NOBODY, math.inf
    for n in range(near):
        j = arrays.marks[n].near
        line = arrays.lines[j]
        before = (before_x - line.x) * line.cos + (before_y - line.y) * line.sin
        if before > 0.0:
            continue
        if stands and before >= -AT_LINE:
            if _is_on(line, before_x, before_y, c, s, poses[k - 1, HEIGHT]):
                arrays.marks[j].stood = True
        if turning or (x - line.x) * line.cos + (y - line.y) * line.sin <= 0.0:
            continue
        across = abs((y - line.y) * line.cos - (x - line.x) * line.sin)
        # on the border of two lanes the one with the nearer middle counts
        if across < best and _is_on(line, x, y, cos, sin, poses[k, HEIGHT]):
            passed, best = j, across
    if passed == NOBODY:
        return count
    mark, is_stop = arrays.marks[passed], arrays.lines[passed].is_stop
    if not is_stop or not mark.stood:
        kind = FindingKind.STOP_SIGN if is_stop else FindingKind.LIGHT
        _note(arrays.found[count], k, kind, passed, 0.0)
        count += 1
    mark.stood = False
    return count


@inlined
def _is_on(line: StopLineRecord, x: float, y: float, cos: float, sin: float, height: float) -> bool:
    """Returns whether a place is on the lane of a line, before or behind it, and heads its way."""
    across = (y - line.y) * line.cos - (x - line.x) * line.sin
    facing = cos * line.cos + sin * line.sin
    return bool(facing > 0.5 and abs(across) <= line.half_width and abs(height - line.height) <= LEVEL_HEIGHT)


@inlined
def _forget(arrays: WatchArrays, poses: Array, length: float, near: int) -> None:
    """Forgets stands at lines that the front is far from."""
    k = len(poses) - 1
    x = poses[k, X] + 0.5 * length * math.cos(poses[k, HEADING])
    y = poses[k, Y] + 0.5 * length * math.sin(poses[k, HEADING])
    for n in range(near):
        j = arrays.marks[n].near
        dx, dy = x - arrays.lines[j].x, y - arrays.lines[j].y
        if dx * dx + dy * dy >= FORGET * FORGET:
            arrays.marks[j].stood = False


@inlined
def _note(finding: FindingRecord, k: int, kind: int, number: int, station: float) -> None:
    finding.pose, finding.kind, finding.number, finding.station = k, kind, number, station


# --- Lanes ------------------------------------------------------------------------------------------------------------


@inlined
def _beside_lanes(arrays: WatchArrays, poses: Array, k: int, frame: int, wide: bool, count: int) -> int:
    """Notes a car off the road or against the traffic; returns the number of findings."""
    off_road, against = _state(arrays, poses, k, wide)
    if off_road:
        count = _log_breach(arrays, poses, k, frame, FindingKind.OFF_ROAD, count)
    if against:
        count = _log_breach(arrays, poses, k, frame, FindingKind.WRONG_WAY, count)
    return count


@compiled
def _log_breach(arrays: WatchArrays, poses: Array, k: int, frame: int, kind: int, count: int) -> int:
    """Logs a breach unless the previous one of its kind ended only a moment ago."""
    which = kind - FindingKind.OFF_ROAD
    last = arrays.last[which]
    arrays.last[which] = frame
    if frame - last <= BREACH_PAUSE:
        return count
    _, _, lane, station = _survey(arrays, poses, k)
    _note(arrays.found[count], k, kind, lane, station)
    return count + 1


@inlined
def _state(arrays: WatchArrays, poses: Array, k: int, wide: bool) -> tuple[bool, bool]:
    """Returns whether the car is off the road, and whether it is against the traffic.

    A place that is at most `OFF_ROAD_MARGIN` outside of a lane is no farther from its middle than half its width and
    twice `OFF_ROAD_MARGIN`. Cells list all lanes that close, except very wide ones.
    """
    if wide:
        outside, against, _, _ = _survey(arrays, poses, k)
        return outside > OFF_ROAD_MARGIN, against
    x, y = poses[k, X], poses[k, Y]
    column, row = (x - arrays.origin[0]) / LOOKUP_CELL, (y - arrays.origin[1]) / LOOKUP_CELL
    if not (0.0 <= column < arrays.cells.shape[1] and 0.0 <= row < arrays.cells.shape[0]):
        return True, False
    i, j = int(row), int(column)
    off_road, against = True, False
    for e in range(arrays.cells[i, j, 0], arrays.cells[i, j, 1]):
        entry = arrays.entries[e]
        lane = arrays.lanes[entry.lane]
        at, share, gap = closest_segment(arrays.points, entry.first, entry.last, x, y)
        out, station, _ = _outside(arrays.points, lane, at, share, gap, poses, k)
        off_road = off_road and out > OFF_ROAD_MARGIN
        if out <= 0.0:
            if _is_with(arrays.points, lane, at, station, poses[k, HEADING]):
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
    return bool(lane.junction >= 0 or math.cos(heading - value_near(points, lane, at, 3, station)) > AGAINST)


@compiled
def _survey(arrays: WatchArrays, poses: Array, k: int) -> tuple[float, bool, int, float]:
    """Measures a pose against all lanes.

    Returns:
        Distance to the nearest lane's area (negative inside), whether it is on lanes and all of them run the other
        way, the nearest lane (-1: none nearby), and the station on it [m].
    """
    x, y = poses[k, X], poses[k, Y]
    outside, nearest, rank, station = math.inf, NOBODY, 0, 0.0
    with_it, against = False, False
    for number in range(len(arrays.lanes)):
        lane = arrays.lanes[number]
        if x < lane.left_edge - NEARBY or x > lane.right_edge + NEARBY:
            continue
        if y < lane.low_edge - NEARBY or y > lane.high_edge + NEARBY:
            continue
        at, share, gap = closest_segment(arrays.points, lane.first, lane.last - 1, x, y)
        out, place, is_level = _outside(arrays.points, lane, at, share, gap, poses, k)
        if is_level and (out < outside or (out == outside and lane.rank < rank)):
            outside, nearest, rank, station = out, number, lane.rank, place
        if out <= 0.0:
            if _is_with(arrays.points, lane, at, place, poses[k, HEADING]):
                with_it = True
            else:
                against = True
    return outside, against and not with_it, nearest, station
