from __future__ import annotations

import math
from dataclasses import replace

import pytest

from dorothie_gym.archive import (
    Task,
    corpus_points,
    final_view,
    history_angle,
    nfd_points,
    rfn_points,
    task_points,
    ufn_points,
    unpointed_events,
)
from dorothie_gym.ontology import PhysicalAction, Role
from tests.session.recording.builders import physical, session, utterance
from tests.session.recording.dialogues import DONE, OKAY, STREET, TO_KFC, TURNING, YES, talk


def test_every_flagged_event_is_a_point_once() -> None:
    talked = session(talk())
    assert [point.act for point in ufn_points(talked)] == [TO_KFC, YES, STREET, DONE]
    assert [point.act for point in rfn_points(talked)] == [OKAY, TURNING, OKAY]
    assert [point.action.label for point in nfd_points(talked)] == ["Start", "JTurn", "UTurn", "JTurn", "Stop"]


def test_points_of_a_corpus_come_session_by_session() -> None:
    names = [point.view.session for point in corpus_points([session(talk()), session(talk(), name="two")], Task.RFN)]
    assert names == ["one"] * 3 + ["two"] * 3


def test_unflagged_events_are_history_and_no_points() -> None:
    events = [replace(event, flagged=False) for event in talk()]
    talked = session(events)
    assert all(task_points(talked, task) == () for task in Task)
    assert len(final_view(talked, Task.NFD).moves) == 7


def test_ufn_sees_its_words_and_the_acts_of_earlier_spans_only() -> None:
    points = list(ufn_points(session(talk())))
    assert points[2].view.utterance == "Yes, left on Fuller."
    assert [move.act for move in points[1].view.moves] == [TO_KFC, OKAY, TURNING]
    assert [move.act for move in points[2].view.moves] == [TO_KFC, OKAY, TURNING, YES]


def test_rfn_sees_earlier_spans_of_its_utterance_as_far_as_they_were_said() -> None:
    points = list(rfn_points(session(talk())))
    assert [point.view.utterance for point in points] == ["", "", ""]
    assert [move.act for move in points[0].view.moves] == [TO_KFC]
    assert [move.act for move in points[1].view.moves] == [TO_KFC, OKAY]
    assert [move.text for move in points[1].view.moves] == ["To the KFC please.", "Okay,"]


def test_strict_rfn_sees_no_words_and_no_act_of_its_own_utterance() -> None:
    points = list(rfn_points(session(talk()), strict=True))
    assert [move.act for move in points[1].view.moves] == [TO_KFC]


def test_rfn_sees_no_time_after_its_point_where_spans_have_frames_of_their_own() -> None:
    said = [
        replace(event, frame=event.frame + 6 * k)
        for k, event in enumerate(
            utterance(60, Role.CO_WIZARD, 0, ("Okay,", OKAY), ("turning", TURNING), ("left.", STREET))
        )
    ]
    for point in rfn_points(session(said)):
        assert all(move.end <= point.view.time and move.recognised is None for move in point.view.moves)


def test_nfd_point_sees_utterances_of_its_own_frame_that_precede_it() -> None:
    before = utterance(60, Role.PARTICIPANT, 0, ("Turn around,", STREET), ("please.", OKAY))
    after = utterance(60, Role.CO_WIZARD, 1, ("Okay.", OKAY))
    (point,) = nfd_points(session([*before, physical(60, PhysicalAction.U_TURN), *after]))
    assert [move.span for move in point.view.moves] == ["Turn around,", "please."]


@pytest.mark.parametrize("task", list(Task))
def test_neither_the_point_nor_later_events_are_visible(task: Task) -> None:
    for point in task_points(session(talk()), task):
        view = point.view
        same_frame = [move for move in view.moves if move.frame == view.frame]
        assert all(move.index < point.index for move in same_frame)
        assert all(move.frame < view.frame for move in view.moves if move not in same_frame)
        assert all(action.frame < view.frame for action in view.actions)
        assert view.car is not None and view.car.frame == view.frame - 1


@pytest.mark.parametrize("task", list(Task))
def test_later_events_change_no_view(task: Task) -> None:
    """The future is rewritten after each point: its view stays as it was."""
    events = talk()
    for point in task_points(session(events), task):
        past = [event for event in events if event.frame <= point.view.frame]
        other = [*past, *utterance(point.view.frame + 1, Role.PARTICIPANT, 9, ("Stop!", OKAY))]
        other.append(physical(point.view.frame + 1, PhysicalAction.LANE_SWITCH, angle=90.0))
        again = {p.index: p.view for p in task_points(session(other), task)}
        assert again[point.index] == point.view


def test_hidden_landmarks_are_not_visible() -> None:
    view = next(ufn_points(session(talk()))).view
    assert [row["name"] for row in view.landmarks] == ["KFC"]


def test_angle_of_an_action_without_argument_is_zero() -> None:
    events = [
        physical(1, PhysicalAction.STOP, angle=33.0),
        physical(2, PhysicalAction.U_TURN, angle=-180.0),
        physical(3, PhysicalAction.J_TURN, angle=180.0),
        physical(4, PhysicalAction.LANE_SWITCH, angle=-90.0),
        physical(5, PhysicalAction.J_TURN, angle=None),
    ]
    angles = [point.angle for point in nfd_points(session(events))]
    assert angles[:4] == [0.0, 0.0, -180.0, -90.0]
    assert math.isnan(angles[4])


def test_u_turn_stands_in_a_history_as_half_a_turn() -> None:
    actions = session(talk()).physical_actions
    assert [history_angle(action) for action in actions] == [0.0, 88.0, 0.0, -180.0, -179.0, 0.0]


def test_final_view_holds_the_whole_record() -> None:
    view = final_view(session(talk()), Task.UFN)
    assert (len(view.moves), len(view.actions), view.utterance) == (7, 6, "")
    assert view.car is not None and view.car.frame == 299


def test_before_the_first_frame_there_is_no_car() -> None:
    assert next(nfd_points(session([physical(0, PhysicalAction.START)]))).view.car is None


def test_way_ends_at_the_last_state_of_the_car() -> None:
    view = next(nfd_points(session([physical(100, PhysicalAction.STOP)]))).view
    assert [state.frame for state in view.way] == [3, 15, 27, 39, 51, 63, 75, 87, 99]
    assert view.way[-1] == view.car
    later = next(nfd_points(session([physical(900, PhysicalAction.STOP)], 1000))).view
    assert (len(later.way), later.way[0].frame, later.way[-1].frame) == (25, 899 - 24 * 12, 899)
    assert next(nfd_points(session([physical(0, PhysicalAction.STOP)]))).view.way == ()


def test_flagged_events_that_are_no_point_are_reported_with_the_reason() -> None:
    odd = [
        physical(10, PhysicalAction.SPEED_CHANGE, up=True),
        replace(physical(20, PhysicalAction.STOP), source=Role.AGENT),
        *utterance(30, Role.AD_WIZARD, 9, ("Hello", OKAY)),
        physical(40, PhysicalAction.SPEED_CHANGE, up=True, flagged=False),
        physical(50, PhysicalAction.STOP),
    ]
    reasons = dict(unpointed_events(session(odd)))
    assert sorted(reasons) == [0, 1, 2]
    assert reasons[0] == "SpeedChange is no navigation action"
    assert reasons[1] == "Stop of agent, not of the Co-Wizard"
    assert reasons[2] == "a move of ad_wizard, neither the participant nor the Co-Wizard"
    assert unpointed_events(session(talk())) == ()
