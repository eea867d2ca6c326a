"""Measurements along the centre line of a lane, with the results of `maps.model.Lane` to the last bit (compiled)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.maps.model import Array
from dorothie_gym.maps.polyline import HEADING, STATION, X, Y
from dorothie_gym.sim.network.lane_lookup import closest_segment, stretch_near
from dorothie_gym.sim.state.town_records import LaneRecord
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.sim.state.town_arrays import TownArrays


@inlined
def segment_at(points: Array, lane: LaneRecord, station: float) -> int:
    """Returns the row of the point of a lane at or before a station [m]."""
    low, high = int(lane.first), int(lane.last) + 1
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle, STATION] <= station:
            low = middle
        else:
            high = middle
    return low


@inlined
def interpolated(points: Array, lane: LaneRecord, segment: int, column: int, station: float) -> float:
    """Interpolates a column of a lane's points as `np.interp`; `segment` is the row at or before the station [m]."""
    start = points[segment, STATION]
    if segment == lane.last or station <= start:
        return float(points[segment, column])
    slope = (points[segment + 1, column] - points[segment, column]) / (points[segment + 1, STATION] - start)
    return float(slope * (station - start) + points[segment, column])


@compiled
def value_on(points: Array, lane: LaneRecord, column: int, station: float) -> float:
    """Interpolates a column of a lane's points as `np.interp`, as `Lane.heading_at` and its like."""
    return interpolated(points, lane, segment_at(points, lane, station), column, station)


@compiled
def position_on(points: Array, lane: LaneRecord, station: float) -> tuple[float, float]:
    """Returns a point of the centre line [m], straight beyond its ends, as `Lane.position`."""
    s = min(max(station, 0.0), points[lane.last, STATION])
    segment, over = segment_at(points, lane, s), station - s
    x, y = interpolated(points, lane, segment, X, s), interpolated(points, lane, segment, Y, s)
    if over == 0.0:
        return x, y
    heading = interpolated(points, lane, segment, HEADING, s)
    return x + over * pm.cos(heading), y + over * pm.sin(heading)


@compiled
def project_on(town: TownArrays, number: int, x: float, y: float) -> tuple[float, float]:
    """Returns station and lateral distance [m] of the closest point of a lane, as `Lane.project`."""
    points = town.points
    first, last = stretch_near(town, number, x, y)
    at, share, _ = closest_segment(points, first, last, x, y)
    dx, dy = points[at + 1, X] - points[at, X], points[at + 1, Y] - points[at, Y]
    aside_x, aside_y = x - (points[at, X] + share * dx), y - (points[at, Y] + share * dy)
    distance = float(pm.hypot(aside_x, aside_y))
    station = points[at, STATION] + share * (points[at + 1, STATION] - points[at, STATION])
    return station, distance if dx * aside_y - dy * aside_x >= 0.0 else -distance
