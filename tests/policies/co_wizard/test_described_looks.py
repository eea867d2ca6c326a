"""The car takes up what its goal looks like, and compares it with what it sees."""

from __future__ import annotations

import copy

import pytest

from dorothie_gym.dialogue.looks import Appearance
from dorothie_gym.ontology import DialogueMove, LandmarkName, StreetName
from dorothie_gym.policies.co_wizard.described_looks import compare_looks
from dorothie_gym.policies.co_wizard.state import CoWizardState
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.policies.observation_parser import SeenLandmark
from dorothie_gym.policies.place_looks import look_of
from dorothie_gym.policies.policy import replace
from tests.policies.co_wizard.rides import Ride


@pytest.mark.parametrize("words", ["look for the yellow house", "it's the yellow house", "you want the yellow house"])
def test_a_description_of_the_goal_is_no_order(words: str) -> None:
    ride = Ride(4)
    ride.say("take me to the house on Hubbard", seconds=4.0)
    assert ride.state.beliefs.goal is LandmarkName.HOUSE
    ride.said.clear()
    ride.say(words, seconds=3.0)
    assert ride.state.beliefs.look == Appearance(facade="yellow")
    assert not ride.state.plan.steps
    assert all(speech.act.move is not DialogueMove.QUERY_W for speech in ride.said)


def test_a_person_is_no_end_of_a_stretch() -> None:
    ride = Ride(4)
    ride.say("we have to meet my friend on Hubbard", seconds=4.0)
    assert ride.state.beliefs.goal is LandmarkName.PERSON
    ride.say("look for somebody in a yellow coat", seconds=3.0)
    assert not ride.state.plan.steps


def beside_houses(ride: Ride, number: int = 2) -> tuple[CoWizardView, list[SeenLandmark]]:
    """Returns the view of a car that stands at the first of some houses of its map."""
    town = ride.env.town
    sites = town.sites[:number]
    houses = [
        SeenLandmark(
            row=row,
            name=LandmarkName.HOUSE,
            x=site.position[0],
            y=site.position[1],
            lane=site.lane,
            station=site.station,
            street=StreetName.UNKNOWN,
        )
        for row, site in enumerate(sites)
    ]
    view = CoWizardView.read(ride.observations["co_wizard"], town)
    pose = [*sites[0].waypoint, 0.0]
    return replace(view, landmarks=tuple(houses), raw={**view.raw, "pose": pose}), houses


def believing(ride: Ride, house: SeenLandmark, look: Appearance) -> CoWizardState:
    state = copy.copy(ride.state)
    state.speech = state.speech.cleared()
    state.beliefs = state.beliefs.with_known_goal(LandmarkName.HOUSE, house.place).with_look(look)
    return state


def test_a_house_of_another_look_is_not_the_goal() -> None:
    ride = Ride(4)
    view, houses = beside_houses(ride)
    other = look_of(ride.env.town, houses[1])
    assert other is not None
    state = believing(ride, houses[0], Appearance(facade=other.facade))
    compare_looks(state, view)
    assert houses[0].place in state.beliefs.ruled_out
    assert not state.beliefs.exact
    assert state.speech.queue[0].meaning[0].get("feature") == f"a {other.facade} facade"


def test_a_house_of_this_look_stays_the_goal() -> None:
    ride = Ride(4)
    view, houses = beside_houses(ride)
    own = look_of(ride.env.town, houses[0])
    assert own is not None
    state = believing(ride, houses[0], Appearance(facade=own.facade, roof=own.roof))
    compare_looks(state, view)
    assert state.beliefs.exact and state.beliefs.place == houses[0].place
    assert not state.speech.queue


def test_a_house_out_of_sight_is_not_judged() -> None:
    ride = Ride(4)
    view, houses = beside_houses(ride, 1)
    far = replace(view, raw={**view.raw, "pose": [houses[0].x + 300.0, houses[0].y, 0.0]})
    in_fog = replace(view, raw={**view.raw, "sight": [3.0]})
    state = believing(ride, houses[0], Appearance(roof="gray"))
    compare_looks(state, far)
    compare_looks(state, in_fog)
    assert state.beliefs.exact
    compare_looks(state, view)
    assert not state.beliefs.exact


def test_the_house_in_view_that_fits_becomes_the_goal() -> None:
    ride = Ride(4)
    view, houses = beside_houses(ride)
    own = look_of(ride.env.town, houses[0])
    assert own is not None
    state = believing(ride, houses[1], Appearance(facade=own.facade))
    state.beliefs = state.beliefs.without_place()
    compare_looks(state, view)
    assert state.beliefs.exact and state.beliefs.place == houses[0].place
