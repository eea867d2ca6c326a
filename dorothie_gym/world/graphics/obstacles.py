"""What the names of streets keep clear of."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics.arrows import ARROW_LENGTH
from dorothie_gym.world.graphics.axes import Axis
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.graphics.pockets import pocket_places
from dorothie_gym.world.graphics.shapes import sample, side_line
from dorothie_gym.world.town.model import Array, Lane


class Level(enum.IntEnum):
    """What a name has to keep clear of: less and less, but always of bridges, pins and signs."""

    ALL = 0
    ARROWS_HIDDEN = 1
    JUNCTIONS_TOUCHED = 2
    JUNCTIONS_CROSSED = 3
    FIXED_ALONE = 4
    OFF_ROAD = 5


_NARROW = 0.4  # of a junction's width still counts on the third level
_OTHER_ROAD = 1.5  # [m] between the heights of two roads that cross
_ISLAND = 2.0  # [m], half the width of the hatching before a turn lane
_CELL = 8  # nearest circles that are looked at


class Obstacles:
    """Circles [px] that names keep clear of, by kind and by level."""

    def __init__(self, plan: Plan, scale: float, origin: Array, fixed: Array) -> None:
        """Finds them on a plan; `fixed` are circles (n, 3) [px] that count on all levels."""
        lanes = plan.town.lanes

        def circles(rows: Iterable[tuple[Lane, float, float]], widen: float = 1.0) -> Array:
            out = [np.zeros((0, 4))]
            for lane, start, end in rows:
                s = sample(lane, start, end, 2.0)
                points = (side_line(lane, s, 0.0) - origin) * scale
                radius = np.interp(s, lane.stations, lane.widths) / 2.0 * scale * widen
                out.append(np.column_stack((points, radius, np.interp(s, lane.stations, lane.points[:, 2]))))
            return np.concatenate(out)

        # Over and under bridges no name of the other road may go: their circles have heights, (n, 4).
        self._bridges = _Circles(circles((lanes[p.lane], p.start, p.end) for p in plan.stretches))
        tunnels = circles((lanes[p.lane], p.start, p.end) for p in plan.stretches if p.level < 0)[:, :3]
        junctions = circles(((lane, 0.0, lane.length) for lane in lanes if lane.in_junction), 0.9)[:, :3]
        islands = (pocket_places(plan.town, plan.pockets).reshape(-1, 2) - origin) * scale
        arrows = np.concatenate(
            (
                circles(_arrow_stretches(plan), 0.6)[:, :3],
                np.column_stack((islands, np.full(len(islands), _ISLAND * scale))),
            )
        )
        bars = circles(_stop_stretches(plan), 0.6)[:, :3]
        crossings = [_around((crossing.outline - origin) * scale) for crossing in plan.town.crosswalks]
        paint = np.concatenate((fixed, tunnels, bars, np.array(crossings).reshape(-1, 3)))
        self._levels = {
            Level.ALL: (paint, arrows, junctions),
            Level.ARROWS_HIDDEN: (paint, junctions),
            Level.JUNCTIONS_TOUCHED: (paint, junctions * np.array([1.0, 1.0, _NARROW])),
            Level.JUNCTIONS_CROSSED: (paint, arrows),
            Level.FIXED_ALONE: (fixed,),
            Level.OFF_ROAD: (fixed, circles((lane, 0.0, lane.length) for lane in lanes)[:, :3]),
        }
        self._circles: dict[Level, _Circles] = {}

    def clearance(self, axis: Axis, level: Level) -> Array:
        """Distance (n,) [px] from the points of an axis to the nearest obstacle of a level."""
        if level not in axis.clear:
            if level not in self._circles:
                self._circles[level] = _Circles(np.concatenate(self._levels[level]))
            free = self._circles[level].clearance(axis)
            axis.clear[level] = free if axis.beside else np.minimum(free, self._bridges.clearance(axis))
        return axis.clear[level]


class _Circles:
    """Circles (n, 3) [px], or those (n, 4) of roads whose heights matter, as a tree."""

    def __init__(self, circles: Array) -> None:
        self._rows = circles
        self._tree = cKDTree(circles[:, :2]) if len(circles) else None

    def clearance(self, axis: Axis) -> Array:
        """Distance (n,) [px] to the nearest circle that is in the way."""
        if self._tree is None:
            return np.full(len(axis.line), np.inf)
        found = self._tree.query(axis.line, k=min(_CELL, len(self._rows)))
        distance, index = (np.reshape(row, (len(axis.line), -1)) for row in found)
        free = distance - self._rows[index, 2]
        if self._rows.shape[1] > 3:
            free = np.where(np.abs(self._rows[index, 3] - axis.height[:, None]) > _OTHER_ROAD, free, np.inf)
        return np.asarray(free.min(axis=1))


def _arrow_stretches(plan: Plan) -> Iterator[tuple[Lane, float, float]]:
    """Stretches of lanes that arrows take."""
    for arrow in plan.arrows if plan.detail.arrows else ():
        lane = plan.town.lanes[arrow.lane]
        yield lane, arrow.station, min(arrow.station + ARROW_LENGTH, lane.length)


def _stop_stretches(plan: Plan) -> Iterator[tuple[Lane, float, float]]:
    """Stretches of lanes that stop lines take."""
    for number in plan.ruled:
        lane = plan.town.lanes[number]
        yield lane, max(0.0, plan.stops.get(number, 0.0) - 1.0), lane.length


def _around(outline: Array) -> Array:
    """A circle (3,) around most of a crossing: where it lies across a road, that road's width is enough."""
    centre = outline.mean(axis=0)
    return np.array([*centre, 0.8 * np.hypot(*(outline - centre).T).max()])
