"""Wind from the side: a car drifts a little until it is steered against it.

The side force F = rho / 2 * A * C * V * w (V: speed of the air past the car, w: its part across) is held by the tyres,
whose slip angle is F over their cornering stiffness: the car goes on that much beside its heading (Hucho, Aerodynamics
of Road Vehicles, chapter 5; Gillespie, Fundamentals of Vehicle Dynamics, chapter 6). A storm moves it by centimetres.
"""

from __future__ import annotations

import math

import numpy as np

GALE = 20.0
"""Mean speed of the wind at intensity 100 % [m/s]: Beaufort 8."""

AIR_DENSITY = 1.2
"""[kg/m^3]."""

FRONTAL_AREA = 2.2
"""Of a passenger car, which its coefficients refer to [m^2]."""

SIDE_FORCE = 1.2
"""Coefficient of the side force in wind from straight across."""

CORNERING_STIFFNESS = 1.2e5
"""Of all four tyres together [N/rad]."""

GUSTINESS = 0.25
"""Standard deviation of the wind over its mean: turbulence intensity of built-up country (EN 1991-1-4)."""

PERIODS = (3.1, 7.3, 17.9)
"""Of the sines that make up gusts [s], in no simple ratio to each other."""


class Wind:
    """Wind of one direction with gusts, a function of time and the seed only.

    Attributes:
        heading: where it blows to [rad].
        phases: of the gusts [rad].
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.heading = float(rng.uniform(-math.pi, math.pi))
        self.phases = tuple(float(phase) for phase in rng.uniform(0.0, 2 * math.pi, len(PERIODS)))

    def speed(self, strength: float, time: float) -> float:
        """Speed of the wind [m/s], never below 0.

        Args:
            strength: in [0, 1]; 0 is no wind that matters.
            time: [s].
        """
        if strength <= 0.0:
            return 0.0
        swing = sum(
            math.sin(2 * math.pi * time / period + phase) for period, phase in zip(PERIODS, self.phases, strict=True)
        )
        return GALE * strength * max(1.0 + GUSTINESS * math.sqrt(2.0 / len(PERIODS)) * swing, 0.0)

    def drift(self, strength: float, time: float, *, heading: float, speed: float) -> float:
        """Angle by which a car's course lies beside its heading, positive right [rad]; 0 without wind and for a stand.

        Args:
            strength: of the wind in [0, 1].
            time: [s].
            heading: of the car [rad].
            speed: of the car [m/s].
        """
        if strength <= 0.0 or speed <= 0.0:
            return 0.0
        return drift_angle(self.speed(strength, time), self.heading - heading, speed)


def drift_angle(wind: float, angle: float, speed: float) -> float:
    """Angle by which a car's course lies beside its heading, positive right [rad].

    Args:
        wind: speed of the wind [m/s].
        angle: from the car's heading to where the wind blows to, positive right [rad].
        speed: of the car [m/s].
    """
    across, along = wind * math.sin(angle), wind * math.cos(angle) - speed
    force = AIR_DENSITY / 2 * FRONTAL_AREA * SIDE_FORCE * math.hypot(across, along) * across
    return force / CORNERING_STIFFNESS
