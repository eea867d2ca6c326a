"""Contract of a policy: a stateless object whose memory is passed in and handed back, so that replay is exact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

import numpy as np

from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.spaces import ActionDict, SpaceLimits

State = TypeVar("State")


class Policy(ABC, Generic[State]):
    """Acts for a role on what that role observes.

    Attributes:
        role: whom it acts for.
        limits: sizes of the spaces that it acts in.
    """

    def __init__(self, role: Role, limits: SpaceLimits | None = None) -> None:
        """Prepares a policy for `role`; the sizes of the spaces default to those of `SpaceLimits`."""
        self.role = role
        self.limits = SpaceLimits() if limits is None else limits

    @abstractmethod
    def initial_state(self, seed: int, town: Town) -> State:
        """What the policy knows before the first decision.

        Args:
            seed: all that is drawn by chance follows from it.
            town: the map, which everybody knows; what stands in it comes with the observations.
        """

    @abstractmethod
    def step(self, observation: Mapping[str, Any], state: State) -> tuple[ActionDict, State]:
        """Decides on an action.

        Args:
            observation: of the role, see `observation_space`.
            state: as `initial_state` or the step before returned it; it is left as it is.

        Returns:
            An action of the role's action space, and the state for the next decision.
        """


_POLICIES = 2
"""Branch of a session's seed; the environment draws from others."""


def policy_seed(seed: int, role: Role) -> int:
    """Returns the seed of a role's policy in the session of a seed: 32 bits, other ones for each role."""
    branch = np.random.SeedSequence([seed, _POLICIES, AGENT_ROLES.index(role)])
    return int(branch.generate_state(1)[0])
