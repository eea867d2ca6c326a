"""Nearest places on the lanes of a town, for clicks on the map and for the headings of vehicles in sight."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.spatial import cKDTree

from dorothie_gym.session.spaces.actions import LanePosition

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

SPACING: Final = 1.0
"""Distance between the sampled places of a lane [m]: places are whole metres."""

FARTHEST: Final = 60.0
"""Largest distance between a click and the lane that it means [m]: the far end of a block's garden."""


class LaneLookup:
    """Nearest places on the lanes of a town outside junctions, and on all lanes.

    Attributes:
        town: the map.

    Args:
        town: the map.
    """

    def __init__(self, town: Town) -> None:
        self.town = town
        self._lanes = town.lanes
        rows, points, headings = [], [], []
        for lane in town.lanes:
            for station in np.arange(0.0, lane.length, SPACING).tolist():
                rows.append((lane.id, int(station), lane.in_junction))
                points.append(lane.position(station))
                headings.append(lane.heading_at(station))
        self._rows, self._headings = np.array(rows), np.array(headings)
        self._all = cKDTree(np.array(points))
        self._open = np.flatnonzero(self._rows[:, 2] == 0)
        self._outside = cKDTree(np.array(points)[self._open])

    def place(self, x: float, y: float) -> LanePosition | None:
        """Returns the nearest place on a lane outside junctions; None beyond `FARTHEST` of a point (x, y) [m]."""
        distance, found = self._outside.query((x, y), distance_upper_bound=FARTHEST)
        if not math.isfinite(distance):
            return None
        lane, metres, _ = self._rows[self._open[found]].tolist()
        return LanePosition(lane=lane, metres=metres)

    def position(self, lane: int, station: float) -> tuple[float, float]:
        """Returns the point (x, y) [m] at a distance along a lane [m]."""
        x, y = self._lanes[lane].position(station).tolist()
        return x, y

    def heading(self, x: float, y: float) -> float:
        """Returns the direction of the lane nearest to a point (x, y) [m] in [rad]."""
        return float(self._headings[self._all.query((x, y))[1]])


@lru_cache(maxsize=8)
def lane_lookup(town: Town) -> LaneLookup:
    """Returns the lookup of a town, built once."""
    return LaneLookup(town)
