"""Throttle, brake and steering wheel, and the gains of the controllers that use them (`kernel.guiding`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

MAX_STEERING = math.pi / 3
"""Front wheel angle at full lock [rad], highway-env's."""

MAX_SLIP = math.atan(math.tan(MAX_STEERING) / 2)
"""Slip angle at full lock [rad]."""

MAX_ACCELERATION = 3.0
"""Acceleration at full throttle [m/s^2]."""

MAX_BRAKING = 8.0
"""Deceleration at full brake [m/s^2]; a dry road gives about 0.8 g."""


@dataclass(frozen=True, kw_only=True)
class Control:
    """What the car's actuators are told, normalised (paper, appendix A.2).

    Attributes:
        throttle: in [0, 1].
        steer: in [-1, 1], positive right.
        brake: in [0, 1].
    """

    throttle: float
    steer: float
    brake: float

    @property
    def acceleration(self) -> float:
        """[m/s^2]."""
        return self.throttle * MAX_ACCELERATION - self.brake * MAX_BRAKING

    @property
    def steering_angle(self) -> float:
        """Front wheel angle [rad], positive right."""
        return self.steer * MAX_STEERING


class PIDGains(NamedTuple):
    """Gains of a controller; the integral is kept within `integral_limit`."""

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    integral_limit: float = 1.0


LATERAL = PIDGains(proportional=1.2, integral=0.1, derivative=0.1, integral_limit=0.5)
"""Of the distance from the path [m]."""

LONGITUDINAL = PIDGains(proportional=1.6, integral=0.15, integral_limit=0.8)
"""Of the speed [m/s]."""
