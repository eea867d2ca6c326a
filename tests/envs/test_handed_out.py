"""Returned observations and infos belong to the caller: the environment neither changes nor reads them later."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.sim.config import WorldConfig
from tests.envs.sessions_played import digest, play_at_random, play_by_script

CONFIG = EnvConfig(world=WorldConfig(vehicles=6, pedestrians=3))


def scribble_over(value: Any) -> None:
    if isinstance(value, np.ndarray):
        value[...] = 1 if value.dtype == np.int8 else 77
    elif isinstance(value, dict):
        for part in value.values():
            scribble_over(part)
        value.clear()
    elif isinstance(value, list | tuple):
        for part in value:
            scribble_over(part)


def test_observations_and_infos_do_not_change_after_further_steps() -> None:
    for play in (play_at_random, play_by_script):
        taken, then = [], []
        for observations, infos, _ in play(DuoWizardEnv("brookside", config=CONFIG), seed=5, decisions=25):
            taken.append((observations, infos))
            then.append(digest((observations, infos)))
        assert [digest(each) for each in taken] == then
        assert len(set(then)) == len(then)


def test_changes_of_returned_objects_have_no_effect() -> None:
    clean = [
        digest((observations, infos))
        for observations, infos, _ in play_at_random(DuoWizardEnv("brookside", config=CONFIG), seed=6, decisions=20)
    ]
    env = DuoWizardEnv("brookside", config=CONFIG)
    for k, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(6 + k)
    observations, infos = env.reset(seed=6)
    scribbled = []
    for _ in range(21):
        scribbled.append(digest((observations, infos)))
        actions = {
            agent: env.action_space(agent).sample(mask=copy.deepcopy(infos[agent]["action_mask"]))
            for agent in env.agents
        }
        scribble_over(observations)
        scribble_over(infos)
        observations, _, _, _, infos = env.step(actions)
    assert scribbled == clean
