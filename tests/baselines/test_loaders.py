"""The table of loaders names functions and kinds that exist."""

from __future__ import annotations

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")
pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym.baselines import checkpoints, loaders
from dorothie_gym.baselines.rl import checkpoint
from dorothie_gym.baselines.roles.co_wizard.files import FILES as CO_WIZARD_FILES
from dorothie_gym.baselines.roles.participant.files import FILES as PARTICIPANT_FILES
from dorothie_gym.policies.policy_loader import MODEL_LOADERS


def test_each_kind_of_model_has_a_loader() -> None:
    roles = {CO_WIZARD_FILES.kind, PARTICIPANT_FILES.kind}
    assert set(MODEL_LOADERS) == {checkpoints.KIND, checkpoint.KIND, *roles}
    for entry in MODEL_LOADERS.values():
        module, name = entry.split(":")
        assert module == loaders.__name__ and callable(getattr(loaders, name))
