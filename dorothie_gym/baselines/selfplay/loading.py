"""Makes what self-play has learned playable by name of its folder; torch is imported when that is wanted."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from dorothie_gym.ontology import Role
from dorothie_gym.policies import Policy
from dorothie_gym.spaces import SpaceLimits

KIND: Final = "selfplay"
"""What `model.json` says of its kind."""


def load_role(path: Path, role: Role, limits: SpaceLimits) -> Policy[Any]:
    """Reads what was learned for a role, see `policy.read_policy`."""
    from dorothie_gym.baselines.selfplay.policy import read_policy

    return read_policy(path, role, limits)
