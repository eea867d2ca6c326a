"""A folder of `dorothie-gym train` becomes a Co-Wizard; torch is imported when one is made, not before."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dorothie_gym.ontology import Role
from dorothie_gym.policies import Policy
from dorothie_gym.spaces import SpaceLimits


def load_co_wizard(path: Path, role: Role, limits: SpaceLimits) -> Policy[Any]:
    """Returns the policy of a trained model.

    Args:
        path: folder of the training, or its `model.json`.
        role: whom it is to play.
        limits: sizes of the spaces.

    Raises:
        ValueError: it plays another role than the Co-Wizard, or a file of it is missing or damaged.
    """
    if role is not Role.CO_WIZARD:
        raise ValueError(f"{path}: models of the benchmark play the Co-Wizard, not the {role}")
    from dorothie_gym.baselines.acting.policy import BenchmarkCoWizard
    from dorothie_gym.baselines.acting.trained import Trained

    return BenchmarkCoWizard(Trained.load(path.resolve()), limits)
