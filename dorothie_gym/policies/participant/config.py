"""Traits of a scripted participant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class ParticipantStyle:
    """How a participant talks in a session.

    Attributes:
        guides: chance that a place which the car may know is guided to turn by turn all the same.
        names_goal: chance that the place is named when guiding.
        names_street: chance that a street is added to a place or a turn.
        hurries: chance that the next task follows in the same breath as the report of the last.
        patience: standing time after which it asks why [s].
        chat: seconds between remarks beside the matter, on average [s].
        waits: chance that the way is told only when the car asks, or when it is nearly too late.
        hints: chance that a step is not commanded, but said to be what one should do.
        reasons: chance that a reason is given with a place, or a step.
        aligns: chance that it makes sure to have been understood.
        nods: chance that what the car explains is acknowledged.
        curious: chance that it asks why the car does something unexpected.
        puzzled: chance that it asks again what the car has said into its own words.
    """

    guides: float
    names_goal: float
    names_street: float
    hurries: float
    patience: float
    chat: float
    waits: float = 0.0
    hints: float = 0.0
    reasons: float = 0.0
    aligns: float = 0.0
    nods: float = 0.2
    curious: float = 0.0
    puzzled: float = 0.0

    @classmethod
    def draw(cls, rng: np.random.Generator) -> ParticipantStyle:
        """A style by chance: two in five guide most of the way themselves."""
        return cls(
            guides=0.2 if rng.random() < 0.4 else 0.02,
            names_goal=float(rng.uniform(0.4, 1.0)),
            names_street=float(rng.uniform(0.1, 0.7)),
            hurries=float(rng.uniform(0.4, 0.95)),
            patience=float(rng.uniform(7.0, 14.0)),
            chat=float(rng.uniform(40.0, 120.0)),
            waits=float(rng.uniform(0.5, 0.95)),
            hints=float(rng.uniform(0.42, 0.87)),
            reasons=float(rng.uniform(0.24, 0.54)),
            aligns=float(rng.uniform(0.0, 0.15)),
            nods=float(rng.uniform(0.5, 0.85)),
            curious=float(rng.uniform(0.02, 0.25)),
            puzzled=float(rng.uniform(0.0, 0.35)),
        )
