import pytest

from dorothie_gym.dialogue import Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks.loops import has_loop
from dorothie_gym.ontology import ActionValue, DialogueMove, GoalStatus, LandmarkName
from tests.evaluation.analysis.builders import HUMAN, act, drive, human, said

M, A = DialogueMove, ActionValue


def turns_round(time: float):
    return human(time, "turn around", M.INSTRUCT, A.U_TURN)


def test_third_u_turn_on_a_street_is_a_loop():
    assert has_loop(drive(turns_round(5.0), turns_round(20.0), turns_round(35.0)))


def test_u_turns_of_two_errands_are_no_loop():
    done = human(30.0, "that's done", M.EXPLAIN, GoalStatus.COMPLETE)
    assert not has_loop(drive(turns_round(5.0), turns_round(20.0), done, turns_round(35.0)))


@pytest.mark.parametrize("words", ["we keep going back and forth", "that's the third time we do that"])
def test_remark_about_the_repetition_ends_a_loop(words):
    remark = human(30.0, words, M.EXPLAIN)
    assert not has_loop(drive(turns_round(5.0), turns_round(20.0), remark, turns_round(35.0)))


def test_remark_is_recognised_by_its_meaning():
    meaning = [Proposition.of(Predicate.PASSED, place=LandmarkName.KFC, times=2).to_json()]
    remark = human(30.0, "it's behind us", M.EXPLAIN, meaning=meaning)
    assert not has_loop(drive(turns_round(5.0), turns_round(20.0), remark, turns_round(35.0)))


def test_other_remarks_do_not_end_a_loop():
    remark = human(30.0, "it smells like rain", M.IRRELEVANT)
    assert has_loop(drive(turns_round(5.0), turns_round(20.0), remark, turns_round(35.0)))


def test_equal_turns_at_different_junctions_are_no_loop():
    orders = [human(time, "take the next right", M.INSTRUCT, A.J_TURN) for time in (5.0, 20.0, 35.0)]
    assert not has_loop(drive(*orders))


def test_equal_turns_before_one_junction_are_a_loop():
    orders = [human(time, "take the next right", M.INSTRUCT, A.J_TURN) for time in (5.0, 7.0, 9.0)]
    assert has_loop(drive(*orders))


def test_left_and_right_are_different_orders():
    sides = zip((5.0, 7.0, 9.0), ("right", "left", "right"), strict=True)
    assert not has_loop(drive(*(human(time, f"take the next {side}", M.INSTRUCT, A.J_TURN) for time, side in sides)))


def test_other_order_in_between_does_not_end_a_loop():
    other = human(22.0, "take the next right", M.INSTRUCT, A.J_TURN)
    assert has_loop(drive(turns_round(5.0), turns_round(20.0), other, turns_round(35.0)))
    assert not has_loop(drive(turns_round(5.0), turns_round(20.0), other))


def test_equal_turns_of_one_description_are_no_loop():
    way = said(5.0, HUMAN, *[("take the next right", act(M.INSTRUCT, A.J_TURN))] * 3)
    assert not has_loop(drive(way))
    again = [human(time, "take the next right", M.INSTRUCT, A.J_TURN) for time in (7.0, 9.0)]
    assert not has_loop(drive(way, again[0])) and has_loop(drive(way, *again))
