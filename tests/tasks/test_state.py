import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dorothie_gym.errors import StoryboardError
from dorothie_gym.ontology import GoalStatus
from dorothie_gym.tasks import TaskState, bind

from .builders import bound, grid_places, parse, templates


def state_of(*subgoals):
    return TaskState(bound(*subgoals))


def reach(state, *subgoals):
    return [done for i in subgoals for done in state.arrive(state.landmark_of(i))]


def statuses(state):
    return [state.status(i).label for i in range(len(state.storyboard.subgoals))]


def test_intermediate_stops_come_in_any_order_before_destination():
    state = state_of({}, {}, {})
    assert statuses(state) == ["Ongoing", "Ongoing", "Pending"]
    assert reach(state, 2) == []
    assert reach(state, 1, 0) == [1, 0]
    assert not state.success and state.allowed(2)
    assert reach(state, 2) == [2]
    assert state.success and state.done


def test_subgoal_waits_for_predecessors():
    state = state_of({"after": [1]}, {}, {})
    assert reach(state, 0) == []
    assert reach(state, 1, 0) == [1, 0]


def test_stop_elsewhere_completes_no_subgoal():
    state = state_of({}, {})
    elsewhere = {state.landmark_of(i) for i in range(2)}
    assert all(state.arrive(k) == [] for k in range(10) if k not in elsewhere)


def test_second_arrival_completes_no_subgoal_again():
    state = state_of({}, {})
    assert reach(state, 0, 0) == [0]


def test_one_stop_completes_two_subgoals_in_order():
    state = state_of({"destination": "Coco", "after": [1]}, {"destination": "Coco"}, {"destination": "Coco"})
    assert reach(state, 0) == [1, 0, 2]
    assert state.success


def test_untriggered_subgoal_is_not_part_of_task():
    state = state_of({}, {"trigger": True}, {"after": [1]})
    assert state.live == (0, 2) and state.possible_triggers() == (1,)
    assert state.status(1) is GoalStatus.PENDING
    assert reach(state, 1, 0) == [0]
    state.trigger(1)
    assert state.live == (0, 1, 2) and state.possible_triggers() == ()
    assert not state.allowed(2)
    assert reach(state, 1, 2) == [1, 2]


def test_no_subgoal_waits_for_an_untriggered_subgoal():
    state = state_of({"trigger": True}, {"after": [0]}, {})
    assert state.allowed(1)
    state.trigger(0)
    assert not state.allowed(1)


def test_subgoal_triggered_behind_destination_becomes_destination():
    state = state_of({}, {}, {"trigger": True})
    assert state.destination == 1
    state.trigger(2)
    assert state.destination == 2
    assert reach(state, 1, 2, 0) == [1, 0]
    assert not state.done
    assert reach(state, 2) == [2]


def test_completed_task_accepts_no_trigger():
    state = state_of({}, {}, {"trigger": True})
    reach(state, 0, 1)
    with pytest.raises(StoryboardError, match=r"subgoals\[2\]: cannot be triggered, as the task is done"):
        state.trigger(2)


def test_deleted_subgoal_is_abandoned_and_blocks_no_other():
    state = state_of({"delete": True}, {"after": [0]}, {})
    state.delete(0)
    assert state.status(0) is GoalStatus.ABANDONED and state.live == (1, 2)
    assert reach(state, 0, 1, 2) == [1, 2]
    assert state.success


def test_deletion_may_require_another_subgoal():
    state = state_of({}, {"delete_after_subgoal": 0}, {})
    with pytest.raises(StoryboardError, match="cannot be deleted before subgoal 0 is reached"):
        state.delete(1)
    reach(state, 0)
    assert state.possible_deletions() == (1,)
    state.delete(1)


def test_change_replaces_place_and_description_of_subgoal():
    state = state_of({"change": "Drink something", "change_destination": "Coco"}, {})
    before = state.landmark_of(0)
    assert state.description(0) == "Stop at KFC" and state.possible_changes() == (0,)
    state.change(0)
    assert state.description(0) == "Drink something" and state.changed(0)
    assert state.storyboard.landmarks[state.landmark_of(0)].name.label == "Coco"
    assert state.arrive(before) == []
    assert reach(state, 0) == [0]


def test_final_destination_may_change_place():
    state = state_of({}, {"change": "Drink something", "change_destination": "Coco"})
    state.change(1)
    assert reach(state, 0, 1) == [0, 1] and state.success


