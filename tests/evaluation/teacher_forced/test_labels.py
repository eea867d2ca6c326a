from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.archive import Task, read_session
from dorothie_gym.archive.sdn import write_sdn
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.teacher_forced import ActPredictions, labels_of, score_task
from dorothie_gym.evaluation.teacher_forced.features import build, points
from dorothie_gym.evaluation.teacher_forced.features.session_columns import HANDLINGS
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.session.recording import Event, EventType
from tests.evaluation.teacher_forced.corpora import FOLDS, corpus
from tests.session.recording.builders import physical, write
from tests.session.recording.dialogues import talk

JTURN = PhysicalAction.J_TURN


def test_split_test_has_the_sessions_of_its_folders_by_seen_and_unseen(tmp_path: Path) -> None:
    labels = labels_of(corpus(tmp_path))
    assert labels.part_of == {"of-test-seen": "seen", "of-test-unseen": "unseen"}
    assert labels.parts == ("seen", "unseen")
    assert labels.others == {"of-train", "of-val-seen", "of-val-unseen"}
    assert {task: len(of) for task, of in labels.tasks.items()} == {Task.UFN: 8, Task.RFN: 6, Task.NFD: 10}


def test_points_of_all_folds_and_tasks_sum_up_to_the_flagged_events(tmp_path: Path) -> None:
    counts = labels_of(corpus(tmp_path)).counts
    assert sorted(counts) == sorted(FOLDS)
    for count in counts.values():
        assert count.to_json() == {"sessions": 1, "flagged": 12, "ufn": 4, "rfn": 3, "nfd": 5, "skipped": 0}


def test_flagged_events_that_are_no_points_are_named_with_the_reason(tmp_path: Path) -> None:
    said = [event for event in talk() if event.type is EventType.DIALOGUE_MOVE][:1]
    aside = Event(frame=20, type=EventType.DIALOGUE_MOVE, source=Role.AD_WIZARD, flagged=True, data=said[0].data)
    braking = Event(
        frame=25,
        type=EventType.PHYSICAL_ACTION,
        source=Role.AGENT,
        flagged=True,
        data={"action": "Stop", "angle": None, "up": None},
    )
    write(tmp_path / "a", [aside, braking, physical(30, PhysicalAction.SPEED_CHANGE, up=True), physical(40, JTURN)])
    labels = labels_of(tmp_path, "all")
    count = labels.counts[""]
    assert (count.flagged, count.skipped, count.points[Task.NFD]) == (4, 3, 1)
    reasons = {skipped.event: (skipped.task, skipped.reason) for skipped in labels.skipped}
    assert reasons[0] == (None, "a move of ad_wizard, neither the participant nor the Co-Wizard")
    assert reasons[1] == (None, "Stop of agent, not of the Co-Wizard")
    assert reasons[2] == (None, "SpeedChange is no navigation action")
    assert reasons[3][0] is Task.NFD and "does not know its angle" in reasons[3][1]


def test_sessions_without_folds_are_divided_by_name(tmp_path: Path) -> None:
    for name in "abc":
        write(tmp_path / name, talk())
    assert labels_of(tmp_path, "train").part_of == {"a": "all"}
    test = labels_of(tmp_path)
    assert test.part_of == {"b": "all", "c": "all"} and "by name" in test.division
    assert len(labels_of(tmp_path, "all").part_of) == 3


def test_error_of_empty_split_lists_the_splits_with_sessions(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="has no session of the split 'val', only of test, train, all"):
        labels_of(corpus(tmp_path / "c", ("train", "test/seen")), "val")
    write(tmp_path / "one", talk())
    with pytest.raises(SessionError, match="two sessions or more are divided"):
        labels_of(tmp_path / "one")


def test_unreadable_and_incomplete_sessions_are_named(tmp_path: Path) -> None:
    for name in "abcd":
        write(tmp_path / name, talk())
    (tmp_path / "c/events.jsonl").write_text("nonsense\n")
    page = (tmp_path / "d/session.json").read_text()
    (tmp_path / "d/session.json").write_text(page[: page.index(' "outcome"')] + ' "outcome": null\n}\n')
    labels = labels_of(tmp_path)
    assert list(labels.unreadable) == ["c"] and labels.incomplete == ("d",)
    assert list(labels.part_of) == ["d"]
    assert labels.counts[""].sessions == 3


def test_two_sessions_of_one_name_are_refused(tmp_path: Path) -> None:
    for fold in ("train", "test/seen"):
        (tmp_path / fold).mkdir(parents=True)
        write(tmp_path / fold / "same", talk())
    with pytest.raises(SessionError, match="same name.*rename one"):
        labels_of(tmp_path)


def test_labels_of_a_corpus_in_sdns_layout_are_the_same(tmp_path: Path) -> None:
    native = corpus(tmp_path / "native", ("test/seen",))
    (tmp_path / "sdn/test/seen").mkdir(parents=True)
    session = read_session(native / "test/seen/of-test-seen")
    write_sdn(session, tmp_path / "sdn/test/seen/log_1")
    ours, theirs = labels_of(native), labels_of(tmp_path / "sdn")
    assert theirs.part_of == {"log_1": "seen"}
    for task, labels in ours.tasks.items():
        other = theirs.tasks[task]
        assert other.events.tolist() == labels.events.tolist() and other.handled.tolist() == labels.handled.tolist()
        scores = score_task(task, other.labels, labels.labels)
        assert set(scores.values()) == {1.0}


def test_labels_are_those_of_the_features(tmp_path: Path) -> None:
    path = corpus(tmp_path, ("test/seen", "test/unseen"))
    labels, columns = labels_of(path), build(path, cache=False)
    for task, of in labels.tasks.items():
        table = points(columns, task)
        names = [columns.sessions.names[number] for number in table.session]
        rows = [of.rows()[key] for key in zip(names, table.event.tolist(), strict=True)]
        assert sorted(rows) == list(range(len(of)))
        assert [HANDLINGS[kind] for kind in table.handling] == of.handled[rows].tolist()
        if isinstance(of.labels, ActPredictions):
            assert table.label_move.tolist() == of.labels.moves[rows].tolist()
            assert np.array_equal(table.label_slots, of.labels.slots[rows])
        else:
            assert table.label_action.tolist() == of.labels.actions[rows].tolist()
            assert table.label_angle == pytest.approx(of.labels.angles[rows], nan_ok=True)
