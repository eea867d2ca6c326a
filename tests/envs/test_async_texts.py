"""Texts of `gymnasium.make_vec` in several processes: those of one process, with and without shared memory."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium as gym
import pytest
from gymnasium.wrappers import FilterObservation, FrameStackObservation

import dorothie_gym
from dorothie_gym.archive import Task
from tests.envs.test_gymnasium_api import IDS
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk

TASKS = ("dorothie_gym/UfN-v0", "dorothie_gym/RfN-v0", "dorothie_gym/NfD-v0")
STEPS = 24

Texts = list[dict[str, tuple[str, ...]]]


def has_texts(space: gym.Space[Any]) -> bool:
    return isinstance(space, gym.spaces.Dict) and any(isinstance(part, gym.spaces.Text) for part in space.values())


def arguments_of(name: str) -> dict[str, Any]:
    return {"corpus": [session(talk()), session(talk(), name="two")]} if name in TASKS else {"town": "brookside"}


def texts_of(observation: dict[str, Any]) -> dict[str, tuple[str, ...]]:
    """Returns the fields of texts as they are now; those of stacked observations are tuples of tuples."""
    found = {name: value for name, value in observation.items() if isinstance(value, tuple)}
    return {name: copy.deepcopy(value) for name, value in found.items() if isinstance(value[0], str | tuple)}


def play(envs: Any, steps: int = STEPS) -> Texts:
    """Returns the texts of two environments under the same actions."""
    envs.action_space.seed(3)
    observation, _ = envs.reset(seed=7)
    found = [texts_of(observation)]
    for _ in range(steps):
        observation, *_ = envs.step(envs.action_space.sample())
        assert envs.observation_space.contains(observation)
        found.append(texts_of(observation))
    envs.close()
    return found


def made(name: str, mode: str, **vector: Any) -> Any:
    return gym.make_vec(name, 2, vectorization_mode=mode, vector_kwargs=vector, **arguments_of(name))


def with_texts() -> list[str]:
    return [name for name in IDS if has_texts(gym.make(name, **arguments_of(name)).observation_space)]


def test_five_of_the_ids_have_texts() -> None:
    assert {name.split("/")[1] for name in with_texts()} >= {
        "CoWizard-v0",
        "Participant-v0",
        "UfN-v0",
        "RfN-v0",
        "NfD-v0",
    }


@pytest.mark.parametrize("name", with_texts())
def test_texts_are_those_of_one_process(name: str) -> None:
    wanted = play(made(name, "sync"))
    assert any(text for seen in wanted for texts in seen.values() for text in texts), "nothing was said"
    for vector in ({}, {"copy": False}, {"shared_memory": False}):
        assert play(made(name, "async", **vector)) == wanted, vector


@pytest.mark.long
@pytest.mark.parametrize("context", ["spawn", "forkserver"])
@pytest.mark.parametrize("name", ["dorothie_gym/CoWizard-v0", "dorothie_gym/UfN-v0"])
def test_new_processes_know_how_to_write_texts(name: str, context: str) -> None:
    assert play(made(name, "async", context=context)) == play(made(name, "sync"))


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_episodes_that_end_take_their_texts_with_them(mode: str) -> None:
    name = "dorothie_gym/Participant-v0"
    ends = {"autoreset_mode": gym.vector.AutoresetMode(mode)}
    kinds: dict[str, Texts] = {}
    for kind in ("sync", "async"):
        envs: Any = gym.make_vec(name, 2, vectorization_mode=kind, vector_kwargs=ends, max_cycles=9)
        kinds[kind] = play(envs)
    assert kinds["async"] == kinds["sync"]
    assert sum(bool(seen["story"][0]) for seen in kinds["async"]) == len(kinds["async"])


def stacked(env: gym.Env[Any, Any]) -> gym.Env[Any, Any]:
    return FrameStackObservation(FilterObservation(env, ["participant_text", "speed"]), 3)


def test_wrappers_that_keep_texts_keep_them_readable() -> None:
    name, found = "dorothie_gym/CoWizard-v0", []
    for kind in ("sync", "async"):
        found.append(play(gym.make_vec(name, 2, vectorization_mode=kind, wrappers=[stacked])))
    assert found[0] == found[1]
    assert any(text for seen in found[1] for texts in seen["participant_text"] for text in texts)


def test_live_sessions_with_teacher_forcing() -> None:
    def make() -> gym.Env[Any, Any]:
        return dorothie_gym.TeacherForcing(dorothie_gym.DuoWizardEnv("brookside"), Task.UFN)

    found = [play(each([make, make]), 6) for each in (gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv)]
    assert found[0] == found[1] and any(text for seen in found[1] for text in seen["utterance"])


def test_spaces_of_different_environments_are_batched() -> None:
    makers = [lambda: gym.make("dorothie_gym/CoWizard-v0", town="brookside")] * 2
    envs = gym.vector.AsyncVectorEnv(makers, observation_mode="different")
    assert play(envs, 12) == play(made("dorothie_gym/CoWizard-v0", "sync"), 12)
