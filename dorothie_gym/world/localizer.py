"""Where the car believes it is: odometry and GPS through an extended Kalman filter."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.world.town.model import Array

GPS_SIGMA = 0.8
"""Standard deviation of a GPS fix [m]."""

SPEED_SIGMA = 0.02
"""Relative error of the wheel speed, constant for a car (tyre wear, pressure)."""

SLIP = 0.01
"""Relative error of a displacement that changes from moment to moment."""

YAW_RATE_SIGMA = math.radians(0.4)
"""Error of the yaw rate [rad/s]."""


class Localizer:
    """Estimates x, y, heading and the scale of the odometer, corrected by GPS fixes while there are any.

    Attributes:
        pose: estimate (x, y, heading) [m, m, rad].
        covariance: of the estimate (3, 3).
    """

    def __init__(self, x: float, y: float, heading: float, rng: np.random.Generator) -> None:
        # imported here: filterpy brings matplotlib along, which is slow to import
        from filterpy.kalman import ExtendedKalmanFilter

        self._filter = ExtendedKalmanFilter(dim_x=4, dim_z=2)
        self._filter.x = np.array([x, y, heading, 1.0])
        self._filter.P = np.diag([0.1**2, 0.1**2, 0.01**2, SPEED_SIGMA**2])  # where it departs is known
        self._filter.R = np.eye(2) * GPS_SIGMA**2
        self._rng = rng
        self._true_scale = 1.0 + SPEED_SIGMA * float(rng.standard_normal())

    @property
    def pose(self) -> Array:
        """Estimate (x, y, heading)."""
        return np.array(self._filter.x[:3], dtype=np.float64)

    @property
    def covariance(self) -> Array:
        """Covariance (3, 3) of the estimate."""
        return np.array(self._filter.P[:3, :3], dtype=np.float64)

    def predict(self, ahead: float, right: float, turn: float, dt: float) -> None:
        """Moves the estimate on by odometry.

        Args:
            ahead: true displacement since the last call along the heading of then [m]; the wheels' error is added here.
            right: and across it [m].
            turn: true change of heading since then [rad]; the gyro's error is added here.
            dt: time since then [s].
        """
        distance = math.hypot(ahead, right)
        if distance < 0.01:
            return  # a car that stands knows that it stands
        measured = distance * self._true_scale
        turned = turn + YAW_RATE_SIGMA * dt * float(self._rng.standard_normal())
        x, y, heading, scale = (float(v) for v in self._filter.x)
        course = heading + math.atan2(right, ahead)
        moved = measured / scale
        c, s = math.cos(course), math.sin(course)
        jacobian = np.eye(4)
        jacobian[0, 2:], jacobian[1, 2:] = (-moved * s, -moved * c / scale), (moved * c, -moved * s / scale)
        noise = np.diag([(SLIP * moved) ** 2, (SLIP * moved) ** 2, (YAW_RATE_SIGMA * dt) ** 2, 0.0])
        self._filter.x = np.array([x + moved * c, y + moved * s, heading + turned, scale])
        self._filter.P = jacobian @ self._filter.P @ jacobian.T + noise

    def correct(self, x: float, y: float) -> None:
        """Takes in a GPS fix of the true position [m]; the receiver's error is added here."""
        fix = np.array([x, y]) + GPS_SIGMA * self._rng.standard_normal(2)
        observe = np.eye(2, 4)
        self._filter.update(fix, lambda _: observe, lambda state: observe @ state)
