from __future__ import annotations

import json
from pathlib import Path

import pytest

from dorothie_gym.evaluation import evaluate_folder, evaluate_tasks, parse_tasks
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.sessions import SessionError, Task
from tests.sessions.builders import physical, session, write
from tests.sessions.dialogues import talk


def test_majority_table_by_hand() -> None:
    table = evaluate_tasks([session(talk())], [session(talk())])
    # UfN: Instruct (2 of 4); of the slots only JTurn... each occurs once in 4: none is predicted.
    assert (table["ufn_points"], table["ufn_skipped"]) == (4, 0)
    assert table["ufn_move_accuracy"] == 0.5
    assert table["ufn_slot_f1"] == 0.0
    assert table["ufn_slot_score_paper"] == 0.25
    # RfN: Acknowledge (2 of 3), no slots; one of the three has one.
    assert table["rfn_move_accuracy"] == pytest.approx(2 / 3)
    assert table["rfn_slot_score_paper"] == pytest.approx(2 / 3)
    # NfD: JTurn (2 of 5) at -179 (the smaller of two equally common angles, 88 and -179).
    assert table["nfd_points"] == 5
    assert table["nfd_action_accuracy"] == 0.4
    assert table["nfd_argument_accuracy"] == 0.2
    assert table["nfd_joint_accuracy"] == 0.2
    assert table["nfd_joint_accuracy_paper"] == 0.2
    assert table["nfd_per_class"] == {"UTurn": 0.0, "JTurn": 1.0, "Stop": 0.0, "Start": 0.0}
    assert sum(map(sum, table["ufn_confusion"])) == 4


def test_only_the_tasks_asked_for_are_in_the_table() -> None:
    table = evaluate_tasks([session(talk())], [session(talk())], [Task.NFD])
    assert not any(key.startswith(("ufn", "rfn")) for key in table)


def test_points_without_anything_to_learn_from_are_counted_as_skipped() -> None:
    table = evaluate_tasks([session()], [session(talk())])
    for task, count in (("ufn", 4), ("rfn", 3), ("nfd", 5)):
        assert (table[f"{task}_points"], table[f"{task}_skipped"]) == (0, count)
    assert table["ufn_move_accuracy"] is None


def test_unknown_angles_are_counted_as_skipped() -> None:
    unknown = session([physical(1, PhysicalAction.J_TURN), physical(2, PhysicalAction.J_TURN, 5.0)])
    table = evaluate_tasks([session(talk())], [unknown], [Task.NFD])
    assert (table["nfd_points"], table["nfd_skipped"], table["nfd_action_accuracy"]) == (2, 1, 1.0)


@pytest.mark.parametrize("model", ["majority", "random"])
def test_folder_is_split_by_name_and_the_table_is_json(tmp_path: Path, model: str) -> None:
    for name in "abc":
        write(tmp_path / name, talk())
    table = evaluate_folder(tmp_path, model=model, seed=1)
    assert (table["sessions_train"], table["sessions_test"], table["ufn_points"]) == (1, 2, 8)
    assert "by name" in table["split"]
    assert json.loads(json.dumps(table, allow_nan=False)) == evaluate_folder(tmp_path, model=model, seed=1)


def test_unreadable_and_incomplete_sessions_are_named(tmp_path: Path) -> None:
    for name in "abc":
        write(tmp_path / name, talk())
    (tmp_path / "a/events.jsonl").write_text("nonsense\n")
    page = (tmp_path / "c/session.json").read_text()
    (tmp_path / "c/session.json").write_text(page[: page.index(' "outcome"')] + ' "outcome": null\n}\n')
    table = evaluate_folder(tmp_path)
    assert list(table["sessions_unreadable"]) == ["a"]
    assert table["sessions_incomplete"] == ["c"]


def test_one_session_cannot_be_split(tmp_path: Path) -> None:
    write(tmp_path / "a", talk())
    with pytest.raises(SessionError, match="at least 2"):
        evaluate_folder(tmp_path)


def test_tasks_are_read_from_text() -> None:
    assert parse_tasks("all") == tuple(Task)
    assert parse_tasks("nfd, UfN") == (Task.UFN, Task.NFD)
    with pytest.raises(ValueError, match="'toto' is unknown; choose from ufn, rfn, nfd, or all"):
        parse_tasks("ufn,toto")
