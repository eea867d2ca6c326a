"""For each phenomenon a talk that has it and one that comes close and has it not."""

from __future__ import annotations

import pytest

from dorothie_gym.evaluation.analysis import PHENOMENA, DialogueView, Phenomenon
from dorothie_gym.ontology import (
    LandmarkName,
    MentalAction,
    PhysicalAction,
    StreetName,
)
from tests.evaluation.analysis.builders import (
    BAITS,
    CAR,
    COCO,
    FULLER,
    HOUSE,
    HUMAN,
    IKEA,
    KFC,
    OBJ,
    TURNED,
    A,
    M,
    Make,
    S,
    act,
    believed,
    car,
    did,
    exception,
    hazard,
    human,
    said,
    subgoal,
    talk,
)
from tests.evaluation.analysis.decoys import DECOYS, OTHERS


def _misheard(answer: LandmarkName) -> DialogueView:
    return talk(
        human(1.0, "drive up to ikea", M.INSTRUCT, IKEA, recognised="drive up to a key"),
        car(4.0, "on the way to that one", M.CONFIRM, answer),
        human(7.0, "ikea was what I meant", M.CLARIFY, IKEA),
    )


def _roadblock(*, anew: bool) -> DialogueView:
    return talk(
        exception(1.0, "place_prop", x=60.0, y=0.0),
        car(8.0, "something lies across our lane", M.EXPLAIN, OBJ.STATIC),
        car(11.0, "do we try a different street", M.QUERY_YN, A.J_TURN),
        human(14.0, "try Fuller then", M.INSTRUCT, FULLER),
        believed(16.0, MentalAction.PLAN_UPDATE, junctions=[1]) if anew else [],
    )


PRESENT: dict[int, tuple[str, Make]] = {
    1: ("goal", lambda: talk(human(1.0, "KFC first", M.INSTRUCT, KFC), car(3.0, "on it", M.ACKNOWLEDGE))),
    2: ("step", lambda: talk(human(1.0, "bear left", M.INSTRUCT, A.J_TURN), car(3.0, "sure", M.ACKNOWLEDGE))),
    3: ("two acts", lambda: talk(said(1.0, HUMAN, ("yep", act(M.REPLY_Y)), ("now right", act(M.INSTRUCT, A.J_TURN))))),
    4: (
        "answered",
        lambda: talk(car(1.0, "left or right", M.QUERY_W, A.QUERIED), human(3.0, "left", M.REPLY_W, A.J_TURN), TURNED),
    ),
    5: ("unsure", lambda: talk(car(1.0, "drive on", M.QUERY_YN, A.LANE_FOLLOW), human(3.0, "who knows", M.REPLY_U))),
    6: ("denied", lambda: talk(car(1.0, "KFC, then", M.CHECK, KFC), human(3.0, "nope", M.REPLY_N))),
    7: (
        "repaired",
        lambda: talk(
            human(1.0, "got me", M.ALIGN),
            car(3.0, "come again", M.CONFUSE),
            human(5.0, "I asked for Fuller", M.CLARIFY, FULLER),
        ),
    ),
    8: (
        "described, refined",
        lambda: talk(
            car(1.0, "I can't find your house", M.EXPLAIN, HOUSE, S.UNKNOWN),
            human(4.0, "on Fuller, behind KFC", M.REPLY_W, StreetName.FULLER, KFC),
            believed(6.0, MentalAction.KNOWLEDGE_UPDATE, landmark="House", x=1.0, y=2.0),
            human(20.0, "some metres more", M.INSTRUCT, A.LANE_FOLLOW),
        ),
    ),
    9: ("proposed", lambda: _roadblock(anew=True)),
    10: (
        "slower",
        lambda: talk(
            exception(1.0, "weather", parameter="fog_density", value=80.0),
            human(4.0, "take it easy", M.INSTRUCT, A.SPEED_CHANGE),
            did(5.0, PhysicalAction.SPEED_CHANGE, up=False),
        ),
    ),
    11: (
        "negotiated",
        lambda: talk(
            exception(1.0, "task_trigger", subgoal=1, landmark="Ikea", status="Ongoing"),
            human(4.0, "there's Ikea too", M.INSTRUCT, IKEA, S.PENDING),
            car(7.0, "now or later", M.QUERY_W, S.QUERIED),
            human(10.0, "later", M.REPLY_W, S.PENDING),
        ),
    ),
    12: (
        "both named",
        lambda: talk(
            exception(1.0, "task_change", subgoal=0, landmark="Coco", status="Ongoing"),
            human(4.0, "no Ikea today, Coco", M.INSTRUCT, IKEA, COCO, S.ABANDONED, S.ONGOING),
            car(7.0, "Coco it is", M.CONFIRM, COCO),
        ),
    ),
    13: (
        "resumed",
        lambda: talk(
            exception(1.0, "task_delete", subgoal=0, landmark="KFC", status="Abandoned"),
            human(4.0, "leave KFC out", M.EXPLAIN, KFC, S.ABANDONED),
            human(30.0, "on second thoughts, KFC", M.INSTRUCT, KFC),
        ),
    ),
    14: ("reported", lambda: talk(subgoal(5.0, "KFC", "Complete"), human(7.0, "that's lunch", M.EXPLAIN, S.COMPLETE))),
    15: (
        "not seen",
        lambda: talk(
            human(1.0, "is a walker ahead", M.QUERY_YN, OBJ.PEDESTRIAN), car(3.0, "none that I can see", M.REPLY_N)
        ),
    ),
    16: (
        "explained",
        lambda: talk(
            hazard(1.0),
            human(2.0, "why are we standing", M.QUERY_W, A.STOP),
            car(4.0, "the light is red", M.REPLY_W, OBJ.TRAFFIC_LIGHT),
        ),
    ),
    17: (
        "described",
        lambda: talk(
            human(1.0, "which way are we going", M.QUERY_W, A.QUERIED),
            car(3.0, "along Fuller, then a left", M.REPLY_W, FULLER, A.J_TURN),
        ),
    ),
    18: (
        "corrected",
        lambda: talk(
            did(5.0, PhysicalAction.J_TURN, angle=80.0),
            human(8.0, "that was wrong", M.EXPLAIN),
            did(12.0, PhysicalAction.U_TURN),
        ),
    ),
    19: (
        "both answered",
        lambda: talk(
            human(1.0, "take Baits", M.INSTRUCT, BAITS),
            car(1.5, "what street", M.QUERY_W, StreetName.QUERIED),
            human(4.0, "Baits", M.REPLY_W, BAITS),
            car(6.0, "Baits it is", M.ACKNOWLEDGE),
        ),
    ),
    20: ("human", lambda: talk(human(1.0, "I love this song", M.IRRELEVANT))),
    21: (
        "asked again",
        lambda: talk(
            car(1.0, "which way", M.QUERY_W, A.QUERIED),
            car(16.0, "where do I turn here", M.QUERY_W, A.QUERIED),
            human(18.0, "left", M.REPLY_W, A.J_TURN),
        ),
    ),
    22: ("human", lambda: talk(human(1.0, "right at the next one", M.INSTRUCT, A.J_TURN))),
    23: (
        "insisted",
        lambda: talk(
            exception(0.0, "place_prop", x=30.0, y=0.0),
            said(
                3.0, CAR, ("Baits is jammed", act(M.EXPLAIN, BAITS)), ("shall we use Fuller", act(M.QUERY_YN, FULLER))
            ),
            human(6.0, "no", M.REPLY_N),
        ),
    ),
    24: ("misunderstood", lambda: _misheard(KFC)),
}

