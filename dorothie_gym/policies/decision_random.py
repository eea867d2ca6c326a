"""Random numbers of policies: the seed of each role's policy, and the generator of a decision.

A generator is made when something is first drawn from it: most decisions draw nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from dorothie_gym.ontology.roles import AGENT_ROLES, Role

_SEED_BRANCH: Final = 2
"""Branch of the session's seed that policies draw from; the environment uses other branches."""


class _DeferredGenerator:
    """Stands for the generator of a seed, which is made at the first use of one of its attributes."""

    __slots__ = ("_generator", "_seed")

    def __init__(self, seed: tuple[int, ...]) -> None:
        self._seed = seed
        self._generator: np.random.Generator | None = None

    def __getattr__(self, name: str) -> Any:
        if self._generator is None:
            self._generator = np.random.default_rng(self._seed)
        return getattr(self._generator, name)


def decision_random(*seed: int) -> np.random.Generator:
    """Returns the random generator of a decision.

    Args:
        seed: seed of the session's policy, and the number of the decision.
    """
    if TYPE_CHECKING:
        return np.random.default_rng(seed)
    return cast("np.random.Generator", _DeferredGenerator(seed))


def policy_seed(seed: int, role: Role, trial: int = 0) -> int:
    """Returns the seed of a role's policy in the session of a seed: 32 bits, different for each role.

    Args:
        seed: seed of the session.
        role: the role.
        trial: number of the trial, of several of one scenario.
    """
    repeated = [trial] if trial else []
    branch = np.random.SeedSequence([seed, _SEED_BRANCH, AGENT_ROLES.index(role), *repeated])
    return int(branch.generate_state(1)[0])
