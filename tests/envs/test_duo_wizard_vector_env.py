"""Vectorised `DuoWizard-v0` against single environments."""

from __future__ import annotations

import copy
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.envs.duo_wizard_vector_env import DuoWizardVectorEnv
from dorothie_gym.ontology import AGENT_ROLES, ExceptionKind, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.policies.decision_random import policy_seed
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.spaces import noop
from dorothie_gym.sim.config import WorldConfig
from tests.envs.test_navigation_vector_env import check_equal

AGENTS = [str(role) for role in AGENT_ROLES]
Choose = Callable[["Single"], dict[str, Any]]


class Single:
    """A single environment that begins anew after its session, as the autoreset mode has it."""

    def __init__(self, number: int, mode: AutoresetMode, **arguments: Any) -> None:
        self.env, self.mode = DuoWizardEnv(**arguments), mode
        for k, agent in enumerate(AGENTS):
            self.env.action_space(agent).seed(100 * number + k)
        self.over, self.states = False, {}

    def reset(self, seed: int | None = None) -> None:
        self.observations, self.infos = self.env.reset(seed=seed)
        self.over = False
        self.policies = {role: make_policy("scripted", role, self.env.limits) for role in AGENT_ROLES}
        seed = self.env.scenario.seed
        self.states = {
            role: policy.initial_state(policy_seed(seed, role), self.env.town) for role, policy in self.policies.items()
        }
        self.rewards, self.ends = dict.fromkeys(AGENTS, 0.0), (False, False)

    def step(self, actions: dict[str, Any]) -> None:
        if self.over:
            self.reset()
            return
        self.observations, self.rewards, terminations, truncations, self.infos = self.env.step(actions)
        self.ends = terminations[AGENTS[0]], truncations[AGENTS[0]]
        self.over = any(self.ends)
        self.final: tuple[Any, Any] | None = None
        if self.over and self.mode is AutoresetMode.SAME_STEP:
            rewards, ends = self.rewards, self.ends
            self.final = self.observations, self.infos
            self.reset()
            self.rewards, self.ends = rewards, ends

    def at_random(self) -> dict[str, Any]:
        return {agent: self.env.action_space(agent).sample(mask=self.infos[agent]["action_mask"]) for agent in AGENTS}

    def by_script(self) -> dict[str, Any]:
        actions = {}
        for role, policy in self.policies.items():
            actions[str(role)], self.states[role] = policy.step(self.observations[role], self.states[role])
        return actions

    def disturbing(self) -> dict[str, Any]:
        """Scripted driving and talk, and spawned actors, props, faults and weather at random."""
        actions = {**self.by_script(), "ad_wizard": self.at_random()["ad_wizard"]}
        if self.env.session.decisions % 3 == 0:
            kinds = ExceptionKind.SPAWN_VEHICLES, ExceptionKind.SPAWN_PEDESTRIANS, ExceptionKind.PLACE_PROP
            actions["ad_wizard"]["exception"] = int(kinds[self.env.session.decisions // 3 % 3])
            actions["ad_wizard"]["extent"], actions["ad_wizard"]["count"] = 100, 12
        return actions


def info_of(info: dict[str, Any], number: int) -> dict[str, Any]:
    """Returns the info of one environment in the form of the single environment."""
    found = {}
    for name, values in info.items():
        if name.startswith("_") or not info.get(f"_{name}", np.ones(number + 1))[number]:
            continue
        if isinstance(values, dict):
            found[name] = info_of(values, number)
        else:
            found[name] = None if values is None else values[number]
    return found


def plain_info(info: dict[str, Any], number: int) -> dict[str, Any]:
    found = info_of(info, number)
    if "plan" in found["action_mask"]:
        found["action_mask"]["plan"] = tuple(found["action_mask"]["plan"])
    found["refused"] = {kind: bool(refused) for kind, refused in found["refused"].items()}
    found["infractions"] = {kind: int(count) for kind, count in found["infractions"].items()}
    found["reward_terms"] = {name: float(value) for name, value in found["reward_terms"].items()}
    return found


def plain_terms(info: dict[str, Any]) -> dict[str, Any]:
    return {**info, "reward_terms": {name: float(value) for name, value in info["reward_terms"].items()}}


def check_environment(number: int, single: Single, observations: Any, infos: Any) -> None:
    for agent in AGENTS:
        seen = {name: values[number] for name, values in observations[agent].items()}
        check_equal(seen, {name: single.observations[agent][name] for name in seen}, f"{number}.{agent}")
        assert seen.keys() == single.observations[agent].keys()
        found, expected = plain_info(infos[agent], number), plain_terms(single.infos[agent])
        for name in expected:
            check_equal(found[name], expected[name], f"{number}.{agent}.{name}")


def play_both(
    batch: DuoWizardVectorEnv, singles: Sequence[Single], choose: Choose, steps: int, *, stacked: bool = False
) -> int:
    """Plays the same actions in a batch and in single environments; returns the number of sessions that ended."""
    observations, infos = batch.reset(seed=5)
    for number, single in enumerate(singles):
        single.reset(5 + number)
        check_environment(number, single, observations, infos)
    ended = 0
    for _ in range(steps):
        actions = [choose(single) for single in singles]
        given: Any = actions
        if stacked:
            given = {
                agent: {
                    name: np.array([each[agent][name] for each in actions])
                    if not isinstance(actions[0][agent][name], str)
                    else tuple(each[agent][name] for each in actions)
                    for name in actions[0][agent]
                }
                for agent in AGENTS
            }
        observations, rewards, terminations, truncations, infos = batch.step(given)
        for number, (single, own) in enumerate(zip(singles, actions, strict=True)):
            single.step(own)
            check_environment(number, single, observations, infos)
            for agent in AGENTS:
                assert rewards[agent][number] == single.rewards[agent]
                assert (terminations[agent][number], truncations[agent][number]) == single.ends
                assert observations[agent]["time"].shape == (len(singles), 1)
            engine, there = batch.engines[number], single.env.engine
            assert engine.last_events == there.last_events
            check_equal(engine.last_frames, there.last_frames)
            check_equal(engine.summary(), there.summary())
            if single.final is not None:
                for agent in AGENTS:
                    check_equal(
                        infos[agent]["final_obs"][number],
                        {name: single.final[0][agent][name] for name in infos[agent]["final_obs"][number]},
                    )
                    final = plain_info(infos[agent]["final_info"], number)
                    expected = plain_terms(single.final[1][agent])
                    check_equal({name: final[name] for name in expected}, expected)
        over = terminations[AGENTS[0]] | truncations[AGENTS[0]]
        ended += int(over.sum())
        if batch.autoreset_mode is AutoresetMode.DISABLED and over.any():
            observations, infos = batch.reset(options={"reset_mask": over})
            for number in np.flatnonzero(over).tolist():
                singles[number].reset()
                check_environment(number, singles[number], observations, infos)
    batch.close()
    return ended


def make_both(
    count: int, mode: AutoresetMode, *, towns: Sequence[str] = ("brookside",), threads: int = 2, **arguments: Any
) -> tuple[DuoWizardVectorEnv, list[Single]]:
    batch = DuoWizardVectorEnv(count, towns, autoreset_mode=mode, threads=threads, **arguments)
    return batch, [Single(k, mode, town=towns[k % len(towns)], **arguments) for k in range(count)]


@pytest.mark.long
@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("choose", [Single.at_random, Single.by_script])
def test_batch_is_equal_to_single_environments(mode: AutoresetMode, choose: Choose) -> None:
    batch, singles = make_both(3, mode, max_cycles=25)
    assert play_both(batch, singles, choose, 70) >= 6


def test_stacked_actions_are_those_of_the_environments() -> None:
    play_both(*make_both(2, AutoresetMode.NEXT_STEP, max_cycles=20), Single.at_random, 45, stacked=True)


def test_towns_take_turns_and_worlds_may_grow() -> None:
    config = EnvConfig(world=WorldConfig(vehicles=3, pedestrians=2), word_error_rate=0.2, observe_acts=False)
    towns = ("brookside", "midtown")
    batch, singles = make_both(5, AutoresetMode.SAME_STEP, towns=towns, config=config, max_cycles=60)
    assert play_both(batch, singles, Single.disturbing, 70) == 5


TINY = CameraConfig(width=24, height=16, outputs=tuple(CameraOutput))


@pytest.mark.long
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_pictures_are_those_of_single_environments(mode: AutoresetMode) -> None:
    batch, singles = make_both(3, mode, towns=("brookside", "midtown"), config=EnvConfig(camera=TINY), max_cycles=8)
    assert batch.single_observation_spaces["co_wizard"]["camera"].shape == (16, 24, 3)
    assert batch.observation_spaces["participant"]["depth"].shape == (3, 16, 24)
    assert "camera" not in batch.single_observation_spaces["ad_wizard"].spaces
    assert play_both(batch, singles, Single.disturbing, 20) >= 6


def test_number_of_threads_changes_no_byte_of_pictures() -> None:
    one, two = (
        DuoWizardVectorEnv(5, "brookside", config=EnvConfig(camera=TINY), threads=threads) for threads in (1, 2)
    )
    check_equal(one.reset(seed=2), two.reset(seed=2))
    for _ in range(6):
        actions = [{agent: noop(Role(agent), one.limits) for agent in AGENTS} for _ in range(5)]
        observations, *_ = outcome = one.step(actions)
        check_equal(outcome, two.step(actions))
    pictures = observations["co_wizard"]["camera"]
    assert len({picture.tobytes() for picture in pictures}) == 5
    pictures[:] = 0
    assert one.batches[0].pictures["camera"].any()  # the caller owns what is handed out


def test_copies_and_states_continue_with_equal_pictures() -> None:
    batch = DuoWizardVectorEnv(2, "brookside", config=EnvConfig(camera=TINY))
    batch.reset(seed=1)
    actions = [{agent: noop(Role(agent), batch.limits) for agent in AGENTS} for _ in range(2)]
    batch.step(actions)
    state, twin = batch.clone_state(), copy.deepcopy(batch)
    expected = [batch.step(actions) for _ in range(3)]
    check_equal([twin.step(actions) for _ in range(3)], expected)
    batch.restore_state(state)
    check_equal([batch.step(actions) for _ in range(3)], expected)


@pytest.mark.parametrize("frequency", [0.2, 30.0])  # several calls of the physics a decision below 2 Hz
def test_decision_frequency_is_that_of_the_single_environment(frequency: float) -> None:
    config = EnvConfig(decision_frequency=frequency, max_seconds=60.0)
    play_both(*make_both(2, AutoresetMode.NEXT_STEP, config=config), Single.disturbing, 25)


@pytest.mark.slow
@pytest.mark.parametrize("choose", [Single.at_random, Single.by_script, Single.disturbing])
@pytest.mark.parametrize("town", ["brookside", "midtown", "millbrook", "northgate"])
@pytest.mark.parametrize(("count", "threads"), [(1, 1), (7, 2), (16, 1)])
def test_many_sessions_are_equal(count: int, threads: int, town: str, choose: Choose) -> None:
    batch, singles = make_both(count, AutoresetMode.NEXT_STEP, towns=(town,), threads=threads, max_cycles=45)
    assert play_both(batch, singles, choose, 100) >= 2 * count


def idle(batch: DuoWizardVectorEnv) -> list[dict[str, Any]]:
    return [{str(role): noop(role, batch.limits) for role in AGENT_ROLES}] * batch.num_envs


def test_observations_and_samples_are_of_the_spaces() -> None:
    batch = DuoWizardVectorEnv(2, "brookside")
    observations, _ = batch.reset(seed=1)
    for agent in AGENTS:
        assert batch.observation_space(agent).contains(observations[agent])
    batch.step({agent: batch.action_space(agent).sample() for agent in AGENTS})


def test_results_are_not_overwritten_by_later_steps() -> None:
    batch = DuoWizardVectorEnv(2, "brookside")
    observations, infos = batch.reset(seed=1)
    kept = copy.deepcopy((observations, infos))
    batch.step(idle(batch))
    check_equal((observations, infos), kept)


def test_copies_and_states_go_on_alike() -> None:
    batch, singles = make_both(3, AutoresetMode.NEXT_STEP, max_cycles=60)
    batch.reset(seed=3)
    for number, single in enumerate(singles):
        single.reset(3 + number)
    for _ in range(20):
        actions = [single.disturbing() for single in singles]
        batch.step(actions)
        for single, own in zip(singles, actions, strict=True):
            single.step(own)
    state, twin, other = batch.clone_state(), copy.deepcopy(batch), DuoWizardVectorEnv(3, "brookside", max_cycles=60)
    script = []
    for _ in range(20):
        script.append([single.disturbing() for single in singles])
        for single, own in zip(singles, script[-1], strict=True):
            single.step(own)
    expected = [batch.step(actions) for actions in script]
    check_equal([twin.step(actions) for actions in script], expected)
    other.restore_state(state)
    check_equal([other.step(actions) for actions in script], expected)
    batch.restore_state(state)
    check_equal([batch.step(actions) for actions in script], expected)


IN_PLAIN_PYTHON = """
import hashlib
from dorothie_gym import DuoWizardVectorEnv, EnvConfig
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.session.spaces import noop
env = DuoWizardVectorEnv(2, threads=1, config=EnvConfig(world=WorldConfig(vehicles=3, pedestrians=2)))
idle = {str(role): noop(role, env.limits) for role in AGENT_ROLES}
observations, infos = env.reset(seed=3)
for _ in range(4):
    observations, *_, infos = env.step([{**idle, "co_wizard": {**idle["co_wizard"], "physical": 7}}, idle])
    digest = hashlib.sha256()
    for agent, seen in observations.items():
        for _, value in sorted(seen.items()):
            digest.update(repr(value).encode() if isinstance(value, tuple) else value.tobytes())
        for name, mask in sorted(infos[agent]["action_mask"].items()):
            digest.update(b"" if mask is None else mask.tobytes())
    print(digest.hexdigest())
"""


@pytest.mark.slow
def test_sessions_are_the_same_bytes_compiled_and_in_plain_python() -> None:
    found = [
        subprocess.run(
            [sys.executable, "-c", IN_PLAIN_PYTHON],
            env={**os.environ, "NUMBA_DISABLE_JIT": disabled},
            cwd=Path(__file__).resolve().parents[2],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for disabled in ("0", "1")
    ]
    assert found[0] == found[1] != ""


def test_sessions_can_be_drawn() -> None:
    batch = DuoWizardVectorEnv(2, "brookside", render_mode="rgb_array")
    single = DuoWizardEnv("brookside", render_mode="rgb_array")
    batch.reset(seed=4)
    single.reset(seed=5)
    batch.step(idle(batch))
    single.step(idle(batch)[0])
    np.testing.assert_array_equal(batch.render_one(1), single.render())


def test_mistakes_are_named() -> None:
    batch = DuoWizardVectorEnv(2, "brookside", max_cycles=1, autoreset_mode="Disabled")
    with pytest.raises(ResetNeeded, match=r"environments \[0, 1\] wait for a reset"):
        batch.step(idle(batch))
    batch.reset(seed=0)
    with pytest.raises(ValueError, match="2 dicts"):
        batch.step(idle(batch)[:1])
    with pytest.raises(ValueError, match="the action of co_wizard is missing"):
        batch.step({"participant": {}})
    wrong = [idle(batch)[0], {**idle(batch)[0], "participant": {"move": 99}}]
    with pytest.raises(ValueError, match="environment 1: action of participant"):
        batch.step(wrong)
    assert [engine.session.decisions for engine in batch.engines] == [0, 0]
    batch.step(idle(batch))
    with pytest.raises(ResetNeeded, match="reset"):
        batch.step(idle(batch))
    for arguments in ({"num_envs": 0}, {"threads": 0}, {"town": ()}, {"render_mode": "human"}):
        with pytest.raises(ValueError, match=next(iter(arguments))):
            DuoWizardVectorEnv(**arguments)
