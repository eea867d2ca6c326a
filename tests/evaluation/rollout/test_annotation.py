"""What a session says of its exchanges and transactions is what the rules find in its recording."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.analysis.agreement import inconsistencies
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session


@pytest.mark.parametrize("seed", [3, 8, 21])
def test_stored_exchanges_and_transactions_equal_derived_ones(seed: int, tmp_path: Path) -> None:
    env = DuoWizardEnv("brookside", config=EnvConfig(max_seconds=150.0))
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    play_session(env, policies, seed=seed, folder=tmp_path / "session")
    session = Session.load(tmp_path / "session")
    moves = [move for utterance in session.utterances() for move in utterance.moves]
    assert len(moves) > 10
    assert all(move.transaction is not None for move in moves)
    assert inconsistencies(session) == ()
