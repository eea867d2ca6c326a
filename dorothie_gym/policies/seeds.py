"""Seeds of policies: the same for a session, wherever it is played."""

from __future__ import annotations

import numpy as np

from dorothie_gym.ontology import AGENT_ROLES, Role

_POLICIES = 2
"""Branch of a session's seed; the environment draws from others."""


def policy_seed(seed: int, role: Role) -> int:
    """Returns the seed of a role's policy in the session of a seed: 32 bits, other ones for each role."""
    branch = np.random.SeedSequence([seed, _POLICIES, AGENT_ROLES.index(role)])
    return int(branch.generate_state(1)[0])
