"""Nothing at or after a point is in its batch: the future, and how the session ends, may be rewritten at will."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.evaluation.features import BatchSpec, columns_of, gather, points
from dorothie_gym.rollout import default_corpus
from dorothie_gym.sessions import Corpus, Session, Task
from tests.evaluation.features.played import play, seen, with_another_future
from tests.sessions.builders import session
from tests.sessions.dialogues import talk


def check(recorded: Session, task: Task, every: int = 1, spec: BatchSpec | None = None) -> int:
    """Asserts that no point of a task sees its future; returns how many were checked."""
    columns = columns_of(recorded)
    table = points(columns, task)
    for row in range(0, len(table), every):
        index = int(table.event[row])
        other = columns_of(with_another_future(recorded, index, words=task is Task.UFN))
        again = points(other, task)
        (same,) = np.flatnonzero(again.event == index)
        np.testing.assert_equal(
            seen(columns, gather(columns, table, [row], spec)), seen(other, gather(other, again, [same], spec))
        )
        if task is not Task.NFD:
            assert again.label_move[same] != table.label_move[row] or table.label_slots[row].any()
    return len(range(0, len(table), every))


@pytest.mark.parametrize("task", list(Task))
def test_no_point_of_a_talk_sees_its_future(task: Task) -> None:
    assert check(session(talk()), task) >= 3


def test_points_of_a_played_session_see_no_future(tmp_path: Path) -> None:
    recorded = play(tmp_path / "played", seconds=50.0)
    assert len(recorded.scene.actors) and len(recorded.scene.lights)
    assert sum(check(recorded, task, every=2) for task in Task) >= 5


def test_the_check_finds_the_leak_of_the_published_features() -> None:
    with pytest.raises(AssertionError):
        check(session(talk()), Task.UFN, spec=BatchSpec(paper_leak=True))


@pytest.mark.slow
def test_no_point_of_twenty_sessions_sees_its_future() -> None:
    entries = Corpus.load(default_corpus()).entries[:20]
    assert len(entries) == 20
    assert sum(check(entry.load(), task) for entry in entries for task in Task) > 1000


def test_hidden_landmarks_are_in_no_column_of_inputs() -> None:
    columns = columns_of(session(talk()))
    assert "House" not in columns.texts
    assert columns.landmarks.place.tolist() == [[10.0, -4.0]]
