"""Nothing at or after a point is in its batch: the future, and how the session ends, may be rewritten at will."""

from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.archive import Corpus, Task
from dorothie_gym.envs.nfd_v0 import NfDEnv
from dorothie_gym.envs.rfn_v0 import RfNEnv
from dorothie_gym.envs.teacher_forced import TeacherForcedEnv
from dorothie_gym.envs.ufn_v0 import UfNEnv
from dorothie_gym.evaluation.rollout import default_corpus
from dorothie_gym.evaluation.teacher_forced.features import BatchSpec, columns_of, gather, points
from dorothie_gym.session.recording import Session
from tests.evaluation.teacher_forced.features.played import seen, with_another_future
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk


def check(recorded: Session, task: Task, every: int = 1, spec: BatchSpec | None = None) -> int:
    """Asserts that no point of a task sees its future; returns how many were checked."""
    columns = columns_of(recorded)
    table = points(columns, task)
    for row in range(0, len(table), every):
        index = int(table.event[row])
        other = columns_of(with_another_future(recorded, index, task, strict=spec is not None and spec.strict))
        again = points(other, task)
        (same,) = np.flatnonzero(again.event == index)
        np.testing.assert_equal(
            seen(columns, gather(columns, table, [row], spec)), seen(other, gather(other, again, [same], spec))
        )
        if task is not Task.NFD:
            assert again.label_slots[same].tolist() != table.label_slots[row].tolist(), "the point itself was rewritten"
    return len(range(0, len(table), every))


@pytest.mark.parametrize("task", list(Task))
def test_no_point_of_a_talk_sees_its_future(task: Task) -> None:
    assert check(session(talk()), task) >= 3


def test_no_point_of_a_talk_sees_its_future_under_the_strict_rule() -> None:
    assert check(session(talk()), Task.RFN, spec=BatchSpec(strict=True)) == 3


def test_points_of_a_played_session_see_no_future(played: Session) -> None:
    assert len(played.scene.actors) and len(played.scene.lights)
    assert sum(check(played, task) for task in Task) >= 5


def test_the_check_finds_the_leak_of_the_published_features() -> None:
    with pytest.raises(AssertionError):
        check(session(talk()), Task.UFN, spec=BatchSpec(paper_leak=True))


@pytest.mark.parametrize("env_class", [UfNEnv, RfNEnv, NfDEnv])
def test_no_observation_of_the_environments_shows_its_future(
    env_class: type[TeacherForcedEnv], played: Session
) -> None:
    env = env_class([played])
    observation, _ = env.reset()
    for number in range(3):
        assert env._point is not None
        other = env_class([with_another_future(played, env._point.index, env.task)])
        again, _ = other.reset()
        for _ in range(number):
            again, *_ = other.step(other.action_space.sample())
        np.testing.assert_equal(again, observation)
        observation, _, done, _, _ = env.step(env.action_space.sample())
        if done:
            break


@pytest.mark.slow
def test_no_point_of_twenty_sessions_sees_its_future() -> None:
    entries = Corpus.load(default_corpus()).entries[:20]
    assert len(entries) == 20
    assert sum(check(entry.load(), task) for entry in entries for task in Task) > 1000


def test_hidden_landmarks_are_in_no_column_of_inputs() -> None:
    columns = columns_of(session(talk()))
    assert "House" not in columns.texts
    assert columns.landmarks.place.tolist() == [[10.0, -4.0]]
