from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate
from dorothie_gym.ontology import DialogueMove, GoalStatus
from dorothie_gym.policies.participant.subgoals import announcement, choose_target, note_tasks, route_length
from dorothie_gym.policies.participant.view import ParticipantView
from tests.policies.test_repairs import Human

M = DialogueMove


def with_tasks(human: Human, **changes) -> ParticipantView:
    """Returns the view after a change of one subgoal, `index`."""
    index = changes.pop("index")
    tasks = tuple(
        replace(task, **changes) if task.index == index else task for task in human.state.task.subgoals if task.live
    )
    keep_live_subgoals(human)
    return replace(human.view, subgoals=tasks)


def keep_live_subgoals(human: Human) -> None:
    live = tuple(task for task in human.state.task.subgoals if task.live)
    human.state.task = human.state.task.with_subgoals(live, str(human.view.raw["tasks"]))


def another_task(human: Human):
    """Returns an open subgoal other than the target, at a place of another name."""
    assert human.state.task.goal is not None
    view = human.view
    for task in view.subgoals:
        place = view.landmark(task.landmark)
        other = place is not None and place.name is not human.state.task.goal.name
        if task.open and task.index != human.state.task.target and other:
            return task, place
    raise AssertionError("there is no other task")


def planned(human: Human) -> list[tuple[DialogueMove, frozenset]]:
    return [(item.act.move, item.act.slots) for item in human.state.speech.queue]


@pytest.mark.parametrize("seed", range(4))
def test_dropped_task_is_reported(seed):
    human = Human()
    task, place = another_task(human)
    note_tasks(human.state, with_tasks(human, index=task.index, live=False), np.random.default_rng(seed))
    move, slots = planned(human)[0]
    assert move in (M.INSTRUCT, M.EXPLAIN)
    assert {place.name, GoalStatus.ABANDONED} <= slots


def test_dropped_target_is_abandoned():
    human = Human()
    note_tasks(human.state, with_tasks(human, index=human.state.task.target, live=False), human.rng)
    assert human.state.task.goal is None
    assert human.state.task.same_breath


def test_completion_is_reported_after_delay():
    human = Human()
    view = with_tasks(human, index=human.state.task.target, reached=True)
    note_tasks(human.state, view, human.rng)
    assert GoalStatus.COMPLETE in planned(human)[0][1]
    assert human.state.speech.speak(view.time, 0.0, human.rng)[0] is None
    assert human.state.speech.speak(view.time + 20.0, 0.0, human.rng)[0] is not None


def interrupted(seed: int) -> tuple[Human, object]:
    """Returns a participant after a new subgoal nearer than the target."""
    human = Human()
    task, place = another_task(human)
    progress = human.state.route.progress
    progress = replace(progress, goal=(progress.goal[0], 1e5))
    subgoals = (replace(item, live=item.live and item.index != task.index) for item in human.state.task.subgoals)
    human.state.task = human.state.task.with_subgoals(tuple(subgoals), str(human.view.raw["tasks"]))
    left = progress.left(human.view.station)
    assert route_length(human.state, human.view, place) < max(left, 1e4)
    human.state.route = human.state.route.with_progress(Far(progress))
    note_tasks(human.state, human.view, np.random.default_rng(seed))
    return human, place


class Far:
    """Route that is longer than any other."""

    def __init__(self, journey) -> None:
        self._journey = journey

    def left(self, station: float) -> float:
        return 1e5

    def __getattr__(self, name: str):
        return getattr(self._journey, name)


def test_new_task_on_the_way_interrupts_target_that_is_resumed_later():
    human, place = next(found for seed in range(20) if (found := interrupted(seed))[0].state.task.put_off)
    remarks = planned(human)
    assert human.state.task.goal == place
    assert GoalStatus.ONGOING in remarks[0][1] and place.name in remarks[0][1]
    assert GoalStatus.PENDING in remarks[1][1]
    former = next(iter(human.state.task.put_off))
    view = human.view
    done = tuple(replace(task, reached=task.index == human.state.task.target) for task in view.subgoals)
    human.state.task = replace(human.state.task, target=None, goal=None)
    choose_target(human.state, replace(view, subgoals=tuple(t for t in done if t.index == former)), human.rng)
    again = announcement(human.state, view, human.rng)
    assert again.wording.topic == "resume" and GoalStatus.ONGOING in again.act.slots


def test_changed_later_task_is_reported_with_both_names():
    human = Human()
    task, place = another_task(human)
    names = {place.name, human.state.task.goal.name}
    other = next(mark for mark in human.view.landmarks if mark.name not in names)
    view = with_tasks(human, index=task.index, landmark=other.row)
    remarks = []
    for seed in range(10):
        human.state.speech = human.state.speech.cleared()
        human.state.task = human.state.task.with_subgoals(human.view.subgoals, str(human.view.raw["tasks"]))
        keep_live_subgoals(human)
        note_tasks(human.state, view, np.random.default_rng(seed))
        remarks += planned(human)
    assert remarks
    assert all({place.name, other.name, GoalStatus.ABANDONED, GoalStatus.PENDING} == slots for _, slots in remarks)


def with_line(human: Human, index: int, line: str) -> ParticipantView:
    """Returns the view after a change of what a subgoal's line of the list says."""
    lines = str(human.view.raw["tasks"]).split("\n")
    live = [task.index for task in human.view.subgoals if task.live]
    lines[live.index(index)] = line
    return replace(human.view, raw={**human.view.raw, "tasks": "\n".join(lines)})


def test_more_to_do_at_the_place_of_a_later_task_is_told_with_the_place_and_the_thing():
    human = Human()
    task, place = another_task(human)
    view = with_line(human, task.index, "Buy a kite and a lantern there for Sana, because it is her birthday")
    told = []
    for seed in range(10):
        human.state.speech = human.state.speech.cleared()
        human.state.task = human.state.task.with_subgoals(human.view.subgoals, str(human.view.raw["tasks"]))
        note_tasks(human.state, view, np.random.default_rng(seed))
        told += [(item.act.slots, item.meaning) for item in human.state.speech.queue]
    assert {place.name, GoalStatus.PENDING} <= told[0][0]
    (more,) = told[1][1]
    assert more.predicate is Predicate.PURPOSE and more.get("place") is place.name
    assert "a kite" in str(more.get("item")) and "kite" in str(more.get("purpose"))


def test_an_unchanged_list_is_not_told_again():
    human = Human()
    keep_live_subgoals(human)
    human.state.speech = human.state.speech.cleared()
    note_tasks(human.state, replace(human.view, subgoals=human.state.task.subgoals), human.rng)
    assert planned(human) == []
