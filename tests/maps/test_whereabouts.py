"""Sides of streets, corners, and lights near places."""

from __future__ import annotations

import math

import pytest

from dorothie_gym.maps import load_town
from dorothie_gym.maps.model import SignalKind
from dorothie_gym.maps.whereabouts import CORNER_DISTANCE, corner_of, is_near_corner, is_on_right, signals_near

TOWNS = ("brookside", "midtown")


@pytest.mark.parametrize("name", TOWNS)
def test_sites_lie_on_the_right_of_the_lane_that_leads_there(name):
    town = load_town(name)
    assert all(is_on_right(town, site.lane, *site.position) for site in town.sites)


def test_place_is_on_the_left_of_the_opposite_lane():
    town = load_town("brookside")
    site = town.sites[0]
    lane = town.lanes[site.lane]
    opposite = next(
        other.id for other in town.lanes if other.road_id == lane.road_id and other.lane_id * lane.lane_id < 0
    )
    assert not is_on_right(town, opposite, *site.position)


@pytest.mark.parametrize("name", TOWNS)
def test_corners_are_where_two_streets_meet(name):
    town = load_town(name)
    found = [(site, corner_of(town, site.street, *site.position)) for site in town.sites]
    assert any(cross is not None for _, cross in found)
    for site, cross in found:
        if cross is not None:
            assert cross != site.street
            assert is_near_corner(town, site.street, cross, *site.position, CORNER_DISTANCE)
            assert not is_near_corner(town, site.street, cross, site.position[0] + 1e4, site.position[1], 100.0)


def test_signals_are_found_around_their_places_only():
    town = load_town("brookside")
    light = next(signal for signal in town.signals if signal.kind is SignalKind.TRAFFIC_LIGHT)
    x, y, _ = light.position
    assert SignalKind.TRAFFIC_LIGHT in signals_near(town, x + 5.0, y)
    assert all(math.hypot(x - other.position[0], y - other.position[1]) < 1e4 for other in town.signals)
    assert signals_near(town, x + 1e5, y) == frozenset()
