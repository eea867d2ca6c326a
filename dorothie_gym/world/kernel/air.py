"""Wind from the side, compiled: see `world.wind`."""

from __future__ import annotations

import math

from dorothie_gym.world.compiling import inlined
from dorothie_gym.world.kernel.records import Records
from dorothie_gym.world.wind import (
    AIR_DENSITY,
    CORNERING_STIFFNESS,
    FRONTAL_AREA,
    GALE,
    GUSTINESS,
    PERIODS,
    SIDE_FORCE,
)


@inlined
def drift(car: Records, time: float, heading: float, speed: float) -> float:
    """Angle by which the car's course lies beside its heading, positive right [rad]: `Wind.drift`."""
    swing = 0.0
    for k in range(len(PERIODS)):
        swing += math.sin(2.0 * math.pi * time / PERIODS[k] + car.wind_phase[k])
    wind = GALE * car.wind * max(1.0 + GUSTINESS * math.sqrt(2.0 / len(PERIODS)) * swing, 0.0)
    angle = car.wind_heading - heading
    across, along = wind * math.sin(angle), wind * math.cos(angle) - speed
    force = AIR_DENSITY / 2.0 * FRONTAL_AREA * SIDE_FORCE * math.sqrt(across * across + along * along) * across
    return float(force / CORNERING_STIFFNESS)
