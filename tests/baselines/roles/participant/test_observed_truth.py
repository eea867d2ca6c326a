"""The learned participant does not state a crowd or weather that is not there."""

import dataclasses

import pytest

from dorothie_gym.baselines.roles.participant.observed_truth import is_denied
from dorothie_gym.dialogue import CommunicativeFunction, Predicate, Proposition
from dorothie_gym.ontology import ObjectClass, Role, WeatherParameter
from dorothie_gym.policies.notable_conditions import CROWDS, crowd_remark, weather_change_remark
from dorothie_gym.policies.observation_parser import PARAMETERS
from dorothie_gym.policies.participant.view import ParticipantView
from dorothie_gym.policies.speech import intend
from dorothie_gym.session.session_engine import SessionEngine

FOG = WeatherParameter.FOG_DENSITY


@pytest.fixture(scope="module")
def observed():
    engine = SessionEngine("midtown")
    engine.reset(seed=5)
    return engine.observations.of([Role.PARTICIPANT])[Role.PARTICIPANT], engine.town


def view(observed, *, fog=0.0):
    observation, town = observed
    values = observation["weather"].copy()
    values[PARAMETERS.index(FOG)] = fog
    return ParticipantView.read({**observation, "weather": values}, town)


def crowd(observed, kind, count, distance=10.0):
    seen = view(observed)
    thing = dataclasses.replace(seen.objects[0], kind=kind, distance=distance)
    vars(seen)["objects"] = (thing,) * count  # read when they are first needed
    return seen


@pytest.mark.parametrize("kind", list(CROWDS))
def test_crowd_is_stated_if_enough_are_near(observed, kind):
    assert not is_denied(crowd_remark(kind), crowd(observed, kind, CROWDS[kind]))
    assert is_denied(crowd_remark(kind), crowd(observed, kind, CROWDS[kind] - 1))
    assert is_denied(crowd_remark(kind), crowd(observed, kind, CROWDS[kind], distance=80.0))


@pytest.mark.parametrize(
    ("high", "fog", "denied"), [(True, 0.0, True), (True, 90.0, False), (False, 90.0, True), (False, 0.0, False)]
)
def test_weather_is_stated_as_it_is(observed, high, fog, denied):
    assert is_denied(weather_change_remark(FOG, high=high), view(observed, fog=fog)) is denied


def test_questions_about_a_crowd_are_not_statements(observed):
    content = Proposition.of(Predicate.CROWDED, object=ObjectClass.PEDESTRIAN)
    asks = intend(CommunicativeFunction.PROPOSITIONAL_QUESTION, content)
    assert not is_denied(asks, crowd(observed, ObjectClass.PEDESTRIAN, 0))