ABSENT: dict[int, Make] = {
    1: lambda: talk(human(1.0, "KFC first", M.INSTRUCT, KFC), car(30.0, "on it", M.ACKNOWLEDGE)),
    2: lambda: talk(human(1.0, "left to KFC", M.INSTRUCT, A.J_TURN, KFC), car(3.0, "sure", M.ACKNOWLEDGE)),
    3: lambda: talk(said(1.0, CAR, ("okay", act(M.ACKNOWLEDGE)), ("turning", act(M.EXPLAIN, A.J_TURN)))),
    4: lambda: talk(car(1.0, "which place", M.QUERY_W, LandmarkName.QUERIED), human(3.0, "KFC", M.REPLY_W, KFC)),
    5: lambda: talk(human(1.0, "drive on", M.QUERY_YN, A.LANE_FOLLOW), car(3.0, "yes", M.REPLY_Y)),
    6: lambda: talk(car(1.0, "KFC, then", M.CHECK, KFC), human(3.0, "left", M.INSTRUCT, A.J_TURN)),
    7: lambda: talk(human(1.0, "got me", M.ALIGN), car(3.0, "come again", M.CONFUSE)),
    8: lambda: talk(
        car(1.0, "I can't find your house", M.EXPLAIN, HOUSE, S.UNKNOWN),
        human(4.0, "on Fuller", M.REPLY_W, FULLER),
    ),
    9: lambda: _roadblock(anew=False),
    10: lambda: talk(
        human(1.0, "take it easy", M.INSTRUCT, A.SPEED_CHANGE),
        car(3.0, "fine", M.ACKNOWLEDGE),
        exception(10.0, "weather", parameter="fog_density", value=80.0),
    ),
    11: lambda: talk(
        human(1.0, "Ikea", M.INSTRUCT, IKEA),
        car(3.0, "fine", M.ACKNOWLEDGE),
        exception(10.0, "task_trigger", subgoal=1, landmark="Ikea", status="Ongoing"),
    ),
    12: lambda: talk(
        exception(1.0, "task_change", subgoal=0, landmark="Coco", status="Ongoing"),
        human(4.0, "Coco", M.INSTRUCT, COCO),
        car(7.0, "fine", M.CONFIRM, COCO),
    ),
    13: lambda: talk(
        exception(1.0, "task_delete", subgoal=0, landmark="KFC", status="Abandoned"),
        human(4.0, "leave Ikea out", M.EXPLAIN, IKEA, S.ABANDONED),
    ),
    14: lambda: talk(human(1.0, "that's lunch", M.EXPLAIN, S.COMPLETE), subgoal(5.0, "KFC", "Complete")),
    15: lambda: talk(human(1.0, "is KFC open", M.QUERY_YN, KFC), car(3.0, "no idea", M.REPLY_N)),
    16: lambda: talk(
        human(1.0, "what is that", M.QUERY_W, OBJ.QUERIED), car(3.0, "a light", M.REPLY_W, OBJ.TRAFFIC_LIGHT)
    ),
    17: lambda: talk(human(1.0, "why this way", M.QUERY_W, A.QUERIED), car(3.0, "a jam", M.REPLY_W, FULLER)),
    18: lambda: talk(human(8.0, "that was wrong", M.EXPLAIN), car(10.0, "sorry", M.ACKNOWLEDGE)),
    19: lambda: talk(
        human(1.0, "take Baits", M.INSTRUCT, BAITS),
        car(4.0, "what street", M.QUERY_W, StreetName.QUERIED),
        human(7.0, "Baits", M.REPLY_W, BAITS),
        car(10.0, "Baits it is", M.ACKNOWLEDGE),
    ),
    20: lambda: talk(human(1.0, "I need petrol", M.EXPLAIN)),
    21: lambda: talk(car(1.0, "which way", M.QUERY_W, A.QUERIED), human(6.0, "left", M.REPLY_W, A.J_TURN)),
    22: lambda: talk(human(1.0, "there is fog out there", M.EXPLAIN), car(4.0, "hello there", M.IRRELEVANT)),
    23: lambda: talk(car(3.0, "shall we use Fuller", M.QUERY_YN, FULLER), human(6.0, "no", M.REPLY_N)),
    24: lambda: _misheard(IKEA),
}


