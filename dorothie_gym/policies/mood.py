"""Mood of a scripted speaker: stress, hurry and trust, which events move and time calms."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from dorothie_gym.policies.policy import replace
from dorothie_gym.support import portable_math as pm

HALF_LIFE = 120.0
"""Time in which half of a deviation from the usual mood is gone [s]; set by hand."""


class Happening(enum.Enum):
    """Event that moves a mood, with its effect on stress, hurry and trust; the sizes are set by hand."""

    RED_LIGHT = 0.06, 0.08, 0.0
    WRONG_WAY = 0.2, 0.1, -0.25
    MISSED = 0.25, 0.15, -0.2
    MISUNDERSTOOD = 0.12, 0.0, -0.15
    CHANGED_TASK = 0.1, 0.15, 0.0
    OBSTACLE = 0.1, 0.1, 0.0
    DONE = -0.2, -0.1, 0.15


@dataclass(frozen=True, kw_only=True)
class Mood:
    """State of mind. Each part is in [0, 1].

    Attributes:
        stress: 0 when calm.
        hurry: 0 with time to spare.
        trust: in the other one; usually 0.5.
        at: time of the last change [s].
    """

    stress: float = 0.0
    hurry: float = 0.0
    trust: float = 0.5
    at: float = 0.0

    def after(self, happening: Happening, now: float) -> Mood:
        """Returns the mood after an event at a time [s]."""
        kept = pm.power(0.5, (now - self.at) / HALF_LIFE)
        stress, hurry, trust = happening.value
        return replace(
            self,
            stress=_share(self.stress * kept + stress),
            hurry=_share(self.hurry * kept + hurry),
            trust=_share(0.5 + (self.trust - 0.5) * kept + trust),
            at=now,
        )

    def rarer(self, chance: float) -> float:
        """Returns a probability that stress lowers; 0 and 1 stay."""
        return pm.power(chance, 1.0 + 2.0 * self.stress)

    def likelier_without_trust(self, chance: float) -> float:
        """Returns a probability that mistrust raises and trust lowers; 0 and 1 stay."""
        return pm.power(chance, 0.4 + 1.2 * self.trust)

    def likelier_in_hurry(self, chance: float) -> float:
        """Returns a probability that hurry raises; 0 and 1 stay."""
        return pm.power(chance, 1.0 - 0.6 * self.hurry)


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)
