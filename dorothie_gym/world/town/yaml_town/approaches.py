"""The arms of a crossing with the lanes that were built for them."""

from __future__ import annotations

from dataclasses import dataclass

from dorothie_gym.world.town.model import Lane
from dorothie_gym.world.town.yaml_town.arms import Arm


@dataclass(frozen=True, kw_only=True, eq=False)
class Approach:
    """An arm and its lanes, from the kerb inwards.

    Attributes:
        arm: as it was laid out.
        through: lanes that come in.
        pocket: the left-turn lane that comes in beside them, or None.
        outgoing: lanes that go out.
    """

    arm: Arm
    through: tuple[Lane, ...]
    pocket: Lane | None
    outgoing: tuple[Lane, ...]

    @property
    def incoming(self) -> tuple[Lane, ...]:
        """All lanes that come in."""
        return self.through if self.pocket is None else (*self.through, self.pocket)
