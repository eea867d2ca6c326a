"""Each check of the talk finds its fault in a small dialogue made by hand, and accepts a sensible one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.dialogue import Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks import (
    laps,
    mention_checks,
    order_checks,
    passenger_checks,
    repair_runs,
    reply_checks,
)
from dorothie_gym.evaluation.analysis.truth_checks.checks import SHARES, TalkChecks, check_session
from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.session.recording import Session
from tests.evaluation.analysis.builders import (
    CAR,
    FULLER,
    HOUSE,
    HUMAN,
    KFC,
    A,
    M,
    S,
    act,
    car,
    did,
    drive,
    hazard,
    hazard_over,
    human,
    said,
    subgoal,
)

P = Predicate
PERSON = type(KFC).PERSON
TWO_HOUSES = (
    {"name": "House", "lane": 3, "station": 12.5, "x": 10.0, "y": -4.0, "street": 1, "hidden": False},
    {"name": "House", "lane": 5, "station": 1.0, "x": 90.0, "y": 44.0, "street": 1, "hidden": True},
)


def wrong(cases) -> list[str]:
    return [case.words for case in cases if not case.right]


def what(time: float, speaker: str = "car"):
    return (car if speaker == "car" else human)(time, "what?", M.CONFUSE, seconds=0.6)


def standing(session: Session, since: float = 0.0) -> Session:
    """The session of a car that does not move after a time [s]."""
    rows = session.trajectory.copy()
    stop = rows["frame"] >= since * 30
    rows["x"][stop] = rows["x"][stop][0]
    return replace(session, trajectory=rows)


# --- repairs ----------------------------------------------------------------------------------------------------------


def test_fifth_turn_of_a_repair_is_one_too_many():
    left = [human(time, f"left {words}", M.INSTRUCT, A.J_TURN) for time, words in ((1.0, ""), (5.0, "I said"))]
    four = [left[0], what(3.0), left[1], car(7.0, "pardon?", M.CONFUSE), human(9.0, "left", M.CLARIFY, A.J_TURN)]
    assert not wrong(repair_runs.lengths(drive(*four)))
    assert wrong(repair_runs.lengths(drive(*four, car(11.0, "sorry?", M.CONFUSE))))


def test_pause_ends_a_repair():
    turns = [what(3.0 + 20.0 * number) for number in range(3)]
    answers = [human(5.0 + 20.0 * number, "turn left", M.CLARIFY, A.J_TURN) for number in range(3)]
    assert not wrong(repair_runs.lengths(drive(*turns, *answers)))


def test_repair_in_equal_words_is_found():
    asked, again = what(3.0), human(5.0, "turn left", M.CLARIFY, A.J_TURN)
    assert wrong(repair_runs.wordings(drive(asked, again, what(7.0)))) == ["what? / what?"]
    assert not wrong(repair_runs.wordings(drive(asked, again, car(7.0, "did you say left?", M.CONFUSE, A.J_TURN))))


def test_request_to_repeat_is_not_met_with_another():
    assert wrong(repair_runs.replies_to_repairs(drive(what(3.0), what(5.0, "human"))))
    assert not wrong(repair_runs.replies_to_repairs(drive(what(3.0), human(5.0, "to the KFC", M.CLARIFY, KFC))))


# --- orders -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", ["go on for twenty meters", "a bit further"])
def test_distance_said_three_times_to_a_standing_car_is_found(words):
    orders = [human(time, words, M.INSTRUCT, A.LANE_FOLLOW) for time in (5.0, 15.0, 25.0)]
    assert wrong(order_checks.nudges(standing(drive(*orders))))
    assert not wrong(order_checks.nudges(standing(drive(*orders[:2]))))
    assert not wrong(order_checks.nudges(drive(*orders))), "the car drives on in between"


def test_order_in_equal_words_for_the_third_time_is_found():
    orders = [human(time, "to the left", M.REPLY_W, A.J_TURN) for time in (5.0, 15.0, 25.0)]
    other = human(25.0, "left here, please", M.REPLY_W, A.J_TURN)
    assert wrong(order_checks.unchanged(standing(drive(*orders))))
    assert not wrong(order_checks.unchanged(standing(drive(*orders[:2], other))))


LEFT = human(5.0, "turn left", M.INSTRUCT, A.J_TURN)
RIGHT = human(9.0, "turn right", M.INSTRUCT, A.J_TURN)


def test_order_that_is_reversed_without_a_word_is_found():
    assert wrong(order_checks.reversals(drive(LEFT, RIGHT))) == ["turn left / turn right"]
    assert wrong(order_checks.reversals(drive(LEFT, human(9.0, "turn around", M.INSTRUCT, A.U_TURN))))


@pytest.mark.parametrize(
    "why",
    [
        human(9.0, "sorry, turn right", M.INSTRUCT, A.J_TURN),
        human(9.0, "turn right instead", M.INSTRUCT, A.J_TURN),
        said(9.0, HUMAN, ("that was wrong", act(M.EXPLAIN)), ("turn right", act(M.INSTRUCT, A.J_TURN))),
    ],
)
def test_reversal_with_a_word_of_why_is_accepted(why):
    assert not wrong(order_checks.reversals(drive(LEFT, why)))


def test_next_turn_is_no_reversal():
    assert not wrong(order_checks.reversals(drive(LEFT, did(7.5, PhysicalAction.J_TURN, angle=80.0), RIGHT)))
    at_once = did(5.5, PhysicalAction.J_TURN, angle=80.0)  # while the order is being said
    assert not wrong(order_checks.reversals(drive(LEFT, at_once, RIGHT)))
    late = human(20.0, "turn right", M.INSTRUCT, A.J_TURN)
    assert not wrong(order_checks.reversals(drive(LEFT, late)))
    blocked = car(7.0, "the road is blocked", M.QUERY_YN)
    assert not wrong(order_checks.reversals(drive(LEFT, blocked, RIGHT)))


def circling(rounds: float) -> Session:
    """The session of a car that drives a circle of 200 m."""
    session = drive(seconds=40.0 * rounds)
    rows = session.trajectory.copy()
    angle = np.arange(len(rows)) / len(rows) * rounds * 2.0 * np.pi
    rows["x"], rows["y"] = 32.0 * np.cos(angle), 32.0 * np.sin(angle)
    rows["heading"] = np.mod(angle + np.pi / 2.0 + np.pi, 2.0 * np.pi) - np.pi
    return replace(session, trajectory=rows)


def test_third_lap_is_found():
    assert wrong(laps.laps(circling(3.0)))
    assert not wrong(laps.laps(circling(2.0)))
    assert not wrong(laps.laps(drive(seconds=120.0)))


# --- replies ----------------------------------------------------------------------------------------------------------

WHICH_WAY = car(5.0, "which way now?", M.QUERY_W, A.QUERIED)


def test_question_without_an_answer_is_found():
    assert wrong(reply_checks.answers_given(drive(WHICH_WAY, human(30.0, "left", M.INSTRUCT, A.J_TURN))))
    assert not wrong(reply_checks.answers_given(drive(WHICH_WAY, human(9.0, "left", M.REPLY_W, A.J_TURN))))
    assert not list(reply_checks.answers_given(drive(WHICH_WAY, seconds=8.0))), "the session is over"


def test_yes_does_not_answer_an_open_question():
    assert wrong(reply_checks.forms_of_answers(drive(WHICH_WAY, human(7.0, "yes", M.REPLY_Y))))
    assert not wrong(reply_checks.forms_of_answers(drive(WHICH_WAY, human(7.0, "left", M.REPLY_W, A.J_TURN))))
    sure = car(5.0, "is this it?", M.QUERY_YN)
    assert not wrong(reply_checks.forms_of_answers(drive(sure, human(7.0, "yes", M.REPLY_Y))))


def test_request_is_not_refused_by_a_bare_no():
    request = human(5.0, "could you turn left?", M.INSTRUCT, A.J_TURN)
    offer = said(7.5, CAR, ("no, there's no road", act(M.REPLY_N)), ("shall I turn round?", act(M.QUERY_YN, A.U_TURN)))
    assert wrong(reply_checks.refusals(drive(request, car(7.5, "no, sorry", M.REPLY_N))))
    assert not wrong(reply_checks.refusals(drive(request, offer)))


# --- mentions ---------------------------------------------------------------------------------------------------------


def test_repetition_that_has_not_happened_is_a_stale_remark():
    twice = [Proposition.of(P.TRIED, action=A.U_TURN, times=2).to_json()]
    remark = human(30.0, "we keep going back and forth", M.EXPLAIN, meaning=twice)
    turns = [human(time, "turn around", M.INSTRUCT, A.U_TURN) for time in (5.0, 15.0)]
    assert wrong(mention_checks.stale_remarks(drive(turns[0], remark)))
    assert not wrong(mention_checks.stale_remarks(drive(*turns, remark)))
    for cause, stale in (("task_trigger", False), ("arrival", True)):
        change = subgoal(20.0, "KFC", "Ongoing", cause=cause)
        assert bool(wrong(mention_checks.stale_remarks(drive(*turns, change, remark)))) is stale


def test_place_that_was_not_passed_twice_makes_a_stale_remark():
    twice = [Proposition.of(P.PASSED, place=KFC, times=2).to_json()]
    remark = human(30.0, "we've passed it again", M.EXPLAIN, meaning=twice)
    assert wrong(mention_checks.stale_remarks(drive(remark)))
    once = [Proposition.of(P.PASSED, place=KFC, times=1).to_json()]
    assert not wrong(mention_checks.stale_remarks(drive(human(30.0, "we've passed it", M.EXPLAIN, meaning=once))))


def test_house_is_named_so_that_it_is_clear_which():
    people = {"landmarks": TWO_HOUSES, "story": "Hungry people visit Mateo."}
    vague = human(5.0, "that house on Fuller", M.INSTRUCT, HOUSE, FULLER)
    clear = human(5.0, "Mateo's house on Fuller", M.INSTRUCT, HOUSE, FULLER)
    again = human(15.0, "to the house", M.INSTRUCT, HOUSE)
    assert wrong(mention_checks.references(drive(vague, **people)))
    assert not wrong(mention_checks.references(drive(clear, again, **people)))
    assert not wrong(mention_checks.references(drive(vague))), "there is one house"


def test_person_is_no_it():
    coat = [Proposition.of(P.LOOKS, place=PERSON, feature="a yellow coat").to_json()]
    it = human(5.0, "it has a yellow coat", M.EXPLAIN, meaning=coat)
    she = human(5.0, "look for a yellow coat", M.EXPLAIN, meaning=coat)
    assert wrong(mention_checks.pronouns(drive(it)))
    heard = human(5.0, "a yellow coat, got it", M.EXPLAIN, meaning=coat)
    assert not wrong(mention_checks.pronouns(drive(she)))
    assert not wrong(mention_checks.pronouns(drive(heard)))


def test_metres_of_a_passenger_are_found():
    close = [Proposition.of(P.CLOSE, place=HOUSE).to_json()]
    counted = human(5.0, "the house is forty meters ahead", M.EXPLAIN, HOUSE, meaning=close)
    told = human(5.0, "the house is just ahead", M.EXPLAIN, HOUSE, meaning=close)
    order = human(9.0, "go straight for four meters", M.INSTRUCT, A.LANE_FOLLOW)
    assert wrong(passenger_checks.ways_without_metres(drive(counted, order))) == [
        "the house is forty meters ahead",
        "go straight for four meters",
    ]
    assert not wrong(passenger_checks.ways_without_metres(drive(told)))


def test_question_why_the_car_stands_after_an_order_to_stop_is_found():
    stands = [Proposition.of(P.STANDS, action=A.STOP).to_json()]
    stop = human(5.0, "stop", M.INSTRUCT, A.STOP)
    why = human(15.0, "why are we standing?", M.QUERY_W, A.STOP, meaning=stands)
    drive_on = human(10.0, "drive on", M.INSTRUCT, A.START)
    assert wrong(passenger_checks.own_stops(drive(stop, why)))
    assert not wrong(passenger_checks.own_stops(drive(stop, drive_on, why)))
    assert not wrong(passenger_checks.own_stops(drive(why)))


def test_destination_that_was_told_is_not_asked_for():
    where = car(12.0, "where to next?", M.QUERY_W, type(KFC).QUERIED)
    told = human(8.0, "to the KFC", M.INSTRUCT, KFC)
    later = human(8.0, "the KFC comes later", M.INSTRUCT, KFC, S.PENDING)
    assert wrong(passenger_checks.destinations_asked_for(drive(told, where)))
    assert not wrong(passenger_checks.destinations_asked_for(drive(later, where)))
    assert not wrong(passenger_checks.destinations_asked_for(drive(where)))


# --- figures ----------------------------------------------------------------------------------------------------------


def test_passages_at_fault_are_listed_with_session_and_time():
    checks = TalkChecks()
    check_session(checks, drive(what(3.0), what(5.0, "human")), None, "0007-here")
    assert checks.share("repair_replies") == 0.0
    fault = next(fault for fault in checks.faults if fault["figure"] == "repair_replies")
    assert (fault["session"], fault["time"], fault["words"]) == ("0007-here", 3.0, "what? / what?")
    assert {str(fault["figure"]) for fault in checks.faults} <= set(SHARES)
    assert checks.to_json()["faults"] == checks.faults


def test_done_errands_begin_new_groups_of_orders():
    orders = [human(time, "stop", M.INSTRUCT, A.STOP) for time in (5.0, 15.0)]
    done = human(20.0, "that's done", M.EXPLAIN, S.COMPLETE)
    moved = human(30.0, "stop", M.INSTRUCT, A.STOP)
    assert not wrong(order_checks.unchanged(drive(*orders, done, moved)))


def test_obstacle_that_took_the_place_of_a_red_light_is_a_reason_too():
    recorded = drive(hazard(10.0), hazard_over(20.0, "Vehicles"), hazard(40.0), hazard_over(45.0, "TrafficLight"))
    world = SessionWorld(recorded, load_town("brookside"))
    assert world.hazards(15.0, 0.0) == {"TrafficLight", "Vehicles"}
    assert world.hazards(30.0, 0.0) == set(), "the first one is over"
    assert world.hazards(42.0, 0.0) == {"TrafficLight"}
