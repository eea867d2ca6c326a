"""Which lane runs the other way beside a place on a lane: where a U-turn leads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dorothie_gym.world.town.model import Array, LinkType, Town

MAX_GAP = 13.0
"""Largest distance between the lanes' centre lines [m]: a median is crossed, a park is not."""

MAX_HEIGHT = 1.0
"""Largest difference of height [m]."""

MIN_OPPOSITION = np.radians(150.0)
"""Smallest difference of direction [rad]."""


@dataclass(frozen=True, kw_only=True)
class Oncoming:
    """The place on the oncoming lane that lies across from a place on a lane."""

    lane: int
    station: float
    gap: float


class OncomingLanes:
    """Answers, for places on the lanes of a town, which lane runs the other way to their left."""

    def __init__(self, town: Town) -> None:
        self._town = town
        owners, points = [], []
        for lane in town.lanes:
            if lane.in_junction:
                continue
            for station in np.linspace(0.0, lane.length, max(2, int(lane.length / 4.0) + 1)):
                points.append(lane.position(float(station)))
                owners.append(lane.id)
        places = np.array(points).reshape(-1, 2)
        order = np.argsort(places[:, 0], kind="stable")
        self._owners, self._places = np.array(owners, dtype=np.intp)[order], places[order]

    def at(self, lane_id: int, station: float) -> Oncoming | None:
        """The oncoming place, or None: in a junction, from a lane that is not the leftmost, or with nothing there."""
        lane = self._town.lanes[lane_id]
        if lane.in_junction or self._town.neighbour(lane_id, LinkType.LANE_CHANGE_LEFT) is not None:
            return None
        position, heading = lane.position(station), lane.heading_at(station)
        best: Oncoming | None = None
        for other_id in self._near(position, MAX_GAP + 3.0):
            other = self._town.lanes[other_id]
            there, _ = other.project(position)
            point = other.position(there)
            turn = abs((other.heading_at(there) - heading + np.pi) % (2 * np.pi) - np.pi)
            dx, dy = float(point[0] - position[0]), float(point[1] - position[1])
            across = -dx * np.sin(heading) + dy * np.cos(heading)  # positive right
            along = dx * np.cos(heading) + dy * np.sin(heading)
            if turn < MIN_OPPOSITION or not -MAX_GAP <= across < -1.0 or abs(along) > 3.0:
                continue
            if abs(other.height_at(there) - lane.height_at(station)) > MAX_HEIGHT:
                continue
            if best is None or -across < best.gap:
                best = Oncoming(lane=other_id, station=there, gap=float(-across))
        return best

    def _near(self, position: Array, radius: float) -> list[int]:
        """Lanes of which a point is no further away [m], in order."""
        # a search in one direction is enough, and scipy.spatial would take longer to import than all questions together
        x = self._places[:, 0]
        band = slice(*np.searchsorted(x, (position[0] - radius, position[0] + radius)))
        east, south = (self._places[band] - position).T
        near = self._owners[band][east * east + south * south <= radius * radius]
        return [int(lane) for lane in np.unique(near)]


@lru_cache(maxsize=16)
def oncoming_lanes(town: Town) -> OncomingLanes:
    """The table of a town, made once."""
    return OncomingLanes(town)
