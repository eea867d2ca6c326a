from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import gymnasium as gym
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl.vector_env import WorkerVecEnv


@pytest.fixture(scope="module")
def poles() -> Iterator[WorkerVecEnv]:
    vector = WorkerVecEnv(partial(gym.make, "CartPole-v1"), environments=3, workers=2)
    yield vector
    vector.close()


def test_only_the_environments_that_are_named_are_asked(poles: WorkerVecEnv) -> None:
    poles.reset()
    poles.env_method("step", 1, indices=[2, 0])
    poles.env_method("step", action=1, indices=-1)
    assert poles.get_attr("_elapsed_steps") == [1, 0, 2]
    assert poles.get_attr("_elapsed_steps", indices=[2, 1]) == [2, 0]
    assert poles.env_is_wrapped(gym.wrappers.TimeLimit, indices=1) == [True]


def test_an_attribute_is_set_where_it_was_asked_for(poles: WorkerVecEnv) -> None:
    poles.set_attr("name", "pole")
    poles.set_attr("name", "middle", indices=1)
    assert poles.get_attr("name") == ["pole", "middle", "pole"]


def test_after_a_failure_answers_still_belong_to_their_questions(poles: WorkerVecEnv) -> None:
    poles.set_attr("name", "pole")
    with pytest.raises(RuntimeError, match="no_such"):
        poles.env_method("no_such")
    assert poles.get_attr("name") == ["pole"] * 3


def test_an_index_that_no_environment_has_is_refused(poles: WorkerVecEnv) -> None:
    with pytest.raises(IndexError):
        poles.get_attr("name", indices=3)


def test_a_process_that_cannot_begin_is_told_of() -> None:
    with pytest.raises(RuntimeError, match="died with code"):
        WorkerVecEnv(partial(gym.make, "NoSuch-v0"), environments=1, workers=1)
