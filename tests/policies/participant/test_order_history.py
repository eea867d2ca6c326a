"""Orders that the participant has said: a third one at one place is admitted, and what was not said does not count."""

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import CommunicativeFunction, Direction, Predicate, Wording
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, Role
from dorothie_gym.policies.participant.contradictory_orders import admit_repetition, own_up
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.failed_guidance import remark_on_wrong_turn
from dorothie_gym.policies.participant.final_approach import creep_instruction, prepare_stop
from dorothie_gym.policies.participant.order_history import drop_repetition, note_said, times_given, times_told
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.participant.repairs import explain_again
from dorothie_gym.policies.participant.turn_by_turn_guidance import follow_route, guide
from dorothie_gym.policies.speech import Remark, intend
from tests.policies.participant.test_final_approach import Guide
from tests.policies.said import with_words

M, A = DialogueMove, ActionValue


def turn(side: Direction = Direction.LEFT) -> Remark:
    return order(M.INSTRUCT, A.J_TURN, Wording(direction=side))


def said(human: Guide, remark: Remark, times: int = 1) -> None:
    for _ in range(times):
        note_said(human.state, human.view, remark)
        human.observation["time"] = human.observation["time"] + 20.0


def queued(human: Guide, *remarks: Remark) -> list[Predicate]:
    """Returns the predicates of what the participant is about to say, after it has looked at its orders."""
    human.state.speech = replace(human.state.speech, queue=remarks)
    admit_repetition(human.state, human.view)
    return [meant.predicate for item in human.state.speech.queue for meant in item.meaning]


def test_third_equal_order_at_one_place_is_admitted_and_the_second_is_not():
    human = Guide(60.0, speed=6.0)
    said(human, turn())
    assert queued(human, turn()) == [Predicate.WILL]
    said(human, turn())
    assert queued(human, turn()) == [Predicate.TRIED, Predicate.WILL]
    assert human.state.speech.queue[0].wording.topic == "said_before" and human.state.speech.queue[1].joined
    assert queued(human, turn(Direction.RIGHT)) == [Predicate.WILL]


def test_admission_begins_a_new_count():
    human = Guide(60.0, speed=6.0)
    said(human, turn(), 2)
    queued(human, turn())
    for remark in human.state.speech.queue:
        said(human, remark)
    assert times_given(human.state, human.view, turn()) == 1


def test_order_after_a_remark_on_the_failure_needs_no_other_one():
    human = Guide(60.0, speed=6.0)
    said(human, turn(), 2)
    assert remark_on_wrong_turn(human.state, human.view, ("turn", 0, 1)) is False
    assert remark_on_wrong_turn(human.state, human.view, ("turn", 0, 1))
    tried = human.state.speech.queue[0]
    assert queued(human, tried, replace(turn(), joined=True)).count(Predicate.TRIED) == 1


def test_turns_of_one_description_are_different_orders():
    human = Guide(60.0, speed=6.0)
    for joined in (False, True, True):
        note_said(human.state, human.view, replace(turn(), joined=joined))
    assert times_given(human.state, human.view, turn()) == 1


def test_order_elsewhere_does_not_count_and_a_u_turn_counts_along_the_street():
    human = Guide(60.0, speed=6.0)
    round_ = order(M.INSTRUCT, A.U_TURN)
    for remark in (turn(), round_):
        said(human, remark, 2)
    human.observation["pose"] = human.observation["pose"] + np.array([200.0, 0.0, 0.0])
    assert queued(human, turn()) == [Predicate.WILL]
    assert queued(human, round_) == [Predicate.TRIED, Predicate.WILL]
    assert times_told(human.state, A.U_TURN) == 2 and times_told(human.state, A.LANE_SWITCH) == 0


@pytest.mark.parametrize(("stops", "states"), [(1, False), (2, True)])
@pytest.mark.parametrize("before", [60.0, 1.0])
def test_third_stop_states_that_this_is_the_place(stops, states, before):
    human = Guide(before, speed=8.0)
    said(human, order(M.INSTRUCT, A.STOP), stops)
    human.state.guidance = replace(human.state.guidance, stopped_at=0.0)
    prepare_stop(human.state, human.view, before, human.rng)
    assert human.state.guidance.points_out is states and human.state.guidance.stop_text


def test_instruction_to_drive_on_a_little_counts_when_it_is_said():
    human = Guide(4.0)
    unsaid = creep_instruction(human.state, human.view)
    assert unsaid.wording.topic == "further" and human.state.guidance.nudges == 0
    for number in (1, 2):
        note_said(human.state, human.view, creep_instruction(human.state, human.view))
        assert human.state.guidance.nudges == number
    assert creep_instruction(human.state, human.view).act.move is M.QUERY_W


def test_car_that_follows_but_stays_short_is_told_how_far():
    human = Guide(8.0)
    for before in (8.0, 5.0):
        human.put(human.state.task.destination.lane, human.state.task.destination.station - before, 0.0)
        note_said(human.state, human.view, creep_instruction(human.state, human.view))
    human.put(human.state.task.destination.lane, human.state.task.destination.station - 2.4, 0.0)
    third = creep_instruction(human.state, human.view)
    assert third.act.move is M.INSTRUCT and third.wording.distance == pytest.approx(3.0)


