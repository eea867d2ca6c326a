"""Exceptions count as perceived when, and only if, somebody could perceive them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dorothie_gym.evaluation.analysis.exception_attribution import MEETING_DISTANCE
from dorothie_gym.evaluation.analysis.truth_checks.checks import TalkChecks, check_session
from dorothie_gym.evaluation.analysis.truth_checks.perceivable import BLIND_WAY, WITHIN, perceived_at
from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.session.recording import Event
from tests.evaluation.analysis.builders import exception
from tests.evaluation.teacher_forced.features.played import play


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> SessionWorld:
    session = play(tmp_path_factory.mktemp("played") / "one", seed=3, seconds=240.0)
    plain = replace(session, events=tuple(event for event in session.events if event.type != "Exception"))
    return SessionWorld(plain, find_town("brookside", None))


def with_event(world: SessionWorld, *happened: Event) -> SessionWorld:
    events = tuple(sorted((*world.session.events, *happened), key=lambda event: event.frame))
    return SessionWorld(replace(world.session, events=events), world.town)


def at(world: SessionWorld, event: list[Event]) -> float | None:
    return perceived_at(with_event(world, *event), event[0])


def moving(world: SessionWorld) -> float:
    """A time [s] after which the car drives for a while."""
    return next(time for time in range(10, 200) if all(world.speed(time + k) > 4.0 for k in range(8)))


def test_changes_of_the_weather_are_perceived_at_once_if_they_are_large(world):
    time = 20.0
    assert at(world, exception(time, "weather", parameter="cloudiness", value=80.0)) == time
    assert at(world, exception(time, "weather", parameter="cloudiness", value=10.0)) is None


def test_fall_off_of_the_fog_is_not_perceived_without_fog(world):
    assert at(world, exception(20.0, "weather", parameter="fog_falloff", value=3.0)) is None


def test_object_is_perceived_when_the_car_comes_near(world):
    time = moving(world)
    x, y = world.position(time + 6.0)
    met = at(world, exception(time, "place_prop", x=x, y=y))
    assert met is not None and time <= met <= time + WITHIN
    near = world.position(met)
    assert (near[0] - x) ** 2 + (near[1] - y) ** 2 <= (MEETING_DISTANCE + 1.0) ** 2
    assert at(world, exception(time, "place_prop", x=x + 5e3, y=y)) is None


def test_blurred_camera_shows_at_once_and_lost_gps_after_some_way(world):
    time = float(moving(world))
    assert at(world, exception(time, "sensor_fault", sensor="blur", on=True)) == time
    lost = at(world, exception(time, "sensor_fault", sensor="gps", on=True))
    assert lost is not None and lost > time
    assert lost - time >= BLIND_WAY / 20.0


def test_message_reaches_the_participant_at_once(world):
    assert at(world, exception(30.0, "task_trigger", landmark="KFC", subgoal=1, status="Ongoing")) == 30.0


def test_exceptions_that_nobody_perceives_do_not_count(world):
    checks = TalkChecks()
    far = with_event(
        world,
        *exception(20.0, "place_prop", x=1e5, y=1e5),
        *exception(30.0, "weather", parameter="cloudiness", value=90.0),
    )
    check_session(checks, far.session, world.town)
    found = checks.to_json()
    assert found["exceptions_n"] == {"weather": 1}
    assert found["exceptions_unperceived_n"] == {"place_prop": 1}
