"""Questions about the drive are answered from what the car observes and plans."""

from __future__ import annotations

import pytest

from dorothie_gym.dialogue import Predicate
from dorothie_gym.ontology import DialogueMove, LandmarkName
from tests.policies.co_wizard.rides import Ride

RING = 4


def asked(words: str, *, seed: int = RING, before: float = 8.0, place: str | None = None) -> Ride:
    ride = Ride(seed)
    if place is not None:
        ride.say(f"take me to the {place}", seconds=4.0)
    ride.run(before)
    ride.said.clear()
    ride.say(words, seconds=6.0)
    return ride


@pytest.mark.parametrize(
    ("words", "predicate"),
    [
        ("how's the traffic?", Predicate.CROWDED),
        ("how fast are we going?", Predicate.DRIVES_AT),
        ("what is the speed limit here?", Predicate.DRIVES_AT),
        ("why are we so slow?", Predicate.BECAUSE),
        ("what's the weather like?", Predicate.WEATHER),
        ("will it rain later?", Predicate.WEATHER),
        ("where are we?", Predicate.ON_STREET),
        ("what's on the list?", Predicate.GOAL),
    ],
)
def test_question_is_answered(words: str, predicate: Predicate) -> None:
    ride = asked(words)
    answers = [speech for speech in ride.said if any(content.predicate is predicate for content in speech.meaning)]
    assert answers and answers[0].act.move in (DialogueMove.REPLY_W, DialogueMove.REPLY_U)


def test_limit_and_speed_are_true() -> None:
    limit = asked("what is the speed limit here?")
    stated = next(content for speech in limit.said for content in speech.meaning)
    assert stated.get("speed") == round(3.6 * limit.env.town.lanes[limit.here[0]].speed_limit)
    speed = Ride(RING)
    speed.run(8.0)
    speed.step("how fast are we going?")
    while not (found := [said for one in speed.said for said in one.meaning if said.predicate is Predicate.DRIVES_AT]):
        speed.step()
    stated = found[0]
    assert abs(float(stated.get("speed")) - 3.6 * speed.speed) < 12.0


def test_weather_to_come_is_not_foreseen() -> None:
    ride = asked("will it rain later?")
    assert ride.said[0].act.move is DialogueMove.REPLY_U


def test_distance_and_time_to_a_place_that_is_no_goal() -> None:
    ride = asked("how far is it to the KFC?")
    contents = [content for speech in ride.said for content in speech.meaning]
    metres = next(content.get("metres") for content in contents if content.predicate is Predicate.DISTANCE)
    expected = ride.road.distance_to(*ride.marks()[LandmarkName.KFC])
    assert expected is not None and abs(float(metres) - expected) < 90.0
    assert any(content.predicate is Predicate.ARRIVES_IN for content in contents)


def test_errands_on_the_list_are_named() -> None:
    ride = asked("what's on the list?", place="KFC")
    assert LandmarkName.KFC in {content.get("place") for speech in ride.said for content in speech.meaning}


def test_slow_drive_is_explained_by_its_reason() -> None:
    ride = Ride(RING)
    ride.say("take me to the Shell", seconds=18.0)
    ride.say("slow down to 15", seconds=6.0)
    ride.said.clear()
    ride.say("why so slow?", seconds=6.0)
    causes = [content.get("cause") for speech in ride.said for content in speech.meaning]
    assert next(cause.predicate for cause in causes if hasattr(cause, "predicate")) in (Predicate.TOLD, Predicate.WILL)
