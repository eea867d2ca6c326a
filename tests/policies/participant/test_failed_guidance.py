"""What the participant and the Co-Wizard do where the same thing has failed twice."""

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate
from dorothie_gym.maps.routing import LaneEntry
from dorothie_gym.ontology import ActionValue, DialogueMove, Slot
from dorothie_gym.policies.participant.failed_guidance import remark_on_miss, remark_on_wrong_turn
from dorothie_gym.policies.participant.order_history import note_said
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.participant.state import StepKey
from dorothie_gym.policies.participant.turn_by_turn_guidance import guide, watch
from dorothie_gym.policies.route_state import section
from tests.policies.participant.test_final_approach import Guide


def predicates(human: Guide) -> list[Predicate]:
    return [said.predicate for item in human.state.speech.queue for said in item.meaning]


def before_u_turn(human: Guide) -> None:
    """Puts the car where its way to the goal begins with a U-turn."""
    for lane in human.env.town.lanes:
        for station in np.arange(5.0, lane.length - 30.0, 5.0):
            human.put(lane.id, float(station), 6.0)
            progress = human.state.route.progress
            assert progress is not None
            manoeuvre = progress.next_manoeuvre(float(station))
            if manoeuvre is not None and manoeuvre[0] is LaneEntry.U_TURN and progress.turns_round_on(lane.id):
                return
    raise AssertionError("no place from which the car would turn round")


def told_to_turn_round(human: Guide, times: int) -> None:
    for _ in range(times):
        note_said(human.state, human.view, order(DialogueMove.INSTRUCT, ActionValue.U_TURN))
        human.observation["pose"] = human.observation["pose"] + np.array([0.0, 0.0, 3.0])  # it does


def test_third_u_turn_is_replaced_by_a_remark_and_another_way():
    human = Guide(1.0)
    before_u_turn(human)
    told_to_turn_round(human, 2)
    human.state.route = replace(human.state.route, misses=1)
    guide(human.state, human.view, human.rng)
    assert predicates(human) == [Predicate.TRIED, Predicate.WILL]
    assert human.moves() == [DialogueMove.EXPLAIN, DialogueMove.INSTRUCT]
    said = [value for item in human.state.speech.queue for value in item.act.values(Slot.ACTION)]
    assert ActionValue.U_TURN not in said
    assert human.state.route.progress is not None
    assert human.state.route.progress.manoeuvre_cost == human.state.config.way_round_cost


def test_second_u_turn_is_given_without_a_remark():
    human = Guide(1.0)
    before_u_turn(human)
    told_to_turn_round(human, 1)
    human.state.guidance = replace(human.state.guidance, u_turns=2)  # planned, but not said
    guide(human.state, human.view, human.rng)
    assert Predicate.TRIED not in predicates(human)


def test_car_that_has_not_moved_since_the_last_order_does_not_circle():
    human = Guide(1.0)
    before_u_turn(human)
    told_to_turn_round(human, 2)
    human.state.guidance = replace(human.state.guidance, step_at=45.0)
    human.state.motion = replace(human.state.motion, moved_at=40.0, standing_since=40.0)
    guide(human.state, human.view, human.rng)
    assert Predicate.TRIED not in predicates(human)


@pytest.mark.parametrize(("excused_until", "waits"), [(80.0, True), (0.0, False)])
def test_car_that_has_said_what_keeps_it_is_not_told_to_turn_round_again(excused_until, waits):
    human = Guide(1.0)
    before_u_turn(human)
    human.observation["speed"] = np.array([0.0])
    human.state.motion = replace(human.state.motion, moved_at=30.0, standing_since=30.0, excused_until=excused_until)
    human.state.guidance = replace(human.state.guidance, step_at=35.0)
    guide(human.state, human.view, human.rng)
    assert (human.moves() == []) is waits


def test_place_that_was_passed_twice_is_remarked_on():
    human = Guide(20.0, speed=6.0)
    assert human.state.task.goal is not None
    for away in (90.0, 10.0, 90.0, 10.0):
        human.state.guidance = human.state.guidance.near_place(away)
    for misses, expected in ((1, [Predicate.PASSED, Predicate.WILL]), (2, [Predicate.PASSED, Predicate.WILL])):
        human.state.route = replace(human.state.route, misses=misses)
        remark_on_miss(human.state, human.view, passed=True)
        assert predicates(human) == expected
    passed = human.state.speech.queue[0].meaning[0]
    assert passed.get("place") is human.state.task.goal.name and passed.get("times") == 2


def test_turn_that_was_not_taken_twice_is_avoided():
    human = Guide(20.0, speed=6.0)
    lane = next(lane.id for lane in human.env.town.lanes if len(human.env.town.exits(lane.id)) > 1)
    connector = human.env.town.exits(lane)[0].connector
    step: StepKey = ("turn", lane, connector)
    human.state.guidance = replace(human.state.guidance, step=step)
    assert not remark_on_wrong_turn(human.state, human.view, step)
    assert remark_on_wrong_turn(human.state, human.view, step)
    assert predicates(human) == [Predicate.TRIED, Predicate.WILL]
    assert connector in [place[0] for place in human.state.route.avoided]


@pytest.mark.parametrize(("times", "guides"), [(2, False), (3, True)])
def test_car_that_comes_along_for_the_third_time_is_guided(times, guides):
    human = Guide(200.0, speed=8.0)
    human.state.guidance = replace(human.state.guidance, guiding=False, best=np.inf)
    here = section(human.env.town, human.view.lane)
    human.state.route = replace(human.state.route, driven=(here, (here[0] + 1, here[1])) * times)
    watch(human.state, human.view)
    assert human.state.guidance.guiding is guides
    assert predicates(human) == [Predicate.TRIED] * guides


def test_car_that_stands_although_told_to_start_twice_is_asked_why():
    human = Guide(200.0)
    human.observation["time"] = np.array([500.0])
    said: list[DialogueMove] = []
    for _ in range(4):
        human.state.speech = replace(human.state.speech.cleared(), last_end=-100.0)
        guide(human.state, human.view, human.rng)
        said += human.moves()[:1]
        human.observation["time"] = human.observation["time"] + 30.0
    assert DialogueMove.QUERY_W in said
    assert said.index(DialogueMove.QUERY_W) <= 2
