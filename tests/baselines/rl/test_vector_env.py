from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import gymnasium as gym
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")

from dorothie_gym.baselines.rl.vector_env import ProcessVecEnv


@pytest.fixture(scope="module")
def poles() -> Iterator[ProcessVecEnv]:
    vector = ProcessVecEnv(partial(gym.make, "CartPole-v1"), environments=3, workers=2)
    yield vector
    vector.close()


def test_methods_are_called_in_the_given_environments_only(poles: ProcessVecEnv) -> None:
    poles.reset()
    poles.env_method("step", 1, indices=[2, 0])
    poles.env_method("step", action=1, indices=-1)
    assert poles.get_attr("_elapsed_steps") == [1, 0, 2]
    assert poles.get_attr("_elapsed_steps", indices=[2, 1]) == [2, 0]
    assert poles.env_is_wrapped(gym.wrappers.TimeLimit, indices=1) == [True]


def test_attribute_is_set_in_the_given_environments_only(poles: ProcessVecEnv) -> None:
    poles.set_attr("name", "pole")
    poles.set_attr("name", "middle", indices=1)
    assert poles.get_attr("name") == ["pole", "middle", "pole"]


def test_answers_after_a_failure_match_their_commands(poles: ProcessVecEnv) -> None:
    poles.set_attr("name", "pole")
    with pytest.raises(RuntimeError, match="no_such"):
        poles.env_method("no_such")
    assert poles.get_attr("name") == ["pole"] * 3


def test_index_out_of_range_is_refused(poles: ProcessVecEnv) -> None:
    with pytest.raises(IndexError):
        poles.get_attr("name", indices=3)


@pytest.mark.long
def test_process_that_fails_to_start_is_reported() -> None:
    with pytest.raises(RuntimeError, match="died with code"):
        ProcessVecEnv(partial(gym.make, "NoSuch-v0"), environments=1, workers=1)
