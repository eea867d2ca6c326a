"""Traits of a scripted Co-Wizard."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

USUAL_SPEED = 40
"""Cruise speed when nothing is said about it [km/h]."""


@dataclass(frozen=True, kw_only=True)
class CoWizardStyle:
    """How a Co-Wizard talks in a session.

    Attributes:
        echoes: chance that an acknowledgement repeats what was asked for.
        checks: chance that a place without a street is checked.
        tells: chance that it says what it does by its own plan.
        silent: chance that a plain instruction is not acknowledged.
        asks: chance that it asks for the way where it might as well go straight on.
        proposes: chance that it proposes a way at a junction instead of asking for one.
        mishears: chance that it does not catch an instruction.
        careful: chance that it stops before a junction to ask.
        chats: chance that it answers small talk.
        eases: whether it slows down well before it turns.
        gentle: whether it slows down well before a place on the map.
        rambles: chance that it tells what it is up to in the same breath as something else.
        offers: chance that it proposes to do a task first that is on the way.
        reassures: chance that it makes sure to have heard a description right.
        pace: speed at which it drives when nothing is said about it [km/h].
    """

    echoes: float
    checks: float
    tells: float
    silent: float
    asks: float = 0.5
    proposes: float = 0.0
    mishears: float = 0.0
    careful: float = 0.0
    chats: float = 0.0
    eases: bool = False
    gentle: bool = False
    rambles: float = 0.0
    offers: float = 0.0
    reassures: float = 0.0
    pace: int = USUAL_SPEED

    @classmethod
    def draw(cls, rng: np.random.Generator) -> CoWizardStyle:
        """A style by chance."""
        return cls(
            echoes=float(rng.uniform(0.1, 0.4)),
            checks=float(rng.uniform(0.1, 0.4)),
            tells=float(rng.uniform(0.0, 0.18)),
            silent=float(rng.uniform(0.3, 0.6)),
            asks=float(rng.uniform(0.5, 1.0)),
            proposes=float(rng.uniform(0.1, 0.6)),
            mishears=float(rng.uniform(0.0, 0.05)),
            careful=float(rng.uniform(0.9, 1.0)),
            eases=bool(rng.random() < 0.3),
            gentle=bool(rng.random() < 0.25),
            rambles=float(rng.uniform(0.15, 0.5)),
            offers=float(rng.uniform(0.3, 1.0)),
            reassures=float(rng.uniform(0.0, 0.3)),
            pace=int(rng.choice((30, 35, 40))),
            chats=float(rng.uniform(0.1, 0.6)),
        )
