from __future__ import annotations

import pytest

from dorothie_gym.evaluation.closed_loop import TaskRecord, task_after, task_at_end
from tests.evaluation.closed_loop.drives import drive, goal, reached, unexpected

STILL = [(0.0, 20.0), (60.0, 20.0)]
THREE = (goal(0), goal(1, trigger=True), goal(2))
STATIONS = (120.0, 220.0, 320.0)


def test_subgoals_that_wait_for_their_trigger_are_not_live() -> None:
    task = task_at_end(drive(STILL, goals=THREE, stations=STATIONS))
    assert task.live == (0, 2) and task.left == {0, 2} and not task.done


def test_triggered_subgoal_is_live_from_then_on() -> None:
    session = drive(STILL, [unexpected(5.0, "task_trigger", subgoal=1)], goals=THREE, stations=STATIONS)
    assert task_after(session, 0).live == (0, 2)
    assert task_after(session, 1).live == (0, 1, 2)


def test_deleted_subgoal_is_no_part_of_the_task() -> None:
    events = [unexpected(5.0, "task_delete", subgoal=0), reached(30.0, 2)]
    task = task_at_end(drive(STILL, events, goals=THREE, stations=STATIONS))
    assert task.live == (2,) and task.done


def test_changed_subgoal_is_where_it_was_moved_to() -> None:
    change = unexpected(5.0, "task_change", subgoal=0, landmark="House", row=2)
    task = task_at_end(drive(STILL, [change], stations=STATIONS))
    assert task.places == {0: (0, 320.0), 1: (0, 220.0)}


def test_place_of_a_change_in_older_recordings_is_where_the_car_stood() -> None:
    events = [unexpected(5.0, "task_change", subgoal=0, landmark="House"), reached(30.0, 0)]
    path = [(0.0, 20.0), (30.0, 218.5), (60.0, 218.5)]
    task = task_at_end(drive(path, events, goals=(goal(0), goal(2)), stations=STATIONS))
    assert task.places[0] == (0, 220.0)


@pytest.mark.parametrize(
    ("number", "done", "allowed"),
    [(0, set(), True), (1, set(), False), (1, {0}, True), (2, {0}, False), (2, {0, 1}, True), (0, {0}, False)],
)
def test_order_is_that_of_the_storyboard_with_the_destination_last(number: int, done: set[int], allowed: bool) -> None:
    task = TaskRecord(places={0: (0, 1.0), 1: (0, 2.0), 2: (0, 3.0)}, after={0: (), 1: (0, 7), 2: ()})
    assert task.may_be_next(number, frozenset(done)) is allowed


def test_nothing_live_is_not_done() -> None:
    assert not TaskRecord(places={}).done
