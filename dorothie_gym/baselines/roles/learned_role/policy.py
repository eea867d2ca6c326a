"""Common parts of the players of both roles: their network, the forms of their vocabulary, and draws of remarks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from dorothie_gym.policies.policy import BatchPolicy

if TYPE_CHECKING:
    from dorothie_gym.baselines.roles.learned_role.remark_forms import Sources
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.spaces.fields import SpaceLimits

State = TypeVar("State")
Network = TypeVar("Network", bound=nn.Module)


class LearnedPolicy(BatchPolicy[State], Generic[State, Network]):
    """Player of a role whose decisions and forms of remarks are those of a network."""

    def __init__(
        self,
        role: Role,
        network: Network,
        vocabulary: Sequence[str],
        limits: SpaceLimits | None,
        needs: Callable[[str], frozenset[str]],
    ) -> None:
        """Prepares the player.

        Args:
            role: the role.
            network: trained network.
            vocabulary: forms of remarks; the first one stands for silence.
            limits: sizes of the spaces.
            needs: returns the names of the sources that a form needs.
        """
        super().__init__(role, limits)
        torch.set_num_threads(1)  # a small network: more threads only wait for each other
        self._network, self._vocabulary = network.eval(), tuple(vocabulary)
        self._needs = [needs(form) if form else frozenset() for form in self._vocabulary]

    def _fillable(self, available: Sources) -> NDArray[np.bool_]:
        """Returns which forms (r,) have all their sources."""
        return np.array([needs <= available.keys() for needs in self._needs])


def drawn(shares: NDArray[np.float64], rng: np.random.Generator) -> int:
    """Returns a number drawn in proportion to shares; 0 if all are 0."""
    total = float(shares.sum())
    if total <= 0.0:
        return 0
    return min(int(np.searchsorted(np.cumsum(shares), rng.random() * total)), len(shares) - 1)
