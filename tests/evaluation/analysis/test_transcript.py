from __future__ import annotations

from dorothie_gym.evaluation.analysis.transcript import markdown, transcript_lines
from dorothie_gym.ontology import ActionValue, GoalStatus, LandmarkName, MentalAction, PhysicalAction, Role
from tests.evaluation.analysis.builders import (
    M,
    act,
    believed,
    car,
    did,
    drive,
    exception,
    hazard,
    human,
    said,
    subgoal,
)
from tests.session.recording.builders import session


def test_lines_show_words_acts_units_and_handled_exceptions() -> None:
    played = drive(
        exception(1.0, "task_delete", subgoal=0, landmark="KFC", status="Abandoned"),
        said(
            2.0,
            Role.PARTICIPANT,
            ("No KFC,", act(M.INSTRUCT, LandmarkName.KFC, GoalStatus.ABANDONED)),
            ("left here", act(M.INSTRUCT, ActionValue.J_TURN)),
        ),
        car(5.0, "left it is", M.CONFIRM, ActionValue.J_TURN),
    )
    changed, first, answer = transcript_lines(played)
    assert (changed.speaker, changed.said) == (Role.AD_WIZARD, False) and changed.text.startswith("task delete: ")
    assert first.text == "No KFC, [Instruct(Status=Abandoned, Landmark=KFC)] left here [Instruct(Action=JTurn)]"
    assert (first.exchanges, first.transaction) == ("0 (task)", "0")
    assert (answer.time, answer.text, answer.exchanges) == (5.0, "left it is [Confirm(Action=JTurn)]", "0 (task)")


def test_actions_between_two_utterances_share_a_line() -> None:
    played = drive(
        human(1.0, "go", M.INSTRUCT, ActionValue.START),
        did(3.0, PhysicalAction.START),
        did(4.0, PhysicalAction.SPEED_CHANGE, up=True),
        did(4.5, PhysicalAction.SPEED_CHANGE, up=True),
        believed(5.0, MentalAction.STATUS_UPDATE, landmark="KFC", status="Ongoing"),
        believed(5.5, MentalAction.PLAN_UPDATE, junctions=[3]),
        did(6.0, PhysicalAction.J_TURN, angle=-80.0),
        hazard(7.0),
        subgoal(9.0, "KFC", "Complete"),
    )
    assert [line.text for line in transcript_lines(played)] == [
        "go [Instruct(Action=Start)]",
        "Start; SpeedChange up (2 times); StatusUpdate(KFC Ongoing); JTurn 80° right",
        "brakes for TrafficLight; errand 0 (KFC) is Complete",
    ]


def test_recognised_words_are_shown() -> None:
    (line,) = transcript_lines(drive(human(1.0, "to Ikea", M.INSTRUCT, LandmarkName.IKEA, recognised="to a key")))
    assert line.text.endswith('(heard: "to a key")')


def test_a_page_has_a_head_and_a_table_and_no_stray_markup() -> None:
    page = markdown(
        drive(human(1.0, "a|b *c* <i>", M.INSTRUCT, LandmarkName.KFC), car(3.0, "fine", M.ACKNOWLEDGE)), "One"
    )
    assert page.startswith("## One\n\n- Town crossing, storyboard errand, seed 7, ")
    assert "- Errand 1: home (House, hidden from the car)" in page and "- Phenomena (count): 1 (1)." in page
    assert "| 1.0 | Participant | a\\|b \\*c\\* \\<i\\> [Instruct(Landmark=KFC)] | 0 | 0 |" in page


def test_silence_is_a_page_too() -> None:
    assert markdown(session()).endswith("| --- | --- | --- | --- | --- |\n")


def test_numbers_of_exceptions_have_one_decimal() -> None:
    played = drive(exception(1.0, "spawn_vehicles", count=7, x0=2.2570158036189447, x1=52.0))
    (line,) = transcript_lines(played)
    assert line.text == "spawn vehicles: count 7, x0 2.3, x1 52"
