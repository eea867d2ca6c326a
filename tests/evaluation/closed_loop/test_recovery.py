from __future__ import annotations

from dorothie_gym.evaluation.closed_loop import met_exceptions
from dorothie_gym.ontology import ExceptionKind
from tests.evaluation.closed_loop.drives import drive, goal, reached, street, unexpected

STRAIGHT = [(0.0, 20.0), (60.0, 320.0)]  # 5 m/s
HOME = (goal(1),)


def test_undisturbed_car_recovers_after_ten_metres() -> None:
    events = [unexpected(10.0, "weather"), reached(60.0, 0)]
    (found,) = met_exceptions(drive(STRAIGHT, events, goals=HOME), street())
    assert (found.kind, found.met, found.seconds) == (ExceptionKind.WEATHER, 10.0, 2.0)


def test_car_that_stands_recovers_when_it_goes_on() -> None:
    path = [(0.0, 20.0), (10.0, 70.0), (40.0, 70.0), (60.0, 170.0)]
    fault = unexpected(10.0, "sensor_fault", sensor="gps", on=True)
    (found,) = met_exceptions(drive(path, [fault, reached(60.0, 0)], goals=HOME), street())
    assert found.met == 10.0 and found.seconds == 32.0  # 30 s of standing, and 10 m at 5 m/s


def test_car_that_drives_back_recovers_after_its_return() -> None:
    path = [(0.0, 20.0), (20.0, 120.0), (30.0, 70.0), (80.0, 320.0)]
    events = [unexpected(10.0, "weather"), reached(80.0, 0)]
    (found,) = met_exceptions(drive(path, events, goals=HOME), street())
    assert found.seconds == 22.0  # at 32 s it is at 80 m again, 10 m beyond where it met the weather


def test_who_goes_forward_and_reaches_nothing_has_not_recovered() -> None:
    (found,) = met_exceptions(drive(STRAIGHT, [unexpected(10.0, "weather")], goals=HOME), street())
    assert found.met == 10.0 and found.seconds is None


def test_who_stands_to_the_end_has_not_recovered() -> None:
    path = [(0.0, 20.0), (10.0, 70.0), (90.0, 70.0)]
    (found,) = met_exceptions(drive(path, [unexpected(10.0, "weather")]), street())
    assert found.met == 10.0 and found.seconds is None


def test_next_subgoal_is_a_recovery_too() -> None:
    path = [(0.0, 20.0), (20.0, 115.0), (24.0, 120.0), (60.0, 120.0)]
    (found,) = met_exceptions(drive(path, [unexpected(20.0, "weather"), reached(24.0, 0)]), street())
    assert found.seconds == 4.0


def test_what_stands_on_the_road_is_met_from_sixty_metres() -> None:
    prop = unexpected(1.0, "place_prop", prop="cone", lane=0, station=380.0, x=380.0, y=0.0)
    (found,) = met_exceptions(drive([(0.0, 20.0), (40.0, 220.0), (80.0, 350.0)], [prop], goals=HOME), street())
    assert found.met is not None and 70.0 < found.met < 71.0
    (missed,) = met_exceptions(drive([(0.0, 20.0), (40.0, 220.0)], [prop]), street())
    assert missed.met is None and missed.seconds is None


def test_newcomers_are_met_near_the_square_in_which_they_appear() -> None:
    crowd = unexpected(1.0, "spawn_pedestrians", count=3, x0=200.0, x1=220.0, y0=-10.0, y1=10.0)
    (found,) = met_exceptions(drive(STRAIGHT, [crowd]), street())
    assert found.met == 24.0  # at 140 m


def test_what_is_taken_away_again_is_nothing_to_meet() -> None:
    events = [unexpected(5.0, "delete_prop", item=0), unexpected(6.0, "sensor_fault", sensor="gps", on=False)]
    assert met_exceptions(drive(STRAIGHT, events), street()) == ()


def test_longer_task_is_no_step_back() -> None:
    events = [unexpected(10.0, "task_trigger", subgoal=1), reached(60.0, 0)]
    goals = (goal(0), goal(1, trigger=True), goal(2))
    (found,) = met_exceptions(drive(STRAIGHT, events, goals=goals, stations=(350.0, 360.0, 370.0)), street())
    assert found.seconds == 2.0
