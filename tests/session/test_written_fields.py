"""Every field of every role's observation has a writer: it takes a value other than zero in some session."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.testing.playing import play_random, play_scripted

MOST = 6


@pytest.mark.long
def test_every_field_is_written() -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=420.0))
    missing = {(str(role), field) for role in AGENT_ROLES for field in env.observation_space(str(role)).spaces}
    assert len(missing) > 40
    sessions = (
        play(env, seed=seed, decisions=600) for seed in range(31, 31 + MOST) for play in (play_random, play_scripted)
    )
    for decision in itertools.chain.from_iterable(sessions):
        missing -= {(agent, field) for agent, field in missing if is_written(decision.observations[agent][field])}
        if not missing:
            break
    assert not missing, f"nothing was ever written to {sorted(missing)}"


def is_written(value: object) -> bool:
    return bool(value) if isinstance(value, str) else bool(np.any(np.asarray(value)))