def phenomenon(number: int) -> Phenomenon:
    return next(each for each in PHENOMENA if each.number == number)


def test_there_are_the_24_of_the_spec() -> None:
    assert [each.number for each in PHENOMENA] == list(range(1, 25)) == sorted(PRESENT) == sorted(ABSENT)


@pytest.mark.parametrize("number", PRESENT)
def test_it_is_found_where_it_is(number: int) -> None:
    form, make = PRESENT[number]
    findings = list(phenomenon(number).find(make()))
    assert [finding.form for finding in findings] == [form]
    assert form in phenomenon(number).forms


@pytest.mark.parametrize(("number", "form", "make"), OTHERS, ids=[f"{k} {form}" for k, form, _ in OTHERS])
def test_forms_of_a_phenomenon_are_distinguished(number: int, form: str, make: Make) -> None:
    assert [finding.form for finding in phenomenon(number).find(make())] == [form]


@pytest.mark.parametrize(
    ("number", "make"), [(k, make) for k, _, make in DECOYS], ids=[f"{k} {why}" for k, why, _ in DECOYS]
)
def test_similar_dialogue_is_not_found(number: int, make: Make) -> None:
    assert list(phenomenon(number).find(make())) == []


def test_every_form_has_an_example() -> None:
    shown = {(number, form) for number, (form, _) in PRESENT.items()} | {(number, form) for number, form, _ in OTHERS}
    missing = {(each.number, form) for each in PHENOMENA for form in each.forms} - shown
    assert missing == {(5, "no"), (8, "described")}, "which only differ in a word from those that are there"


@pytest.mark.parametrize("number", ABSENT)
def test_phenomenon_with_a_missing_part_is_not_found(number: int) -> None:
    assert list(phenomenon(number).find(ABSENT[number]())) == []


@pytest.mark.parametrize("number", [4, 8, 9, 10, 11, 12, 13, 14, 16, 18, 21, 23, 24])
def test_a_cause_in_the_world_is_seen(number: int) -> None:
    quiet = talk(human(1.0, "hi", M.IRRELEVANT), subgoals=(), seconds=20.0)
    assert phenomenon(number).has_cause(PRESENT[number][1]())
    assert not phenomenon(number).has_cause(quiet)


def test_roadblock_that_is_never_met_is_no_cause() -> None:
    assert not phenomenon(9).has_cause(talk(exception(1.0, "place_prop", x=-900.0, y=0.0)))


def test_fog_that_lifts_is_no_cause() -> None:
    assert not phenomenon(10).has_cause(talk(exception(1.0, "weather", parameter="fog_density", value=2.0)))
    assert not phenomenon(10).has_cause(talk(exception(1.0, "weather", parameter="cloudiness", value=90.0)))
    assert not phenomenon(10).has_cause(talk(exception(55.0, "weather", parameter="fog_density", value=90.0)))


def test_an_errand_that_is_dropped_at_the_very_end_leaves_no_time_to_tell() -> None:
    assert not phenomenon(13).has_cause(talk(exception(55.0, "task_delete", landmark="KFC")))


def test_stored_tags_do_not_change_the_findings() -> None:
    asked = car(1.0, "which way", M.QUERY_W, A.QUERIED, exchange=99, transaction=7, phenomenon=4)
    answered = human(3.0, "left", M.REPLY_W, A.J_TURN, exchange=12, transaction=8)
    assert [finding.turn.text for finding in phenomenon(4).find(talk(asked, answered))] == ["which way"]
    assert list(phenomenon(21).find(talk(asked, answered))) == []
