"""Checks of the sense of what is said, on small dialogues made by hand."""

from __future__ import annotations

from dorothie_gym.dialogue import Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks import sense_checks
from dorothie_gym.ontology import ObjectClass
from tests.evaluation.analysis.builders import CAR, A, M, act, car, drive, human, said, subgoal
from tests.evaluation.analysis.test_talk_faults import wrong


def test_two_plain_signs_in_one_utterance_are_one_too_many():
    once = said(1.0, CAR, ("okay", act(M.ACKNOWLEDGE)), ("left", act(M.EXPLAIN, A.J_TURN)))
    twice = said(1.0, CAR, ("okay", act(M.ACKNOWLEDGE)), ("will do", act(M.CONFIRM)))
    assert not wrong(sense_checks.signs(drive(once))) and wrong(sense_checks.signs(drive(twice)))


def test_order_given_again_right_after_its_confirmation_is_a_fault():
    first = human(1.0, "the next left", M.INSTRUCT, A.J_TURN)
    yes = car(3.0, "the next left, okay", M.CONFIRM, A.J_TURN)
    again, other = (human(6.0, words, M.CLARIFY, A.J_TURN) for words in ("I said the next left", "I said right"))
    late = human(30.0, "the next left", M.INSTRUCT, A.J_TURN)
    assert wrong(sense_checks.orders_after_confirmation(drive(first, yes, again)))
    assert not wrong(sense_checks.orders_after_confirmation(drive(first, yes, other)))
    assert not wrong(sense_checks.orders_after_confirmation(drive(first, yes, late)))


def test_question_about_ones_own_order_is_a_fault():
    turns = Proposition.of(Predicate.DOES, action=A.U_TURN)
    because = Proposition.of(Predicate.BECAUSE, effect=turns)
    why = human(8.0, "why are you turning around?", M.QUERY_W, A.U_TURN, meaning=[because.to_json()])
    assert wrong(sense_checks.own_doing(drive(human(1.0, "turn around", M.INSTRUCT, A.U_TURN), why)))
    assert not wrong(sense_checks.own_doing(drive(why)))


def test_second_order_to_drive_on_a_little_is_a_fault():
    stop = human(1.0, "stop here", M.INSTRUCT, A.STOP)
    bits = [human(5.0 + 4.0 * number, "a bit further", M.INSTRUCT, A.LANE_FOLLOW) for number in range(2)]
    assert not wrong(sense_checks.arrivals_without_creeping(drive(stop, bits[0], subgoal(20.0, "KFC", "Complete"))))
    assert wrong(sense_checks.arrivals_without_creeping(drive(stop, *bits, subgoal(20.0, "KFC", "Complete"))))


def test_remark_on_a_crowd_that_was_just_made_is_no_news():
    many = Proposition.of(Predicate.CROWDED, object=ObjectClass.VEHICLES)
    remarks = [car(time, "so many cars", M.EXPLAIN, meaning=[many.to_json()]) for time in (1.0, 30.0, 120.0)]
    assert len(wrong(sense_checks.crowds(drive(*remarks)))) == 1