def test_change_without_destination_keeps_place():
    state = state_of({"change": "Ask for the bill"}, {})
    before = state.landmark_of(0)
    state.change(0)
    assert state.landmark_of(0) == before


REFUSED = {
    "trigger, not marked": ([{}, {}], [], "trigger", 0, "only subgoals marked `trigger`"),
    "trigger twice": ([{"trigger": True}, {}], [("trigger", 0)], "trigger", 0, "has been triggered already"),
    "delete, not marked": ([{}, {}], [], "delete", 0, "does not mark it `delete`"),
    "delete the destination": ([{}, {"delete": True}], [], "delete", 1, "as it is the destination"),
    "delete twice": ([{"delete": True}, {}], [("delete", 0)], "delete", 0, "as it has been deleted"),
    "delete, not triggered": ([{"delete": True, "trigger": True}, {}], [], "delete", 0, "not part of the task yet"),
    "delete, reached": ([{"delete": True}, {}], [("reach", 0)], "delete", 0, "as it has been reached"),
    "trigger, deleted": (
        [{"delete": True, "trigger": True}, {}],
        [("trigger", 0), ("delete", 0)],
        "trigger",
        0,
        "has been triggered already",
    ),
    "change, not marked": ([{}, {}], [], "change", 0, "does not mark it `change`"),
    "change twice": ([{"change": "x"}, {}], [("change", 0)], "change", 0, "has been changed already"),
    "change, reached": ([{"change": "x"}, {}], [("reach", 0)], "change", 0, "as it has been reached"),
    "change, not triggered": ([{"change": "x", "trigger": True}, {}], [], "change", 0, "not part of the task yet"),
    "no such subgoal": ([{}, {}], [], "delete", 2, "there is no such subgoal; use 0 to 1"),
    "negative subgoal": ([{}, {}], [], "trigger", -1, "there is no such subgoal"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_forbidden_changes_raise_error_without_effect(case):
    subgoals, steps, action, i, reason = REFUSED[case]
    state = state_of(*subgoals)
    for step, k in steps:
        if step == "reach":
            reach(state, k)
        else:
            getattr(state, step)(k)
    before = (state.live, statuses(state))
    with pytest.raises(StoryboardError, match=rf"storyboard test: subgoals\[{i}\]: .*{reason}"):
        getattr(state, action)(i)
    assert (state.live, statuses(state)) == before


@given(templates(), st.integers(0, 999), st.data())
@settings(max_examples=150, deadline=None)
def test_destination_stays_last_and_task_feasible_under_any_events(fields, seed, data):
    state = TaskState(bind(parse(fields), grid_places(24), np.random.default_rng(seed)))
    count = len(state.storyboard.subgoals)
    for _ in range(data.draw(st.integers(0, 25))):
        action = data.draw(st.sampled_from(["arrive", "trigger", "delete", "change"]))
        possible = {
            "trigger": state.possible_triggers(),
            "delete": state.possible_deletions(),
            "change": state.possible_changes(),
        }
        done_before = state.done
        if action == "arrive":
            landmark = data.draw(st.integers(0, len(state.storyboard.landmarks) - 1))
            allowed = [i for i in range(count) if state.allowed(i) and state.landmark_of(i) == landmark]
            completed = state.arrive(landmark)
            assert set(allowed) <= set(completed)
            assert all(state.landmark_of(i) == landmark and state.reached(i) for i in completed)
        else:
            i = data.draw(st.integers(0, count - 1))
            if i in possible[action]:
                getattr(state, action)(i)
            else:
                with pytest.raises(StoryboardError):
                    getattr(state, action)(i)
        assert state.live and state.destination == max(state.live)
        assert state.done == state.success
        assert state.done or not state.reached(state.destination)
        assert not done_before or state.done
        for i in range(count):
            assert (state.status(i) is GoalStatus.COMPLETE) == state.reached(i)
            assert (state.status(i) is GoalStatus.ONGOING) == state.allowed(i)
            assert (i in state.live) or not state.allowed(i)
    while not state.done:
        open_now = [i for i in state.live if state.allowed(i)]
        assert open_now, "a subgoal can always be reached"
        reach(state, open_now[0])
    assert state.success


def test_description_has_its_reason_until_a_change():
    state = TaskState(bound({"reason": "the shop closes at six", "change": "Go to Coco: KFC is full"}, {}))
    assert state.description(0) == "Stop at KFC, because the shop closes at six"
    assert state.description(1) == "Stop at Shell"
    state.change(0)
    assert state.description(0) == "Go to Coco: KFC is full"
