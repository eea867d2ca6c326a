from dataclasses import replace

from dorothie_gym.dialogue import Predicate, Proposition
from dorothie_gym.evaluation.analysis.truth_checks.checks import TalkChecks, check_session
from dorothie_gym.evaluation.analysis.truth_checks.directions import GivenDirection, directions_of, manner_of
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName
from tests.evaluation.analysis.builders import drive, human

M, A = DialogueMove, ActionValue


def will(action: ActionValue, place: LandmarkName | None = None) -> dict[str, object]:
    return Proposition.of(Predicate.WILL, action=action, place=place).to_json()


def directions(*events):
    return list(directions_of(drive(*events)))


def test_steps_and_places_of_a_direction_are_counted():
    rows = [will(A.J_TURN, LandmarkName.KFC), will(A.LANE_FOLLOW)]
    assert directions(human(5.0, "left at the KFC, then straight on", M.INSTRUCT, A.J_TURN, meaning=rows)) == [
        GivenDirection(steps=2, names_place=True)
    ]


def test_directions_are_counted_by_the_manner_of_the_persona():
    rows = [will(A.J_TURN, LandmarkName.KFC), will(A.LANE_FOLLOW)]
    session = drive(human(5.0, "left at the KFC, then straight on", M.INSTRUCT, A.J_TURN, meaning=rows))
    assert manner_of(session) is None
    extra = {**session.header.extra, "personas": {"participant": {"directions": "landmarks"}}}
    session = replace(session, header=replace(session.header, extra=extra))
    assert manner_of(session) == "landmarks"
    checks = TalkChecks()
    check_session(checks, session, None)
    shares = {title: share for title, share, _ in checks.rows() if "landmarks" in title}
    assert len(shares) == 2 and set(shares.values()) == {1.0}
    assert checks.to_json()["directions/landmarks/ahead_n"] == 1


def test_other_orders_and_remarks_are_no_directions():
    slower = human(5.0, "slow down", M.INSTRUCT, A.SPEED_CHANGE, meaning=[will(A.SPEED_CHANGE)])
    remark = human(9.0, "we turned left", M.EXPLAIN, A.J_TURN, meaning=[will(A.J_TURN)])
    assert directions(slower, remark) == []
