"""Drivers that learned in `Navigation-v0`, as players of the Co-Wizard; torch is imported when one is loaded."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from dorothie_gym.ontology import Role
from dorothie_gym.policies import Policy
from dorothie_gym.spaces import SpaceLimits

KIND: Final = "dorothie_gym-rl"
"""What `model.json` of `train-rl` says it is."""


def load_driver(path: Path, role: Role, limits: SpaceLimits) -> Policy[Any]:
    """Reads a model of `train-rl` as a Co-Wizard.

    Args:
        path: folder of the model, or a file in it.
        role: whom it is to play.
        limits: sizes of the spaces.

    Raises:
        ValueError: it did not learn to drive as the Co-Wizard, or the files are missing or damaged.
    """
    if role is not Role.CO_WIZARD:
        raise ValueError(f"{path} drives: it can play the co_wizard, and no {role}")
    from dorothie_gym.baselines.rl.player import make_player

    return make_player(path, limits)
