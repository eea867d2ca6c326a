"""Cyclists: narrow, slow traffic that keeps to the right."""

from __future__ import annotations

from typing import Any

from dorothie_gym.world.network.network import LaneIndex
from dorothie_gym.world.town.model import Lane, LinkType, Town
from dorothie_gym.world.traffic import TrafficVehicle

SHARE = 1 / 8
"""Share of cyclists among the vehicles of a town."""

SPEEDS = (15.0 / 3.6, 20.0 / 3.6)
"""Slowest and fastest cyclist [m/s]: the middle of what is measured in towns (Dozza & Werneke 2014 give 14 to 20)."""

FASTEST_ROAD = 60.5 / 3.6
"""Where more is allowed than this, nobody rides a bicycle [m/s]."""

FROM_EDGE = 0.8
"""How far from the right edge of the lane they ride, measured to their middle [m] (AASHTO's guide: 0.6 to 0.9)."""

BEHIND, BEFORE = 15.0, 6.0
"""Gaps to those behind and before on the lane to the right for which a cyclist moves over to it [m]."""


def may_ride(lane: Lane) -> bool:
    """Whether cyclists ride on a lane."""
    return lane.speed_limit <= FASTEST_ROAD


class Cyclist(TrafficVehicle):
    """A cyclist, who obeys lights, signs and priorities as all traffic does, and overtakes nobody."""

    LENGTH, WIDTH = 1.8, 0.65
    COMFORT_ACC_MAX = 1.0  # [m/s^2]

    def __init__(self, *args: Any, **fields: Any) -> None:
        super().__init__(*args, **fields)
        self.enable_lane_change = False

    def act(self, action: dict[str, float] | str | None = None) -> None:
        """Rides as traffic drives, but at the right edge of the rightmost lane."""
        lane = self.road.network.get_lane(self.target_lane_index)
        self.aside = max(lane.width_at(lane.local_coordinates(self.position)[0]) / 2 - FROM_EDGE, 0.0)
        if not self.crashed and not lane.town_lane.in_junction:
            self._move_over(lane.town_lane)
        super().act(action)

    def _move_over(self, lane: Lane) -> None:
        """Changes to the lane to the right, if there is one and room on it."""
        town: Town = self.road.network.town
        beside = town.neighbour(lane.id, LinkType.LANE_CHANGE_RIGHT)
        if beside is None or not may_ride(town.lanes[beside]) or self.lane_index != self.target_lane_index:
            return
        index: LaneIndex = self.road.network.index_of(beside)
        (_, before), (_, behind) = self.road.neighbours(self, index)
        if before > BEFORE and behind > BEHIND:
            self.target_lane_index = index
            self.route = [index]

    def _onward(self, lane: LaneIndex) -> list[LaneIndex]:
        """Ways on from a lane; of several those on which one may ride."""
        ways = super()._onward(lane)
        slow = [way for way in ways if self._leads_along_streets(way)]
        return slow or ways

    def _leads_along_streets(self, way: LaneIndex) -> bool:
        network = self.road.network
        lane = network.get_lane(way).town_lane
        after = [network.get_lane(index).town_lane for index in network.successors(way)] if lane.in_junction else []
        return all(may_ride(each) for each in (lane, *after))
