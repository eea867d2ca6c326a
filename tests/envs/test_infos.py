"""Infos keep one tree: the same keys, types, dtypes and shapes at the reset and at every step, also the last."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
import pettingzoo
import pytest
from gymnasium.vector import AutoresetMode

import dorothie_gym
from dorothie_gym import DuoWizardEnv, DuoWizardVectorEnv, EnvConfig, IdenticalSpaces, TeacherForcing
from tests.session.recording.builders import session
from tests.session.recording.dialogues import talk

Info = Mapping[str, Any]

SECONDS = 8.0
"""Length of an episode; those of tasks are as long as their session [s]."""

TASKS = ("UfN-v0", "RfN-v0", "NfD-v0")

IDS = sorted(name.split("/")[1] for name in gym.registry if name.startswith("dorothie_gym/"))


def arguments_of(name: str) -> dict[str, Any]:
    if name in TASKS:
        return {"corpus": [session(talk()), session(talk(), name="two")]}
    if name == "Town-v0":
        return {"config": {"duration": SECONDS, "vehicles": 3}}
    if name.startswith("Navigation"):
        return {"max_seconds": SECONDS, "exceptions": 4.0, "traffic": "light"}
    return {"config": EnvConfig(max_seconds=SECONDS)}


def form(value: Any) -> Any:
    """Returns the tree of an info: of each leaf its type, and dtype and shape of arrays."""
    if isinstance(value, Mapping):
        return {name: form(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return type(value), [form(part) for part in value]
    if isinstance(value, np.ndarray):
        return "array", value.dtype, value.shape
    return type(value)


def assert_one_form(infos: Iterator[Info], wanted: Any = None) -> list[Info]:
    """Asserts that all infos have one form, which is that of a given one; returns them."""
    found = list(infos)
    wanted = form(found[0]) if wanted is None else wanted
    for number, info in enumerate(found):
        assert form(info) == wanted, f"info {number}"
    return found


def episodes(env: gym.Env[Any, Any], count: int = 2) -> Iterator[Info]:
    """Yields the infos of episodes with random actions, of which many are refused."""
    env.action_space.seed(1)
    for seed in range(count):
        yield env.reset(seed=seed)[1]
        over = False
        while not over:
            _, _, terminated, truncated, info = env.step(env.action_space.sample())
            over = terminated or truncated
            yield info


@pytest.mark.parametrize("name", IDS)
def test_infos_of_every_id(name: str) -> None:
    found = assert_one_form(episodes(gym.make(f"dorothie_gym/{name}", **arguments_of(name))))
    assert len(found) > 5
    if name not in (*TASKS, "Town-v0", "Navigation-continuous-v0"):
        assert any(any(info["refused"].values()) for info in found), "nothing was refused"


@pytest.mark.parametrize("name", [name for name in IDS if name not in ("Navigation-continuous-v0",)])
def test_infos_of_flat_environments(name: str) -> None:
    assert_one_form(episodes(dorothie_gym.flatten(gym.make(f"dorothie_gym/{name}", **arguments_of(name))), 1))


@pytest.mark.parametrize("task", ["ufn", "rfn", "nfd"])
def test_infos_of_live_tasks(task: str) -> None:
    config = EnvConfig(max_seconds=60.0)
    assert_one_form(episodes(TeacherForcing(DuoWizardEnv("brookside", config=config), task), 1))


def parallel_episodes(env: Any) -> Iterator[dict[str, Info]]:
    for number, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(number)
    for seed in range(2):
        yield env.reset(seed=seed)[1]
        while env.agents:
            infos = env.step({agent: env.action_space(agent).sample() for agent in env.agents})[-1]
            for info in infos.values():
                info.pop("TimeLimit.truncated", None)  # stable-baselines3 expects it at the end only
            yield infos


@pytest.mark.parametrize("wrapped", [lambda env: env, IdenticalSpaces], ids=["plain", "identical spaces"])
def test_infos_of_the_parallel_form(wrapped: Callable[[Any], Any]) -> None:
    env = pettingzoo.make("parallel", "dorothie_gym/DuoWizard-v0", config=EnvConfig(max_seconds=SECONDS))
    found = assert_one_form(parallel_episodes(wrapped(env)))
    for agent in ("participant", "co_wizard"):
        assert any(any(infos[agent]["refused"].values()) for infos in found), agent


def test_infos_of_the_turn_based_form() -> None:
    env = pettingzoo.make("aec", "dorothie_gym/DuoWizard-v0", config=EnvConfig(max_seconds=SECONDS))
    found: dict[str, list[Info]] = {agent: [] for agent in env.possible_agents}
    for seed in range(2):
        env.reset(seed=seed)
        for agent in env.agent_iter():
            *_, terminated, truncated, info = env.last()
            found[agent].append(info)
            env.step(None if terminated or truncated else env.action_space(agent).sample())
    for infos in found.values():
        assert len(infos) > 10
        assert_one_form(iter(infos))


# --- Batches ----------------------------------------------------------------------------------------------------------

FINAL = ("final_obs", "_final_obs", "final_info", "_final_info")
"""What Gymnasium adds to the infos of the mode `SAME_STEP` where an episode is over."""


def batch_infos(env: Any, steps: int) -> Iterator[tuple[Info, Info | None]]:
    """Yields the infos of a batch, and those of episodes that were reset in the same step."""
    env.action_space.seed(2)
    disabled = env.metadata["autoreset_mode"] is AutoresetMode.DISABLED
    yield env.reset(seed=5)[1], None
    for _ in range(steps):
        _, _, terminated, truncated, info = env.step(env.action_space.sample())
        yield {key: value for key, value in info.items() if key not in FINAL}, info.get("final_info")
        if disabled and (terminated | truncated).any():
            yield env.reset(options={"reset_mask": terminated | truncated})[1], None


def batch_of(name: str, mode: AutoresetMode, native: bool) -> Any:
    if native:
        return gym.make_vec(
            f"dorothie_gym/{name}",
            2,
            vectorization_mode="vector_entry_point",
            autoreset_mode=mode,
            **arguments_of(name),
        )
    vector = {"autoreset_mode": mode}
    return gym.make_vec(
        f"dorothie_gym/{name}", 2, vectorization_mode="sync", vector_kwargs=vector, **arguments_of(name)
    )


NATIVE = ("Navigation-v0", "Navigation-continuous-v0")


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize(("name", "native"), [*((name, False) for name in IDS), *((name, True) for name in NATIVE)])
def test_infos_of_batches(name: str, native: bool, mode: AutoresetMode) -> None:
    env = batch_of(name, mode, native)
    steps = {"Town-v0": 12, "Navigation-continuous-v0": 90}.get(name, 30)
    found = list(batch_infos(env, steps))
    assert_one_form(info for info, _ in found)
    ends = [final for _, final in found if final is not None]
    assert bool(ends) == (mode is AutoresetMode.SAME_STEP)
    assert_one_form(iter([found[0][0], *ends]))
    env.close()


@pytest.mark.parametrize("name", NATIVE)
def test_infos_of_batches_have_the_form_of_gymnasium(name: str) -> None:
    forms = []
    for native in (False, True):
        env = batch_of(name, AutoresetMode.NEXT_STEP, native)
        forms.append(form(env.reset(seed=1)[1]))
        env.close()
    assert forms[0] == forms[1]


@pytest.mark.parametrize("mode", AutoresetMode)
def test_infos_of_batches_of_three_agents(mode: AutoresetMode) -> None:
    env = DuoWizardVectorEnv(2, "brookside", config=EnvConfig(max_seconds=SECONDS), autoreset_mode=mode, threads=1)
    for number, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(number)
    found, ends = [env.reset(seed=3)[1]], []
    for _ in range(30):
        actions = {agent: env.action_space(agent).sample() for agent in env.possible_agents}
        _, _, terminated, truncated, infos = env.step(actions)
        ends += [info["final_info"] for info in infos.values() if "final_info" in info]
        found.append({agent: {k: v for k, v in info.items() if k not in FINAL} for agent, info in infos.items()})
        over = terminated["participant"] | truncated["participant"]
        if mode is AutoresetMode.DISABLED and over.any():
            found.append(env.reset(options={"reset_mask": over})[1])
    assert_one_form(iter(found))
    assert bool(ends) == (mode is AutoresetMode.SAME_STEP)
    for k, end in enumerate(ends):
        assert form(end) == form(found[0][env.possible_agents[k % 3]])
    env.close()


# --- Values -----------------------------------------------------------------------------------------------------------


def test_refusals_have_a_reason_by_kind_of_action() -> None:
    env = gym.make("dorothie_gym/CoWizard-v0", town="brookside")
    _, info = env.reset(seed=1)
    assert info["refused"] == {"speech": False, "mental": False, "physical": False} and info["refusal_reason"] == ""
    assert (
        info["reward_terms"] == dict.fromkeys(("subgoal", "success", "collision", "time", "refusal", "talk"), 0.0)
        and info["is_success"] is False
    )
    action = {**env.get_wrapper_attr("noop_action"), "physical": 6}
    *_, info = env.step(action)
    assert info["refused"] == {"speech": False, "mental": False, "physical": True}
    assert info["refusal_reason"] == "Start: the car is not stopped"
    assert info["reward_terms"]["refusal"] < 0.0
    *_, info = env.step(env.get_wrapper_attr("noop_action"))
    assert not any(info["refused"].values()) and info["refusal_reason"] == ""


def test_rewards_are_the_sums_of_their_terms() -> None:
    for name in ("Participant-v0", "Navigation-v0"):
        env = gym.make(f"dorothie_gym/{name}", **arguments_of(name))
        _, info = env.reset(seed=1)
        assert not any(info["reward_terms"].values())
        for _ in range(6):
            _, reward, *_, info = env.step(env.action_space.sample())
            assert reward == pytest.approx(sum(info["reward_terms"].values()))


def test_tasks_say_that_nothing_was_predicted_yet() -> None:
    for name in TASKS:
        _, info = gym.make(f"dorothie_gym/{name}", **arguments_of(name)).reset(seed=1)
        assert info["index"] == -1 and not any(info["reward_terms"].values())
        assert all(np.isnan(value) for value in info["metrics"].values())
