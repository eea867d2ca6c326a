"""Guided trips arrive in every town, between any two sites."""

from __future__ import annotations

import pytest

from dorothie_gym.maps import town_names
from tests.sim.driving import network
from tests.sim.ego_driver import guided_trip, random_pair

TOWNS = (*town_names(), "Town01", "Town02", "Town05")


def _drive_all(name: str, seeds: range) -> None:
    roads = network(name)
    failed = []
    for seed in seeds:
        trip = guided_trip(roads, *random_pair(roads.town, seed))
        if not trip.arrived or trip.worst > 0.5:
            failed.append((seed, trip.arrived, round(trip.worst, 2)))
    assert not failed


@pytest.mark.parametrize("name", TOWNS)
def test_perfect_instructions_lead_from_site_to_site_without_leaving_the_lane(name: str) -> None:
    _drive_all(name, range(6))


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", TOWNS)
def test_two_hundred_routes_are_drivable(name: str) -> None:
    _drive_all(name, range(100, 300))
