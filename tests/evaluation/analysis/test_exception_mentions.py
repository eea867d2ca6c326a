"""What is said decides which exception an exchange handles, where meanings are recorded."""

from __future__ import annotations

import pytest

from dorothie_gym.dialogue import Predicate, Proposition
from dorothie_gym.evaluation.analysis import Handled, Units, handling
from dorothie_gym.ontology import ActionValue, LandmarkName, ObjectClass, PropKind, Sensor, WeatherParameter
from dorothie_gym.session.recording import Event
from tests.evaluation.analysis.builders import M, drive, exception, human

P, W = Predicate, WeatherParameter
FOG = exception(20.0, "weather", parameter="fog_density", value=80.0)
NIGHT = exception(20.0, "weather", parameter="sun_altitude_angle", value=-20.0)
BLUR = exception(20.0, "sensor_fault", sensor="blur", on=True)
GPS = exception(20.0, "sensor_fault", sensor="gps", on=True)
CONE = exception(20.0, "place_prop", x=180.0, y=0.0)
PEOPLE = exception(20.0, "spawn_pedestrians", x0=140.0, x1=160.0, y0=-10.0, y1=10.0)
ADDED = exception(20.0, "task_trigger", subgoal=1, landmark="Ikea", status="Ongoing")


def fog(parameter: W = W.FOG_DENSITY) -> Proposition:
    return Proposition.of(P.WEATHER, parameter=parameter, high=True)


def handled(happened: list[Event], text: str, *said: Proposition, start: float = 30.0) -> Handled:
    """How an exchange is classified that begins after an exception, in a drive to the east at 6 m/s."""
    talk = human(start, text, M.EXPLAIN, meaning=[each.to_json() for each in said])
    before = human(2.0, "hello", M.ALIGN, meaning=[Proposition.of(P.LOCALISED).to_json()])
    units = Units(drive(before, happened, talk, seconds=240.0))
    last = max(units.exchanges, key=lambda unit: unit.start)
    return handling(units)[last.id]


@pytest.mark.parametrize(
    ("happened", "said"),
    [
        (FOG, fog()),
        (FOG, fog(W.FOG_FALLOFF)),
        (FOG, Proposition.of(P.VISIBILITY, negated=True)),
        (FOG, Proposition.of(P.FEELS, feeling="nervous", cause=Proposition.of(P.VISIBILITY, negated=True))),
        (NIGHT, Proposition.of(P.LIGHTS_ON)),
        (NIGHT, Proposition.of(P.WILL, action=ActionValue.LIGHT_CHANGE)),
        (BLUR, Proposition.of(P.FAILED, sensor=Sensor.BLUR)),
        (BLUR, Proposition.of(P.FAILED)),
        (BLUR, Proposition.of(P.VISIBILITY)),
        (GPS, Proposition.of(P.LOCALISED, negated=True)),
        (CONE, Proposition.of(P.BLOCKED, object=ObjectClass.STATIC, prop=PropKind.TRAFFIC_CONE)),
        (PEOPLE, Proposition.of(P.CROWDED, object=ObjectClass.PEDESTRIAN)),
    ],
    ids=str,
)
def test_environment_is_handled_by_what_is_about_it(happened, said):
    assert handled(happened, "hm", said) is Handled.ENVIRONMENTAL


@pytest.mark.parametrize(
    ("happened", "text", "said"),
    [
        (FOG, "I hope it's sunny tomorrow", None),
        (FOG, "did you watch the game last night", None),
        (FOG, "it's windy", fog(W.WIND_INTENSITY)),
        (FOG, "slow down before the corner", Proposition.of(P.WILL, action=ActionValue.SPEED_CHANGE)),
        (CONE, "it's past the next block", Proposition.of(P.CLOSE, place=LandmarkName.KFC, negated=True)),
        (CONE, "is that a dumpster", Proposition.of(P.SEES, object=ObjectClass.STATIC)),
        (GPS, "do you know where we are going", Proposition.of(P.HAS_ROUTE)),
        (GPS, "my camera is blurred", Proposition.of(P.FAILED, sensor=Sensor.BLUR)),
        (PEOPLE, "so many cars", Proposition.of(P.CROWDED, object=ObjectClass.VEHICLES)),
        (ADDED, "to the KFC", Proposition.of(P.GOAL, place=LandmarkName.KFC)),
    ],
)
def test_words_alone_do_not_handle_an_exception(happened, text, said):
    assert handled(happened, text, *([] if said is None else [said])) is Handled.NONE


def test_standstill_for_people_handles_a_crowd_near_its_place_only():
    stopped = Proposition.of(P.BECAUSE, cause=Proposition.of(P.HINDERS, object=ObjectClass.PEDESTRIAN))
    assert handled(PEOPLE, "people in the way", stopped, start=24.0) is Handled.ENVIRONMENTAL
    assert handled(PEOPLE, "people in the way", stopped, start=70.0) is Handled.NONE


def test_talk_about_the_place_of_a_changed_task_handles_it():
    errand = Proposition.of(P.TASK, place=LandmarkName.IKEA)
    assert handled(ADDED, "there is one more", errand) is Handled.TASK
    assert handled(ADDED, "there is one more", errand, start=100.0) is Handled.NONE
