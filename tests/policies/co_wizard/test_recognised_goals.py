"""The car adopts a place that its camera recognises as its goal, unless it was told of another street."""

from __future__ import annotations

import copy

import pytest

from dorothie_gym.ontology import LandmarkName, StreetName
from dorothie_gym.policies.co_wizard.destinations import recognise_goal
from dorothie_gym.policies.policy import replace
from tests.policies.co_wizard.rides import Ride
from tests.policies.co_wizard.test_described_looks import beside_houses


@pytest.mark.parametrize(
    ("told", "seen", "taken"),
    [
        ((StreetName.HUBBARD,), StreetName.DRAPER, False),
        ((StreetName.HUBBARD,), StreetName.HUBBARD, True),
        ((), StreetName.DRAPER, True),
    ],
)
def test_a_house_on_another_street_than_the_one_named_is_not_taken(
    told: tuple[StreetName, ...], seen: StreetName, taken: bool
) -> None:
    ride = Ride(4)
    view, (house,) = beside_houses(ride, 1)
    house = replace(house, street=seen)
    view = replace(view, landmarks=(house,), raw={**view.raw, "landmarks_in_view": [True]}, position=(house.x, house.y))
    state = copy.deepcopy(ride.state)
    state.beliefs = state.beliefs.with_unknown_goal(LandmarkName.HOUSE, told)
    recognise_goal(state, view)
    assert state.beliefs.exact is taken
