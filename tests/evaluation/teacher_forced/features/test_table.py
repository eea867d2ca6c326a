from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dorothie_gym.archive import Task, task_points
from dorothie_gym.archive.prediction_points import at_tenths
from dorothie_gym.archive.recorded_perception import last_perceived
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.teacher_forced.features import BatchSpec, columns_of, gather, points
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import LABELS, PhysicalAction, Role
from dorothie_gym.session.recording import Event, EventType, Session
from tests.session.recording.builders import physical, session, utterance
from tests.session.recording.dialogues import DONE, OKAY, STREET, TO_KFC, TURNING, YES, talk


@pytest.mark.parametrize("task", list(Task))
def test_points_are_those_of_the_session_with_their_labels(task: Task) -> None:
    talked = session(talk())
    table, expected = points(columns_of(talked), task), task_points(talked, task)
    assert table.event.tolist() == [point.index for point in expected]
    assert table.tenth.tolist() == [point.view.frame // 3 for point in expected]
    if task is Task.NFD:
        assert table.label_action.tolist() == [point.action.nfd_class for point in expected]  # type: ignore[union-attr]  # points of a task have its label
        assert table.label_angle.tolist() == [0.0, 88.0, 0.0, -179.0, 0.0]
        assert not table.label_slots.any() and set(table.label_move.tolist()) == {-1}
    else:
        assert table.label_move.tolist() == [int(point.act.move) for point in expected]  # type: ignore[union-attr]  # points of a task have its label
        assert table.label_slots.tolist() == [list(map(bool, point.act.vector)) for point in expected]  # type: ignore[union-attr]  # points of a task have its label
        assert np.isnan(table.label_angle).all()


@pytest.mark.parametrize("task", list(Task))
def test_histories_are_those_of_the_views(task: Task) -> None:
    """Nothing of this talk happens within the tenth of a point but the point itself: both ways of cutting agree."""
    talked = session(talk())
    columns = columns_of(talked)
    batch = gather(columns, points(columns, task), np.arange(len(task_points(talked, task))))
    for row, point in enumerate(task_points(talked, task)):
        view = point.view
        moves = [int(move.act.move) for move in view.moves]
        assert batch.move[row][batch.move_mask[row]].tolist() == moves
        assert [tuple(slots) for slots in batch.move_slots[row][batch.move_mask[row]].tolist()] == [
            tuple(map(bool, move.act.vector)) for move in view.moves
        ]
        acts = [act.action.value - 1 for act in view.actions]
        assert batch.action[row][batch.action_mask[row]].tolist() == acts
        current = int(batch.current_text[row])
        assert ("" if current < 0 else columns.texts[current]) == view.utterance
        marks = [columns.texts[text] for text in batch.landmark_text[row][batch.landmark_mask[row]]]
        assert marks == ["KFC"], "the hidden House is in no batch"


def test_ufn_sees_earlier_acts_of_the_utterance_and_the_paper_s_leak_its_own() -> None:
    columns = columns_of(session(talk()))
    table = points(columns, Task.UFN)
    honest = gather(columns, table, [2])
    leaked = gather(columns, table, [2], BatchSpec(paper_leak=True))
    acts = [TO_KFC, OKAY, TURNING, YES]
    assert honest.move[0][honest.move_mask[0]].tolist() == [int(act.move) for act in acts]
    assert leaked.move[0][leaked.move_mask[0]].tolist() == [int(act.move) for act in [*acts, STREET]]
    assert tuple(leaked.move_slots[0][4].tolist()) == tuple(map(bool, STREET.vector))
    assert honest.utterance_mask.sum() == 2, "the current utterance is no history"
    assert columns.texts[int(honest.current_text[0])] == "Yes, left on Fuller."


def test_rfn_sees_earlier_acts_of_its_utterance_unless_the_rule_is_strict() -> None:
    columns = columns_of(session(talk()))
    table = points(columns, Task.RFN)
    batch, strict = gather(columns, table, [1]), gather(columns, table, [1], BatchSpec(strict=True))
    assert batch.move[0][batch.move_mask[0]].tolist() == [int(TO_KFC.move), int(OKAY.move)]
    assert batch.move_time[0, 1] == batch.time[0] == 2.0
    assert strict.move[0][strict.move_mask[0]].tolist() == [int(TO_KFC.move)]


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize("task", list(Task))
def test_a_played_session_has_the_histories_of_its_views(played: Session, task: Task, strict: bool) -> None:
    """Two ways to the same: views of the session at 10 Hz, and rows of columns."""
    tenths = at_tenths(played)
    columns, expected = columns_of(played), task_points(tenths, task, strict=strict)
    table = points(columns, task)
    batch = gather(columns, table, np.arange(len(table)), BatchSpec(moves=99, actions=99, strict=strict))
    assert table.event.tolist() == [point.index for point in expected] != []
    for row, view in enumerate(point.view for point in expected):
        assert batch.move[row][batch.move_mask[row]].tolist() == [int(move.act.move) for move in view.moves]
        assert batch.action[row][batch.action_mask[row]].tolist() == [act.action.value - 1 for act in view.actions]
        window = batch.window_pose[row][batch.window_mask[row]]
        np.testing.assert_allclose(window[:, :2], [(state.x, state.y) for state in view.way], rtol=1e-5)


def test_objects_of_a_batch_are_those_that_environments_show(played: Session) -> None:
    columns, tenths = columns_of(played), at_tenths(played)
    table = points(columns, Task.NFD)
    batch = gather(columns, table, np.arange(len(table)))
    for row, tenth in enumerate(table.tenth.tolist()):
        kinds, values = last_perceived(tenths, 3 * tenth, load_town("brookside"))
        mask = batch.objects_mask[row]
        assert batch.kind[row][mask].tolist() == kinds.tolist()
        np.testing.assert_allclose(batch.values[row][mask], values, atol=2e-3)  # headings are rounded in columns
    assert batch.objects_mask.any()


def test_the_paper_s_leak_gives_every_label_away(played: Session) -> None:
    columns = columns_of(played)
    table = points(columns, Task.UFN)
    rows = np.arange(len(table))
    leaked = gather(columns, table, rows, BatchSpec(moves=99, paper_leak=True))
    newest = leaked.move_mask.sum(axis=1) - 1
    assert leaked.move[rows, newest].tolist() == table.label_move.tolist()
    assert np.array_equal(leaked.move_slots[rows, newest], table.label_slots)


@pytest.mark.parametrize("task", [Task.RFN, Task.NFD])
def test_the_paper_s_leak_is_at_ufn_points_only(task: Task) -> None:
    columns = columns_of(session(talk()))
    table = points(columns, task)
    rows = np.arange(len(table))
    honest, leaked = gather(columns, table, rows), gather(columns, table, rows, BatchSpec(paper_leak=True))
    np.testing.assert_equal(vars(honest), vars(leaked))


def test_newest_entries_are_kept_and_padding_is_at_the_end() -> None:
    columns = columns_of(session(talk()))
    table = points(columns, Task.RFN)
    batch = gather(columns, table, [2], BatchSpec(moves=3, actions=2, utterances=9))
    assert batch.move[0].tolist() == [int(act.move) for act in (TURNING, YES, STREET)]
    assert batch.move_time[0].tolist() == [2.0, 4.0, 4.0]
    assert batch.action[0].tolist() == [PhysicalAction.U_TURN.nfd_class, PhysicalAction.J_TURN.nfd_class]
    assert batch.action_angle[0].tolist() == [-180.0, -179.0]
    assert batch.utterance_mask[0].tolist() == [True] * 3 + [False] * 6
    assert batch.utterance_text[0, 3:].tolist() == [-1] * 6


def test_the_window_ends_just_before_the_point_and_goes_back_ten_seconds() -> None:
    columns = columns_of(session([physical(45, PhysicalAction.START), physical(1200, PhysicalAction.STOP)], 1300))
    batch = gather(columns, points(columns, Task.NFD), [0, 1])
    assert batch.window_mask.sum(axis=1).tolist() == [4, 25]
    np.testing.assert_allclose(batch.window_time[0, :4], [0.2, 0.6, 1.0, 1.4], rtol=1e-6)
    np.testing.assert_allclose(batch.window_time[1, [0, -1]], [30.3, 39.9], rtol=1e-6)
    np.testing.assert_allclose(batch.window_pose[1, -1, :2], [399 * 0.6, 0.0], rtol=1e-6)  # 6 m/s east
    np.testing.assert_allclose(batch.window_speed[1], 6.0, rtol=1e-4)
    assert batch.window_lane.max() == -1, "the town is not known"
    assert not batch.has_objects.any() and not batch.objects_mask.any()


def test_a_point_before_the_first_frame_has_an_empty_window() -> None:
    columns = columns_of(session([physical(0, PhysicalAction.START)]))
    batch = gather(columns, points(columns, Task.NFD), [0])
    assert not batch.window_mask.any() and not batch.action_mask.any()


def test_events_within_the_tenth_of_a_point_are_not_visible() -> None:
    acts = [physical(60, PhysicalAction.START), physical(61, PhysicalAction.STOP), physical(63, PhysicalAction.START)]
    columns = columns_of(session(acts))
    batch = gather(columns, points(columns, Task.NFD), [0, 1, 2])
    assert batch.action_mask.sum(axis=1).tolist() == [0, 0, 2]


def test_words_that_were_over_before_an_action_of_the_same_tenth_are_visible_to_it() -> None:
    before = utterance(60, Role.PARTICIPANT, 0, ("Turn around,", STREET), ("please.", OKAY))
    after = utterance(62, Role.CO_WIZARD, 1, ("Okay.", OKAY))
    columns = columns_of(session([*before, physical(61, PhysicalAction.U_TURN), *after]))
    batch = gather(columns, points(columns, Task.NFD), [0])
    assert [columns.texts[text] for text in batch.move_text[0][batch.move_mask[0]]] == ["Turn around,", "please."]
    assert [columns.texts[text] for text in batch.utterance_text[0][batch.utterance_mask[0]]] == [
        "Turn around, please."
    ]
    answers = gather(columns, points(columns, Task.RFN), [0])
    assert not answers.move_mask.any(), "what is said next sees only what was over strictly before"


def test_belief_is_the_next_frame_and_the_subgoal_reached_next() -> None:
    data = {"subgoal": 1, "status": "Complete", "landmark": "House"}
    reached = Event(frame=200, type=EventType.SUBGOAL, source=Role.AGENT, data=data)
    table = points(columns_of(session([physical(150, PhysicalAction.STOP), reached])), Task.NFD)
    here = 49 * 0.6  # the last frame before
    expected = [0.6, 0.0, math.degrees(0.1), 90.0 - here, 44.0]
    np.testing.assert_allclose(table.label_belief[0], expected, atol=1e-3)
    after = points(columns_of(session([physical(250, PhysicalAction.STOP), reached])), Task.NFD)
    assert np.isnan(after.label_belief[0, 3:]).all()


def odd_session() -> Session:
    """Session with flagged events of each kind without a point, and a turn with unknown angle."""
    return session(
        [
            *talk(),
            physical(260, PhysicalAction.J_TURN),
            physical(262, PhysicalAction.SPEED_CHANGE, up=True),
            replace(physical(264, PhysicalAction.STOP), source=Role.AGENT),
            *utterance(270, Role.AD_WIZARD, 9, ("Hello", OKAY)),
            Event(frame=280, type=EventType.MESSAGE, source=Role.AD_WIZARD, flagged=True, data={"text": "Rain"}),
        ]
    )


def test_every_flagged_event_is_a_point_or_listed_with_its_reason() -> None:
    odd = odd_session()
    columns = columns_of(odd, fold="test/seen")
    tables = [points(columns, task) for task in Task]
    listed = {(one.event, one.reason) for table in tables for one in table.skipped}
    pointed = {event for table in tables for event in table.event.tolist()}
    unpointed = {one.event for one in tables[0].skipped if one.task is None}
    assert pointed | unpointed == {index for index, event in enumerate(odd.events) if event.flagged}
    assert not pointed & unpointed
    reasons = sorted(reason for _, reason in listed)
    assert len(reasons) == 5
    assert any("SpeedChange is no navigation action" in reason for reason in reasons)
    assert any("Stop of agent" in reason for reason in reasons)
    assert any("a move of ad_wizard, neither" in reason for reason in reasons)
    assert any("type Message" in reason for reason in reasons)
    assert any("angle" in reason for reason in reasons)


def test_folds_choose_sessions() -> None:
    columns = columns_of(session(talk()), fold="test/seen")
    assert len(points(columns, Task.UFN, "test")) == len(points(columns, Task.UFN, "seen")) == 4
    assert len(points(columns, Task.UFN, "train")) == 0
    with pytest.raises(SessionError, match="'other' is unknown"):
        points(columns, Task.UFN, "other")


def test_utterance_with_acts_at_several_times_is_visible_after_the_last() -> None:
    """In recordings of people the acts of an utterance may have frames of their own."""
    first, second = utterance(60, Role.PARTICIPANT, 0, ("Yes,", YES), ("left.", STREET))
    columns = columns_of(session([first, replace(second, frame=90), physical(75, PhysicalAction.START)]))
    ufn = points(columns, Task.UFN)
    assert (ufn.tenth.tolist(), gather(columns, ufn, [0, 1]).move_mask.sum(axis=1).tolist()) == ([20, 30], [0, 1])
    assert not gather(columns, points(columns, Task.NFD), [0]).move_mask.any()


def test_empty_batch_has_its_shapes() -> None:
    columns = columns_of(session([]))
    for task in Task:
        batch = gather(columns, points(columns, task), [])
        assert batch.move_slots.shape == (0, 32, len(LABELS))
        assert batch.window_values.shape == (0, 25, 8, 8)


def test_wrong_sizes_are_named() -> None:
    with pytest.raises(ValueError, match=r"BatchSpec\.window_step is 0; it must be at least 1"):
        BatchSpec(window_step=0)
    with pytest.raises(ValueError, match=r"BatchSpec\.moves is -1"):
        BatchSpec(moves=-1)


def test_recognised_words_are_kept_beside_the_spoken_words() -> None:
    heard = utterance(30, Role.PARTICIPANT, 0, ("To the KFC please.", DONE))
    heard = [replace(event, data={**event.data, "recognised": "to the cafe"}) for event in heard]
    columns = columns_of(session([*heard, *utterance(60, Role.CO_WIZARD, 1, ("Okay", OKAY))]))
    batch = gather(columns, points(columns, Task.RFN), [0])
    assert columns.texts[int(batch.utterance_recognised[0, 0])] == "to the cafe"
    now = gather(columns, points(columns, Task.UFN), [0])
    assert columns.texts[int(now.current_recognised[0])] == "to the cafe"
