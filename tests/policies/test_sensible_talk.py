"""What is said makes sense: one sign of hearing, no stale remarks, names kept, reasons for a change of the way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import CommunicativeFunction, Direction, Predicate, Proposition, Wording, understand
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, GoalStatus, LandmarkName, Role, StreetName
from dorothie_gym.policies.co_wizard.acknowledgement import acknowledge, sign_of_hearing
from dorothie_gym.policies.co_wizard.answer_merging import in_one_breath, still_due
from dorothie_gym.policies.co_wizard.destinations import set_goal
from dorothie_gym.policies.co_wizard.errand_memory import note_friend, without_purposes
from dorothie_gym.policies.heard_utterance import heard_utterance
from dorothie_gym.policies.notable_conditions import Noticed
from dorothie_gym.policies.participant.advance_directions import take_up_confirmation
from dorothie_gym.policies.participant.contradictory_orders import own_up
from dorothie_gym.policies.participant.dialogue_update import listen
from dorothie_gym.policies.participant.failed_guidance import remark_on_miss, stop_circling
from dorothie_gym.policies.participant.order_history import note_said, rounds_told, turned_round_lately
from dorothie_gym.policies.participant.order_wording import order
from dorothie_gym.policies.speech import Remark, intend
from tests.policies.participant.test_final_approach import Guide
from tests.policies.said import with_words
from tests.policies.test_acknowledgement import start

M, A, F = DialogueMove, ActionValue, CommunicativeFunction
LEFT, RIGHT = Direction.LEFT, Direction.RIGHT


def heard_by_car(text: str, *acts: DialogueAct):
    state, view = start()
    heard = heard_utterance(with_words(dict(view.raw), Role.PARTICIPANT, text, *acts), Role.PARTICIPANT)
    assert heard is not None
    return state, heard


def turn(side: Direction, topic: str | None = None, *, joined: bool = False) -> Remark:
    return replace(order(M.INSTRUCT, A.J_TURN, Wording(direction=side, topic=topic)), joined=joined)


# --- the car ----------------------------------------------------------------------------------------------------------


def test_second_okay_and_second_plan_are_left_out():
    place = intend(F.ACCEPT, Proposition.of(Predicate.GOAL, place=LandmarkName.KFC))
    plans = [intend(F.INFORM, Proposition.of(each, place=LandmarkName.KFC)) for each in (Predicate.HAS_ROUTE,) * 2]
    said = in_one_breath([place, sign_of_hearing("align"), *plans])
    assert [item.act.move for item in said] == [M.CONFIRM, M.EXPLAIN]


def test_what_is_known_is_said_once():
    house = LandmarkName.HOUSE
    knows = intend(F.AFFIRMATIVE_ANSWER, Proposition.of(Predicate.KNOWS, place=house), elided=("place",))
    way = intend(F.INFORM, Proposition.of(Predicate.HAS_ROUTE, place=house), elided=("place",))
    heard = intend(F.POSITIVE_FEEDBACK, Proposition.of(Predicate.GOAL, place=house))
    taken = intend(F.ACCEPT, Proposition.of(Predicate.GOAL, place=house, street=StreetName.UPLAND))
    said = in_one_breath([knows, heard, taken, way])
    assert [item.act for item in said] == [knows.act, taken.act]


def test_street_is_not_taken_on_where_the_place_is_unknown():
    unknown = Proposition.of(Predicate.TASK, place=LandmarkName.PERSON, status=GoalStatus.UNKNOWN)
    street = intend(F.ACCEPT, Proposition.of(Predicate.WILL, street=StreetName.UPLAND))
    lost = intend(F.INFORM, unknown)
    assert [item.act for item in in_one_breath([lost, street])] == [lost.act]


def test_order_leaves_only_answers_of_what_was_to_be_said():
    state, _ = start()
    yes = intend(F.AFFIRMATIVE_ANSWER, Proposition.of(Predicate.LOCALISED))
    blocked = intend(F.INFORM, Proposition.of(Predicate.POSSIBLE, action=A.J_TURN, negated=True))
    state.say(blocked, yes)
    assert still_due(state, (DialogueAct.of(M.EXPLAIN),)) == ((yes,), (blocked,))
    assert still_due(state, (DialogueAct.of(M.INSTRUCT, A.U_TURN),)) == ((yes,), ())


def test_mere_okay_does_not_mean_the_order_and_a_stop_is_promised():
    for seed in range(30):
        for action in (A.J_TURN, A.STOP):
            state, view = start()
            words = understand("turn left" if action is A.J_TURN else "stop here")
            acknowledge(state, view, action, words, np.random.default_rng(seed), answers=False)
            for item in state.speech.queue:
                assert not (item.act.move is M.ACKNOWLEDGE and item.meaning)
                assert action is not A.STOP or item.act.move is M.CONFIRM


@pytest.mark.parametrize(
    ("text", "friend"),
    [
        ("go to my friend Idris on Baits", "Idris"),
        ("our passenger Aunt Mei, please", "Aunt Mei"),
        ("my friend on Baits", None),
        ("my friend Lin's place", None),
    ],
)
def test_name_of_the_person_is_taken_up(text, friend):
    state, heard = heard_by_car(text, DialogueAct.of(M.INSTRUCT, LandmarkName.PERSON))
    note_friend(state, heard)
    assert state.beliefs.friend == friend


def test_name_is_dropped_with_the_errand():
    state, heard = heard_by_car("go to my friend Idris", DialogueAct.of(M.INSTRUCT, LandmarkName.PERSON))
    note_friend(state, heard)
    done = DialogueAct.of(M.EXPLAIN, GoalStatus.COMPLETE)
    _, other = heard_by_car("that's done, my friend on Beal", done, DialogueAct.of(M.INSTRUCT, LandmarkName.PERSON))
    note_friend(state, other)
    assert state.beliefs.friend is None


def test_purpose_of_an_errand_is_no_step_of_a_plan():
    acts = (DialogueAct.of(M.EXPLAIN), DialogueAct.of(M.INSTRUCT, LandmarkName.HOUSE))
    _, heard = heard_by_car("I need to collect Mila, Thabo's house on Division", *acts)
    assert len(heard.words.plan) == 2 and len(without_purposes(heard).words.plan) == 1
    _, way = heard_by_car("I need you to turn left, then right", DialogueAct.of(M.INSTRUCT, A.J_TURN))
    assert without_purposes(way) is way


def test_street_of_a_place_off_the_map_is_remembered():
    state, view = start()
    beal = (StreetName.BEAL,)
    state.beliefs = replace(state.beliefs, ruled_out=tuple(mark.place for mark in view.landmarks))
    set_goal(state, view, LandmarkName.HOUSE, beal, np.random.default_rng(0))
    assert state.beliefs.streets == beal
    state.speech = state.speech.cleared()
    set_goal(state, view, LandmarkName.HOUSE, (), np.random.default_rng(0))
    assert state.beliefs.streets == beal
    assert all(StreetName.QUERIED not in item.act.slots for item in state.speech.queue)


def test_crowd_that_was_mentioned_without_an_object_is_no_news():
    heard = Noticed().after_hearing(understand("look at that traffic"), 10.0)
    assert [at for _, at in heard.crowds] == [10.0]


# --- the participant --------------------------------------------------------------------------------------------------


def confirmed(human: Guide, words: str, *told: Remark) -> bool:
    human.state.speech = replace(human.state.speech, said=told, last=told[-1], last_end=human.view.time - 2.0, queue=())
    human.observation |= with_words(human.observation, Role.CO_WIZARD, words, DialogueAct.of(M.CONFIRM, A.J_TURN))
    heard = heard_utterance(human.view.raw, Role.CO_WIZARD)
    assert heard is not None
    return take_up_confirmation(human.state, human.view, heard, human.rng) and human.moves()[:1] == [M.CLARIFY]


@pytest.mark.parametrize(
    ("words", "corrects"),
    [
        ("Right, the next left, then the next right.", False),
        ("The next left, then the next right, got it.", False),
        ("The next left, got it.", False),
        ("The next right, then the next left.", True),
    ],
)
def test_only_another_way_is_corrected(words, corrects):
    way = turn(LEFT, "way_nth"), turn(RIGHT, "way_nth", joined=True)
    assert confirmed(Guide(60.0, speed=6.0), words, *way) is corrects
    newer = order(M.INSTRUCT, A.U_TURN)
    assert not confirmed(Guide(60.0, speed=6.0), words, *way, newer), "another order was given since"


def test_turn_behind_a_u_turn_is_no_turn_to_the_wrong_side():
    human = Guide(60.0, speed=6.0)
    told = order(M.INSTRUCT, A.U_TURN), turn(LEFT, "way_nth", joined=True)
    human.state.speech = replace(human.state.speech, said=told, last=told[-1], last_end=human.view.time - 2.0)
    act = DialogueAct.of(M.CONFIRM, A.J_TURN, A.U_TURN)
    human.observation |= with_words(human.observation, Role.CO_WIZARD, "Turn around, then the next left, sure.", act)
    listen(human.state, human.view, human.rng)
    assert M.CLARIFY not in human.moves()


def test_way_that_no_longer_holds_is_replaced_with_a_word_of_why():
    human = Guide(60.0, speed=6.0)
    told = turn(LEFT, "way_nth")
    for rerouted, said, moves in ((True, (told,), [M.EXPLAIN, M.INSTRUCT]), (True, (), [M.INSTRUCT])):
        human.state.guidance = replace(human.state.guidance, rerouted=rerouted)
        human.state.speech = replace(human.state.speech, said=said, queue=(turn(RIGHT),))
        own_up(human.state, human.view)
        assert human.moves() == moves and not human.state.guidance.rerouted


def test_first_drive_past_the_place_is_remarked_on():
    human = Guide(60.0, speed=6.0)
    human.state.guidance = replace(human.state.guidance, visits=1, slowed_early=True)
    human.state.route = replace(human.state.route, misses=1)
    remark_on_miss(human.state, human.view, passed=True)
    assert [said.predicate for item in human.state.speech.queue for said in item.meaning] == [Predicate.PASSED]
    note_said(human.state, human.view, turn(LEFT))
    note_said(human.state, human.view, human.state.speech.queue[0])
    assert human.state.guidance.given, "what was ordered still counts"


def test_order_to_turn_round_that_is_repeated_on_the_spot_counts_once():
    human = Guide(60.0, speed=6.0)
    round_ = order(M.INSTRUCT, A.U_TURN)
    for heading, times in ((0.0, 1), (0.0, 1), (3.0, 2)):
        human.observation["pose"] = human.observation["pose"] + np.array([0.0, 0.0, heading])
        note_said(human.state, human.view, round_)
        assert rounds_told(human.state) == times
    assert turned_round_lately(human.state, human.view)
    human.observation["time"] = human.observation["time"] + 60.0
    assert not turned_round_lately(human.state, human.view)


def test_nobody_complains_while_the_car_obeys():
    human = Guide(60.0, speed=6.0)
    note_said(human.state, human.view, order(M.INSTRUCT, A.U_TURN))
    before = human.state.speech
    stop_circling(human.state, human.view)
    assert human.state.speech is before
