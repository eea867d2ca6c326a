"""Interfaces of the three roles, and the layout of their vectors and masks in one row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.baselines.selfplay.ad_wizard import AdWizardInterface
from dorothie_gym.baselines.selfplay.co_wizard import CoWizardInterface
from dorothie_gym.baselines.selfplay.participant import ParticipantInterface
from dorothie_gym.baselines.selfplay.role_interface import Mask, RoleInterface, Vector
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.spaces import SpaceLimits

_SEATS: dict[Role, type[RoleInterface[Any]]] = {
    seat.role: seat for seat in (ParticipantInterface, CoWizardInterface, AdWizardInterface)
}  # fmt: skip


def make_interface(role: Role, town: Town, limits: SpaceLimits) -> RoleInterface[Any]:
    """Returns the interface of a role."""
    return _SEATS[role](town, limits)


@dataclass(frozen=True)
class RoleLayout:
    """Sizes of the vectors and numbers of the actions of the three roles, in the order of `AGENT_ROLES`.

    A row of the table has the three vectors, then the three masks. One network for all roles takes the `padded` form:
    vectors filled up with zeros to the longest, then the role, one-hot; masks filled up with what may not be done.
    """

    sizes: tuple[int, ...]
    actions: tuple[int, ...]

    @classmethod
    def of(cls, limits: SpaceLimits) -> RoleLayout:
        """Returns the layout for sizes of spaces."""
        seats = [_SEATS[role] for role in AGENT_ROLES]
        return cls(tuple(seat.size_for(limits) for seat in seats), tuple(seat.actions for seat in seats))

    @property
    def width(self) -> int:
        """Numbers of a row."""
        return sum(self.sizes) + sum(self.actions)

    @property
    def padded_size(self) -> int:
        """Numbers of a padded vector."""
        return max(self.sizes) + len(self.sizes)

    @property
    def padded_actions(self) -> int:
        """Places of a padded mask."""
        return max(self.actions)

    def vectors(self, rows: Vector, role: int, *, padded: bool) -> Vector:
        """Returns the vectors of a role, given by its place in `AGENT_ROLES`, in rows (n, width)."""
        begin = sum(self.sizes[:role])
        own = rows[:, begin : begin + self.sizes[role]]
        if not padded:
            return own
        return pad_vectors(own, role, self.padded_size)

    def masks(self, rows: Vector, role: int, *, padded: bool) -> Mask:
        """Returns the masks of a role in rows (n, width)."""
        begin = sum(self.sizes) + sum(self.actions[:role])
        own = rows[:, begin : begin + self.actions[role]] > 0.0
        return pad_masks(own, self.padded_actions) if padded else own


def pad_vectors(vectors: Vector, role: int, size: int) -> Vector:
    """Returns vectors (n, m) of a role padded to (n, size); the last numbers encode the role."""
    padded = np.zeros((len(vectors), size), dtype=np.float32)
    padded[:, : vectors.shape[1]] = vectors
    padded[:, size - len(AGENT_ROLES) + role] = 1.0
    return padded


def pad_masks(masks: Mask, actions: int) -> Mask:
    """Returns masks (n, m) padded to (n, actions)."""
    padded: NDArray[np.bool_] = np.zeros((len(masks), actions), dtype=np.bool_)
    padded[:, : masks.shape[1]] = masks
    return padded
