from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.maps import LinkType
from dorothie_gym.maps.lane_neighbours import WIDEST_MEDIAN, oncoming_lanes
from tests.sim.driving import network


@pytest.mark.parametrize("name", ["brookside", "Town01", "Town02", "Town05"])
def test_oncoming_lane_runs_the_other_way_on_the_left(name: str) -> None:
    town = network(name).town
    table, found = oncoming_lanes(town), 0
    for lane in town.lanes:
        for station in np.linspace(0.0, lane.length, 4):
            oncoming = table.at(lane.id, float(station))
            if lane.in_junction or town.neighbour(lane.id, LinkType.LANE_CHANGE_LEFT) is not None:
                assert oncoming is None
            if oncoming is None:
                continue
            found += 1
            other = town.lanes[oncoming.lane]
            assert np.cos(other.heading_at(oncoming.station) - lane.heading_at(float(station))) < -0.8
            there = other.position(oncoming.station)
            _, lateral = lane.project(there)
            assert -WIDEST_MEDIAN - 0.5 < lateral < 0.0
            assert abs(abs(lateral) - oncoming.gap) < 0.5
    assert found > 50


def test_each_lane_of_brookside_has_one() -> None:
    town = network("brookside").town
    for lane in town.lanes:
        if not lane.in_junction:
            oncoming = oncoming_lanes(town).at(lane.id, lane.length / 2)
            assert oncoming is not None
            assert town.lanes[oncoming.lane].street == lane.street
