from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import TownError
from dorothie_gym.maps import LinkType
from dorothie_gym.support.portable_math import wrap_degrees
from tests.sim.driving import network


@given(st.floats(-1e5, 1e5))
def test_wrapped_angles_are_the_same_on_the_circle(angle: float) -> None:
    wrapped = wrap_degrees(angle)
    assert -180.0 <= wrapped < 180.0
    assert np.isclose(np.cos(np.radians(wrapped)), np.cos(np.radians(angle)), atol=1e-6)


@pytest.mark.parametrize("name", ["brookside", "Town05"])
def test_places_are_found_again_on_their_lane(name: str) -> None:
    for lane in network(name).town.lanes[::5]:
        for station in np.linspace(0.5, lane.length - 0.5, 3):
            at, lateral = lane.project(lane.position(float(station), 0.3))
            assert abs(at - station) < 0.25
            assert lateral == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize("name", ["brookside", "Town01", "Town02", "Town05"])
def test_exits_have_different_angles_from_right_to_left(name: str) -> None:
    town = network(name).town
    for lane in town.lanes:
        exits = town.exits(lane.id)
        angles = [way.angle for way in exits]
        assert len(set(angles)) == len(angles)
        assert all(-180 <= angle < 180 for angle in angles)
        assert {way.connector for way in exits} == {link.target for link in town.successors(lane.id)}
        assert all(not town.lanes[way.lane].in_junction for way in exits)


def test_left_is_a_positive_angle() -> None:
    town = network("brookside").town
    types = {LinkType.LEFT: 1, LinkType.RIGHT: -1}
    for lane in town.lanes:
        for way in town.exits(lane.id):
            if way.type in types and not lane.in_junction:
                assert np.sign(way.angle) == types[way.type]


def test_a_copied_error_keeps_its_message() -> None:
    error = copy.copy(TownError("town.yaml", "line 3, street 'High Street'", "it runs nowhere"))
    assert str(error) == "town.yaml: line 3, street 'High Street': it runs nowhere"
    assert error.element == "line 3, street 'High Street'"
