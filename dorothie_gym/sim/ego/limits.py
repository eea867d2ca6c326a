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
class VehicleControl:
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


# --- How fast the car goes and how it brakes: limits that its driver and the compiled world share --------------------

KMH = 1 / 3.6
"""[m/s] of one km/h."""

LATERAL_ACCELERATION = 2.2
"""Comfortable in curves [m/s^2]."""

PROFILE_BRAKING = 2.0
"""Deceleration towards a curve or the end of the path [m/s^2]."""

SURE_BRAKING = 1.8
"""From this on, braking that is needed is applied whatever the speed controller says [m/s^2]."""

APPROACH_SPEED = 14.0 * KMH
"""Speed near a goal, under the design's 15 km/h [m/s]."""

APPROACH_DISTANCE = 20.0
"""Where a goal begins to be near [m]."""

PROP_DEPTH = 1.25
"""Half the length of the longest prop: it is in sight when its middle is [m]."""

WALKING_SPEED = 1.5
"""Speed of a car that hardly sees anything [m/s]."""
