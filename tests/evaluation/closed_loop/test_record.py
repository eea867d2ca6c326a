from __future__ import annotations

import json

import pytest

from dorothie_gym.evaluation.closed_loop import SessionRecord, measure
from dorothie_gym.session.recording import EventType
from tests.evaluation.closed_loop.drives import drive, event, goal, hit, reached, street, unexpected

STRAIGHT = [(0.0, 20.0), (20.0, 120.0), (60.0, 320.0)]
ARRIVALS = [reached(20.0, 0), reached(60.0, 1)]


def test_whole_way_without_a_mistake() -> None:
    found = measure(drive(STRAIGHT, ARRIVALS), street())
    assert found.success and (found.live, found.reached) == (2, 2)
    assert (found.shortest, found.driven, found.completion) == (300.0, 300.0, 1.0)
    assert (found.seconds, found.decisions, found.infractions) == (60.0, 120, {})


def test_detour_is_driven_but_not_the_shortest_way() -> None:
    path = [(0.0, 20.0), (10.0, 70.0), (20.0, 20.0), (40.0, 120.0), (80.0, 320.0)]
    found = measure(drive(path, [reached(40.0, 0), reached(80.0, 1)]), street())
    assert (found.shortest, found.driven) == (300.0, 400.0)


def test_half_of_the_way_and_back_again_counts_as_half() -> None:
    path = [(0.0, 20.0), (20.0, 120.0), (30.0, 170.0), (60.0, 130.0)]
    found = measure(drive(path, [reached(20.0, 0)]), street())
    assert not found.success and (found.live, found.reached) == (2, 1)
    assert found.completion == pytest.approx(0.5, abs=0.01)  # 150 of 300 m, to the router's cells


def test_standing_is_no_progress() -> None:
    assert measure(drive([(0.0, 20.0), (30.0, 20.0)]), street()).completion == 0.0


def test_own_collision_prevents_success_and_one_of_others_does_not() -> None:
    assert not measure(drive(STRAIGHT, [hit(5.0, "Vehicles"), *ARRIVALS]), street()).success
    found = measure(drive(STRAIGHT, [hit(5.0, "Vehicles", own_fault=False), *ARRIVALS]), street())
    assert found.success and found.infractions == {"hit_by_others": 1}


def test_infractions_are_counted_by_kind() -> None:
    place = {"lane": 0, "station": 1.0, "x": 1.0, "y": 0.0, "key": 4, "other": None}
    events = [
        hit(1.0, "Pedestrian"), hit(2.0, "Vehicles"), hit(3.0, "Static"), hit(4.0, None), hit(5.0, "Pole"),
        event(6.0, EventType.RED_LIGHT, **place), event(7.0, EventType.RED_LIGHT, **place),
        event(8.0, EventType.STOP_SIGN, **place), event(9.0, EventType.OFF_ROAD, **place),
        event(60.0, EventType.END, success=False, reason="out of time"),
    ]  # fmt: skip
    assert measure(drive(STRAIGHT, events), street()).infractions == {
        "pedestrian": 1, "vehicle": 1, "static": 3, "red_light": 2, "stop_sign": 1, "off_road": 1, "timeout": 1,
    }  # fmt: skip


def test_each_infraction_has_its_time_its_place_and_its_counterpart() -> None:
    place = {"lane": 0, "station": 1.0, "x": 1.0, "y": 2.5, "key": 4, "other": None}
    events = [event(6.0, EventType.RED_LIGHT, **place), hit(9.0, "Vehicles", own_fault=False), *ARRIVALS]
    found = measure(drive(STRAIGHT, events), street())
    red, behind = found.infraction_events
    assert (red.kind, red.seconds, red.own_fault, red.place, red.counterpart) == ("red_light", 6.0, True, (1.0, 2.5), 4)
    assert (behind.kind, behind.seconds, behind.own_fault) == ("hit_by_others", 9.0, False)
    assert SessionRecord.from_json(json.loads(json.dumps(found.to_json()))) == found
    assert "infraction_events" not in measure(drive(STRAIGHT, ARRIVALS), street()).to_json()


def test_best_order_that_is_allowed_is_the_shortest_way() -> None:
    goals, stations = (goal(0), goal(1), goal(2)), (220.0, 120.0, 320.0)
    assert measure(drive(STRAIGHT, goals=goals, stations=stations), street()).shortest == 300.0


def test_way_that_there_is_not_has_no_length() -> None:
    bound = (goal(0), goal(1, 0), goal(2))  # a U-turn is not possible in this street
    found = measure(drive(STRAIGHT, goals=bound, stations=(220.0, 120.0, 320.0)), street())
    assert found.shortest is None and found.completion is None


def test_record_survives_json() -> None:
    found = measure(drive(STRAIGHT, [unexpected(5.0, "weather"), *ARRIVALS]), street())
    assert len(found.exceptions) == 1
    assert SessionRecord.from_json(found.to_json()) == found
