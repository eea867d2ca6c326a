"""What the scripted agents notice of weather and crowds, and that they say it truly."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate, understand, word_act
from dorothie_gym.ontology import ObjectClass, PropKind, Role, WeatherParameter
from dorothie_gym.policies.notable_conditions import (
    CROWDS,
    Noticed,
    changes,
    crowds_among,
    notice,
    weather_change_remark,
)
from dorothie_gym.policies.observation_parser import SeenObject

W = WeatherParameter
CLEAR = np.array([parameter.clear_noon for parameter in W])


def observed(**values: float) -> dict[str, np.ndarray]:
    row = CLEAR.copy()
    for name, value in values.items():
        row[list(W).index(W(name))] = value
    return {"weather": row}


def test_clear_weather_is_not_worth_a_word():
    assert list(changes(observed(), frozenset())) == []


@pytest.mark.parametrize(
    "values",
    [
        {"cloudiness": 90.0}, {"precipitation": 80.0}, {"precipitation_deposits": 70.0}, {"wind_intensity": 80.0},
        {"sun_azimuth_angle": 120.0}, {"sun_altitude_angle": -20.0}, {"fog_density": 70.0}, {"wetness": 70.0},
        {"fog_distance": 50.0, "fog_density": 70.0}, {"fog_falloff": 3.0, "fog_density": 70.0},
    ],
    ids=lambda values: next(iter(values)),
)  # fmt: skip
def test_each_parameter_is_noticed_when_it_comes_and_when_it_goes(values):
    parameter = W(next(iter(values)))
    found = dict(changes(observed(**values), frozenset()))
    assert found[parameter] is True
    noted = Noticed().with_change(parameter, high=True).weather
    assert parameter not in dict(changes(observed(**values), noted))
    assert dict(changes(observed(), noted)) == {parameter: False}
    assert Noticed(weather=noted).with_change(parameter, high=False) == Noticed()


def test_details_of_fog_are_noticed_in_fog_only():
    assert list(changes(observed(fog_distance=80.0, fog_falloff=4.0), frozenset())) == []


def test_slow_changes_do_not_flicker():
    noted = frozenset({W.WIND_INTENSITY})
    assert list(changes(observed(wind_intensity=45.0), noted)) == []
    assert list(changes(observed(wind_intensity=45.0), frozenset())) == []


@pytest.mark.parametrize("parameter", W)
@pytest.mark.parametrize("high", [True, False])
def test_every_change_has_words_and_says_which_it_is(parameter, high):
    item = weather_change_remark(parameter, high=high)
    (said,) = item.meaning
    assert said.predicate is Predicate.WEATHER and said.get("parameter") is parameter and said.get("high") is high
    texts = {
        role: {word_act(item.act, role, np.random.default_rng(seed), item.wording) for seed in range(12)}
        for role in (Role.PARTICIPANT, Role.CO_WIZARD)
    }
    other = weather_change_remark(parameter, high=not high)
    for role, words in texts.items():
        assert len(words) > 1
        assert words.isdisjoint(
            word_act(other.act, role, np.random.default_rng(seed), other.wording) for seed in range(12)
        )


PEOPLE, CARS = ObjectClass.PEDESTRIAN, ObjectClass.VEHICLES


def looking(noticed: Noticed, count: int, distance: float, kind: ObjectClass = PEOPLE, time: float = 100.0):
    """What an agent says and notices that sees some objects of a kind at a distance [m]."""
    objects = [SeenObject(kind=kind, x=distance, y=float(k), distance=distance) for k in range(count)]
    seen = observed() | {"time": np.array([time])}
    return notice(noticed, seen, objects, np.random.default_rng(0), chance=1.0, handled=())


def test_crowds_are_many_and_near():
    least = CROWDS[PEOPLE]
    said, noticed = looking(Noticed(looked_at=99.5), least, 20.0)
    assert said is not None and said.act.slots == {PEOPLE}
    assert looking(noticed, least, 20.0, time=110.0)[0] is None  # it has been mentioned
    assert looking(Noticed(looked_at=99.5), least - 1, 20.0)[0] is None
    assert looking(Noticed(looked_at=99.5), 3 * least, 90.0)[0] is None
    assert looking(Noticed(looked_at=99.5), 10, 20.0, CARS)[0].act.slots == {CARS}


def test_usual_traffic_is_no_crowd():
    noticed = Noticed()
    for decision in range(400):
        noticed = noticed.after_looking([CARS] * 5, 0.5 * decision)
    assert crowds_among([CARS] * 5, noticed.usual) == []
    assert crowds_among([CARS] * 8, noticed.usual) == [CARS]


def test_a_crowd_is_noticed_beside_one_that_has_been_mentioned():
    noticed = Noticed(looked_at=99.5).with_crowd(PEOPLE, 95.0)
    crowd = [
        SeenObject(kind=kind, x=20.0, y=float(k), distance=20.0) for k, kind in enumerate([PEOPLE] * 5 + [CARS] * 5)
    ]
    seen = observed() | {"time": np.array([100.0])}
    said, _ = notice(noticed, seen, crowd, np.random.default_rng(0), chance=1.0, handled=())
    assert said is not None and said.act.slots == {CARS}


@pytest.mark.parametrize(
    ("text", "kind"),
    [("there are so many people here", PEOPLE), ("lots of pedestrians here", PEOPLE), ("look at that traffic", None)],
)
def test_crowd_that_the_other_mentions_is_not_mentioned_again(text, kind):
    noticed = Noticed(looked_at=99.5).after_hearing(understand(text), 95.0)
    assert (looking(noticed, 5, 20.0)[0] is None) is (kind is PEOPLE)


@pytest.mark.parametrize("parameter", [W.FOG_DENSITY, W.PRECIPITATION, W.WIND_INTENSITY])
def test_weather_is_understood_from_what_is_said_of_it(parameter):
    item = weather_change_remark(parameter, high=True)
    texts = {word_act(item.act, Role.PARTICIPANT, np.random.default_rng(seed), item.wording) for seed in range(12)}
    understood = [Noticed().after_hearing(understand(text), 1.0).has_mentioned(parameter) for text in texts]
    assert np.mean(understood) > 0.6


@pytest.mark.parametrize("text", ["The rain has stopped.", "It isn't raining that hard any more."])
def test_end_that_the_other_mentions_is_not_mentioned_again(text):
    clear = observed() | {"time": np.array([50.0])}
    rainy = Noticed().with_change(W.PRECIPITATION, high=True)
    alone, _ = notice(rainy, clear, [], np.random.default_rng(0), chance=1.0, handled=())
    assert alone is not None
    told = rainy.after_hearing(understand(text), 49.0)
    for _ in range(3):
        said, told = notice(told, clear, [], np.random.default_rng(0), chance=1.0, handled=())
        assert said is None
        told = told.after_hearing(understand(text), 50.0)


@pytest.mark.parametrize("kind", PropKind)
def test_props_are_told_apart_by_their_size(kind):
    seen = SeenObject(kind=ObjectClass.STATIC, x=0.0, y=0.0, distance=9.0, length=kind.length, width=kind.width)
    assert seen.prop is kind
    assert SeenObject(kind=ObjectClass.VEHICLES, x=0.0, y=0.0, distance=9.0, length=4.5, width=1.8).prop is None
