"""What the names of streets keep clear of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.world.graphics.arrows import ARROW_LENGTH
from dorothie_gym.world.graphics.axes import Axis
from dorothie_gym.world.graphics.plan import Plan
from dorothie_gym.world.graphics.shapes import sample, side_line
from dorothie_gym.world.town.model import Array, Lane

LEVELS = 4
"""All obstacles; all but arrows; junctions' edges may be touched, too; nothing but what no name may ever touch."""

_NARROW = 0.4  # of a junction's width still counts on the third level
_OTHER_ROAD = 1.5  # [m] between the heights of two roads that cross
_CELL = 8  # nearest circles that are looked at


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Circles (n, 3) [px] by kind: x, y, radius.

    Attributes:
        bridges: over and under which no name of the other road may go; with heights (n, 4), the last one in metres.
        levels: what counts on each level beside the bridges.
    """

    bridges: Array
    levels: tuple[Array, ...]

    @classmethod
    def of(cls, plan: Plan, scale: float, origin: Array, fixed: Array) -> Obstacles:
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

        bridges = circles((lanes[p.lane], p.start, p.end) for p in plan.stretches)
        tunnels = circles((lanes[p.lane], p.start, p.end) for p in plan.stretches if p.level < 0)[:, :3]
        junctions = circles(((lane, 0.0, lane.length) for lane in lanes if lane.in_junction), 0.9)[:, :3]
        arrows = circles(_arrow_stretches(plan), 0.6)[:, :3]
        crossings = [_around((crossing.outline - origin) * scale) for crossing in plan.town.crosswalks]
        paint = np.concatenate((arrows, np.array(crossings).reshape(-1, 3)))
        return cls(
            bridges,
            (
                np.concatenate((fixed, tunnels, junctions, paint)),
                np.concatenate((fixed, tunnels, junctions)),
                np.concatenate((fixed, tunnels, junctions * np.array([1.0, 1.0, _NARROW]))),
                fixed,
            ),
        )

    def clearances(self, axis: Axis) -> Array:
        """Distances (LEVELS, n) [px] from the points of an axis to the nearest obstacle of each level."""
        bridges = _clearance(axis, self.bridges)
        return np.stack([np.minimum(bridges, _clearance(axis, level)) for level in self.levels])


def _clearance(axis: Axis, circles: Array) -> Array:
    """Distance (n,) [px] to circles (m, 3), or to those (m, 4) of roads at another height."""
    if not len(circles):
        return np.full(len(axis.line), np.inf)
    found = cKDTree(circles[:, :2]).query(axis.line, k=min(_CELL, len(circles)))
    distance, index = (np.reshape(row, (len(axis.line), -1)) for row in found)
    free = distance - circles[index, 2]
    if circles.shape[1] > 3:
        free = np.where(np.abs(circles[index, 3] - axis.height[:, None]) > _OTHER_ROAD, free, np.inf)
    return np.asarray(free.min(axis=1))


def _arrow_stretches(plan: Plan) -> Sequence[tuple[Lane, float, float]]:
    """Stretches of lanes that arrows and stop lines take."""
    lanes = plan.town.lanes
    rows = [
        (lanes[a.lane], a.station, min(a.station + ARROW_LENGTH, lanes[a.lane].length))
        for a in (plan.arrows if plan.detail.arrows else ())
    ]
    return rows + [(lanes[k], max(0.0, plan.stops.get(k, 0.0) - 1.0), lanes[k].length) for k in plan.ruled]


def _around(outline: Array) -> Array:
    """A circle (3,) around most of a crossing: where it lies across a road, that road's width is enough."""
    centre = outline.mean(axis=0)
    return np.array([*centre, 0.8 * np.hypot(*(outline - centre).T).max()])
