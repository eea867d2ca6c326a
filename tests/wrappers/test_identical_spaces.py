from __future__ import annotations

import itertools
import warnings

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import ActionValue, DialogueMove, PhysicalAction
from dorothie_gym.wrappers.identical_spaces import IdenticalSpaces

with warnings.catch_warnings():
    # PettingZoo's tests import an environment of its own in a way that it has deprecated.
    warnings.filterwarnings("ignore", "The old environment creation API", DeprecationWarning)
    from pettingzoo.test import parallel_api_test

FEW = {"participant": ["move"], "co_wizard": ["physical", "angle"], "ad_wizard": ["exception"]}


def make(max_cycles: int = 30) -> DuoWizardEnv:
    return DuoWizardEnv("brookside", max_cycles=max_cycles)


def test_environment_passes_pettingzoo_checks() -> None:
    parallel_api_test(IdenticalSpaces(make(12)), num_cycles=30)


def test_all_roles_have_the_same_spaces() -> None:
    env = IdenticalSpaces(make())
    assert len({str(env.observation_space(agent)) for agent in env.possible_agents}) == 1
    assert len({str(env.action_space(agent)) for agent in env.possible_agents}) == 1
    observations, _ = env.reset(seed=0)
    for k, agent in enumerate(env.possible_agents):
        assert env.observation_space(agent).contains(observations[agent])
        assert observations[agent][-3:].tolist() == [float(k == i) for i in range(3)]


def test_flat_actions_decode_to_the_actions_of_the_role() -> None:
    env = IdenticalSpaces(make(), FEW)
    assert env.nvec.shape == (2,) and env.nvec[0] >= 360  # the angle comes first, by the alphabet
    env.reset(seed=0)
    stop = np.array([180, PhysicalAction.STOP])
    taken = env.unflatten("co_wizard", stop)
    assert taken["physical"] == PhysicalAction.STOP and taken["angle"] == 0 and taken["utterance"] == ""
    assert env.unflatten("participant", np.array([DialogueMove.ALIGN, 7]))["move"] == DialogueMove.ALIGN
    assert env.unflatten("participant", np.array([300, 0]))["move"] == 0  # it has no such value
    env.step({agent: stop if agent == "co_wizard" else np.array([0, 0]) for agent in env.agents})
    assert env.unwrapped.session.world.planner.held
    assert ActionValue.STOP.value == PhysicalAction.STOP


def test_masks_have_one_entry_per_value() -> None:
    env = IdenticalSpaces(make(), FEW)
    _, infos = env.reset(seed=0)
    start = np.concatenate(([0], np.cumsum(env.nvec)))
    for agent in env.agents:
        assert infos[agent]["action_mask"].shape == (start[-1],)
    physical = infos["co_wizard"]["action_mask"][start[1] :]
    assert physical[PhysicalAction.STOP] and not physical[PhysicalAction.START]
    second = infos["participant"]["action_mask"][start[1] :]
    assert second[0] == 1 and not second[1:].any()  # the participant has no second entry


def test_masked_actions_of_all_roles_are_carried_out() -> None:
    env = IdenticalSpaces(make(), FEW)
    rng = np.random.default_rng(0)
    _, infos = env.reset(seed=1)
    start = np.concatenate(([0], np.cumsum(env.nvec)))
    while env.agents:
        actions = {
            agent: np.array(
                [rng.choice(np.flatnonzero(infos[agent]["action_mask"][a:b])) for a, b in itertools.pairwise(start)]
            )
            for agent in env.agents
        }
        _, _, _, truncations, infos = env.step(actions)
    assert all(truncations.values())


@pytest.mark.parametrize("only_masks", [False, True])
def test_infos_of_the_last_step_tell_a_time_limit_from_an_end(only_masks: bool) -> None:
    env = IdenticalSpaces(make(2), FEW, only_masks=only_masks)
    env.reset(seed=0)
    nothing = {agent: np.zeros(len(env.nvec), dtype=np.int64) for agent in env.agents}
    *_, infos = env.step(nothing)
    assert not any("TimeLimit.truncated" in info for info in infos.values())
    *_, truncations, infos = env.step(nothing)
    assert all(truncations.values())
    assert [info.get("TimeLimit.truncated") for info in infos.values()] == [None if only_masks else True] * 3


def test_invalid_arguments_raise_error() -> None:
    with pytest.raises(ValueError, match="fields: 'driver'"):
        IdenticalSpaces(make(), {"driver": ["move"]})
    env = IdenticalSpaces(make(), FEW)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="action of co_wizard"):
        env.unflatten("co_wizard", np.zeros(3))
