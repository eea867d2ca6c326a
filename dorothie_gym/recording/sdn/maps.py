"""Map of an SDN session, if available: lanes by OpenDRIVE numbers, and angles of turns by road."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Final

import numpy as np

from dorothie_gym.maps import NO_STREET, Town
from dorothie_gym.recording.trajectory import NO_LANE

FAR: Final = 10.0
"""Largest distance of a position from the lane that it is assigned to [m]."""


@dataclass(frozen=True)
class LanePosition:
    """Position in the town: lane (-1: none), distance along it [m], street (-1: none)."""

    lane: int = NO_LANE
    station: float = 0.0
    street: int = NO_STREET


class SdnMap:
    """Lookup of positions in a town that may be unknown.

    Args:
        town: the town, or None: lookups then find nothing.
    """

    def __init__(self, town: Town | None) -> None:
        self.town = town
        self._by_ids: dict[tuple[int, int], list[int]] = defaultdict(list)
        for lane in town.lanes if town is not None else ():
            self._by_ids[lane.road_id, lane.lane_id].append(lane.id)

    def locate(self, x: float, y: float, road: int | None = None, lane: int | None = None) -> LanePosition:
        """Returns the position closest to (x, y) [m], on lanes with the given numbers if the town has them."""
        if self.town is None:
            return LanePosition()
        known = self._by_ids.get((road, lane)) if road is not None and lane is not None else None
        position = np.array([x, y])
        found = [(*self.town.lanes[k].project(position), k) for k in known or range(len(self.town.lanes))]
        station, lateral, number = min(found, key=lambda item: (abs(item[1]), item[2]))
        if known is None and abs(lateral) > FAR:
            return LanePosition()
        return LanePosition(number, station, self.town.lanes[number].street)

    def lane_of(self, x: float, y: float, road: int, lane: int) -> int:
        """Returns the lane with the given numbers at (x, y), or -1; fast enough for every frame."""
        known = self._by_ids.get((road, lane), ())
        if len(known) == 1:
            return known[0]
        return self.locate(x, y, road, lane).lane if known else NO_LANE

    def turn_angle(self, lane: int, road: int) -> float | None:
        """Returns the angle [degrees, positive left] of the turn from a lane into a road, through one junction.

        Args:
            lane: lane of the car.
            road: number of the target road, or of the connecting road to it.
        """
        town = self.town
        if town is None or lane < 0:
            return None
        for _ in range(len(town.lanes)):  # along the road to the junction
            exits = town.exits(lane)
            for way in exits:
                if road in (town.lanes[way.lane].road_id, town.lanes[way.connector].road_id):
                    return float(way.angle)
            if len(exits) != 1 or exits[0].junction_id >= 0:
                return None
            lane = exits[0].lane
        return None
