from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from dorothie_gym.maps import LinkType, Town
from dorothie_gym.maps.lane_neighbours import LEAST_TO_TURN, LEAST_TO_WAIT, WIDEST_MEDIAN, oncoming_lanes
from dorothie_gym.maps.routing import LaneEntry, router
from tests.maps.crossings import town_of
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


def _street_with_short_piece(length: float, forks: bool) -> Town:
    """A street whose lane is interrupted by a short one; beyond it the street goes on, and may also turn off."""
    there, back = 100.0 + length, 200.0 + length
    lines = [
        (-1, [(0.0, 0.0), (100.0, 0.0)]),
        (1, [(100.0, 0.0), (100.0 + 0.5, 0.0)]),
        (-1, [(100.5, 0.0), (there, 0.0)]),
        (2, [(there, 0.0), (there + 10.0, 0.0)]),
        (-1, [(there + 10.0, 0.0), (back, 0.0)]),
        (-1, [(back, -4.0), (0.0, -4.0)]),
        (2, [(there, 0.0), (there + 5.0, 3.0), (there + 5.0, 60.0)]),
    ]
    links = [(k, k + 1, LinkType.STRAIGHT) for k in range(4)]
    return town_of(lines, [*links, *([(2, 6, LinkType.RIGHT)] if forks else [])])


@pytest.mark.parametrize("forks", [False, True])
@pytest.mark.parametrize("length", [1.5, 4.0, 30.0])
def test_cars_turn_round_only_on_lanes_on_which_they_can_stand(length: float, forks: bool) -> None:
    town = _street_with_short_piece(length, forks)
    short = town.lanes[2]
    long_enough = short.length >= (LEAST_TO_WAIT if forks else LEAST_TO_TURN)
    assert (oncoming_lanes(town).at(short.id, short.length / 2) is not None) == long_enough
    for start in ((1, 0.1), (2, 0.1 * short.length)):
        route = router(town).route(start, (5, 150.0))
        turned = [before.lane for before, leg in pairwise(route.legs) if leg.entry is LaneEntry.U_TURN]
        assert turned == [2 if long_enough else 4]
