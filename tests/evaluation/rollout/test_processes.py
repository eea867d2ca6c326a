from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.errors import ProcessError
from dorothie_gym.evaluation.rollout import plan_corpus
from dorothie_gym.evaluation.rollout.processes import run_series, run_tasks
from tests.evaluation.rollout import workshop


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_is_done_once(workers: int) -> None:
    assert sorted(run_tasks(workshop.squares, range(10), workers=workers)) == [k * k for k in range(10)]


def test_no_more_processes_are_started_than_there_are_tasks() -> None:
    assert list(run_tasks(workshop.squares, [7], workers=50)) == [49]
    assert list(run_tasks(workshop.squares, [], workers=2)) == []


def test_failure_names_task_and_reason() -> None:
    with pytest.raises(ProcessError, match="3: ValueError: three is too much"):
        list(run_tasks(workshop.refusing, range(5), workers=2))


def test_death_of_a_worker_is_reported_at_once() -> None:
    with pytest.raises(ProcessError, match="died with code -9"):
        list(run_tasks(workshop.dying, range(5), workers=2))


@pytest.mark.long
def test_failure_names_the_session() -> None:
    plans = plan_corpus(2, 7)
    named = r"session [01] \(\w+, seed \d+\): ValueError: the town is closed \(workshop\.py, line \d+\)"
    with pytest.raises(ProcessError, match=f"^{named}$"):
        list(run_tasks(workshop.refusing_sessions, plans, workers=2))


@pytest.mark.parametrize("workers", [1, 2])
def test_file_that_cannot_be_written_is_an_error_of_the_system_in_every_process(workers: int, tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError) as caught:
        list(run_tasks(workshop.writing, [str(tmp_path)] * 2, workers=workers))
    assert caught.value.filename == str(tmp_path)


@pytest.mark.parametrize("workers", [1, 2])
def test_results_of_a_task_arrive_before_it_ends(workers: int) -> None:
    assert sorted(run_series(workshop.counting_up, [1, 0, 2], workers=workers)) == [0, 0, 1]
    found: list[int] = []
    with pytest.raises(ProcessError if workers > 1 else ValueError, match="three is too much"):
        found.extend(run_series(workshop.counting_up, [3], workers=workers))
    assert found == [0, 1, 2]