def test_wrong_way_is_not_pointed_out_again_to_a_car_that_has_not_moved():
    human = Guide(40.0, speed=6.0)
    step = ("turn", human.view.lane, 0)
    lanes = human.env.town.lanes
    far = next(lane.id for lane in lanes if not lane.in_junction and lane.id != human.view.lane)
    remarks = []
    for moved_at in (50.0, 50.0, 90.0):
        human.put(human.state.task.destination.lane, human.state.task.destination.station - 40.0, 6.0)
        human.state.guidance = replace(human.state.guidance, step=step, wrong_turns=())
        human.state.motion = replace(human.state.motion, moved_at=moved_at)
        human.state.route = replace(human.state.route, misses=0, avoided=())
        progress = human.state.route.to_goal
        human.state.route = human.state.route.with_progress(replace(progress, astray=human.state.config.off_route))
        there = lanes[far]
        human.observation |= {
            "time": np.array([moved_at + 1.0]), "lane": np.int64(far), "station": np.array([1.0]),
            "pose": np.array([*there.position(1.0), there.heading_at(1.0)]),
        }  # fmt: skip
        human.state.speech = human.state.speech.cleared()
        follow_route(human.state, human.view)
        said_now = {meant.predicate for item in human.state.speech.queue for meant in item.meaning}
        remarks.append(Predicate.RIGHT_WAY in said_now)
    assert remarks == [True, False, True]


def test_u_turn_just_after_straight_on_is_given_with_a_word_of_why():
    human = Guide(60.0, speed=6.0)
    straight = order(M.INSTRUCT, A.LANE_FOLLOW, Wording(direction=Direction.STRAIGHT))
    round_ = order(M.INSTRUCT, A.U_TURN)
    for former, moves in ((straight, [M.EXPLAIN, M.INSTRUCT]), (round_, [M.INSTRUCT])):
        human.state.speech = replace(
            human.state.speech, said=(former,), last_end=human.view.time - 2.0, queue=(round_,)
        )
        own_up(human.state, human.view)
        assert human.moves() == moves
    further = order(M.INSTRUCT, A.LANE_FOLLOW, Wording(topic="further"))
    human.state.speech = replace(human.state.speech, said=(further,), queue=(round_,))
    own_up(human.state, human.view)
    assert human.moves() == [M.INSTRUCT], "first a little way, then another one"


@pytest.mark.parametrize(
    ("words", "described", "corrects"),
    [
        ("I've got the way on my map", True, True),
        ("about a minute to go", True, True),
        ("I know the way", False, False),
        ("I don't know the way", True, False),
    ],
)
def test_car_that_knows_the_way_to_a_place_off_its_map_has_another_goal(words, described, corrects):
    human = Guide(200.0, speed=6.0)
    human.state.task = replace(human.state.task, described=described)
    human.observation |= with_words(human.observation, Role.CO_WIZARD, words, DialogueAct.of(M.EXPLAIN))
    listen(human.state, human.view, human.rng)
    assert (M.CLARIFY in human.moves()) is corrects


def test_car_that_was_sent_on_a_little_is_stopped_if_it_runs_on():
    for speed, left, stops in ((8.0, 5.0, True), (2.0, 5.0, False)):
        human = Guide(left, speed=speed)
        human.state.guidance = replace(human.state.guidance, nudged_at=48.0, nudges=1)
        guide(human.state, human.view, human.rng)
        assert bool(human.state.speech.queue) is stops


@pytest.mark.parametrize(("turned", "waits"), [(0.0, True), (3.0, False)])
def test_car_that_was_told_to_turn_round_is_guided_in_another_way_only_when_it_has(turned, waits):
    human = Guide(200.0, speed=6.0)
    note_said(human.state, human.view, order(M.INSTRUCT, A.U_TURN))
    human.observation["time"] = human.observation["time"] + 3.0
    human.observation["pose"] = human.observation["pose"] + np.array([0.0, 0.0, turned])
    before = human.state.route.to_goal
    human.state.route = human.state.route.with_progress(replace(before, goal=(before.goal[0], 5.0), astray=9))
    astray = human.state.route.to_goal
    follow_route(human.state, replace(human.view, turning=False))
    assert (human.state.route.to_goal is astray) is waits


def test_order_after_the_car_has_turned_is_no_change_of_mind():
    human = Guide(60.0, speed=6.0)
    for heading, moves in ((0.0, [M.EXPLAIN, M.INSTRUCT]), (1.5, [M.INSTRUCT])):
        human.state.guidance = replace(human.state.guidance, given=())
        note_said(human.state, human.view, turn())
        human.observation["pose"] = human.observation["pose"] + np.array([0.0, 0.0, heading])
        following = turn(Direction.RIGHT)
        human.state.speech = replace(
            human.state.speech, said=(turn(),), last_end=human.view.time - 2.0, queue=(following,)
        )
        own_up(human.state, human.view)
        assert human.moves() == moves


def test_order_that_was_given_with_an_answer_is_not_given_again_from_the_queue():
    human = Guide(60.0, speed=6.0)
    excuse = intend(CommunicativeFunction.INFORM, wording=Wording(topic="changed_mind"))
    round_ = order(M.INSTRUCT, A.U_TURN)
    human.state.say(excuse, replace(round_, joined=True), turn())
    drop_repetition(human.state, round_)
    assert [item.act for item in human.state.speech.queue] == [turn().act]
    human.state.speech = replace(human.state.speech, queue=(replace(turn(), joined=True),))
    drop_repetition(human.state, turn())
    assert human.moves() == [M.INSTRUCT], "the second turn of one description"


def test_stop_that_was_not_understood_twice_is_not_ordered_a_third_time():
    human = Guide(10.0, speed=6.0)
    stop = order(M.INSTRUCT, A.STOP)
    for times, move in ((1, M.INSTRUCT), (2, M.CLARIFY)):
        human.state.guidance = replace(human.state.guidance, given=())
        said(human, stop, times)
        said_it = replace(human.state.speech.cleared(), said=(stop,), last=stop, last_end=human.view.time, repairs=0)
        human.state.speech = said_it
        explain_again(human.state, human.view, human.rng)
        assert human.moves() == [move]
