"""Where the car believes it is: odometry and GPS through an extended Kalman filter."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.world.town.model import Array

GPS_SIGMA = 0.8
"""Standard deviation of a GPS fix [m]."""

SPEED_SIGMA = 0.02
"""Relative error of the wheel speed (slip, tyre wear)."""

YAW_RATE_SIGMA = math.radians(0.4)
"""Error of the yaw rate [rad/s]."""


class Localizer:
    """Estimates x, y and heading from wheel speed and yaw rate, corrected by GPS fixes while there are any.

    Attributes:
        pose: estimate (x, y, heading) [m, m, rad].
        covariance: of the estimate (3, 3).
    """

    def __init__(self, x: float, y: float, heading: float, rng: np.random.Generator) -> None:
        # imported here: filterpy brings matplotlib along, which is slow to import
        from filterpy.kalman import ExtendedKalmanFilter

        self._filter = ExtendedKalmanFilter(dim_x=3, dim_z=2)
        self._filter.x = np.array([x, y, heading])
        self._filter.P = np.diag([GPS_SIGMA**2, GPS_SIGMA**2, 0.01**2])
        self._filter.R = np.eye(2) * GPS_SIGMA**2
        self._rng = rng
        self._scale = 1.0 + SPEED_SIGMA * float(rng.standard_normal())

    @property
    def pose(self) -> Array:
        """Estimate (x, y, heading)."""
        pose: Array = np.asarray(self._filter.x, dtype=np.float64).reshape(3)
        return pose

    @property
    def covariance(self) -> Array:
        """Covariance (3, 3) of the estimate."""
        covariance: Array = np.asarray(self._filter.P, dtype=np.float64)
        return covariance

    def predict(self, ahead: float, right: float, turn: float, dt: float) -> None:
        """Moves the estimate on by odometry.

        Args:
            ahead: true displacement since the last call along the heading of then [m]; the wheels' error is added here.
            right: and across it [m].
            turn: true change of heading since then [rad]; the gyro's error is added here.
            dt: time since then [s].
        """
        distance = math.hypot(ahead, right)
        moved = distance * self._scale
        turned = turn + YAW_RATE_SIGMA * dt * float(self._rng.standard_normal()) * (distance > 0.01)
        x, y, heading = self.pose
        middle = heading + (math.atan2(right, ahead) if distance > 0.01 else 0.0)
        jacobian = np.array(
            [[1.0, 0.0, -moved * math.sin(middle)], [0.0, 1.0, moved * math.cos(middle)], [0.0, 0.0, 1.0]]
        )
        along = np.array([math.cos(middle), math.sin(middle), 0.0])
        noise = np.outer(along, along) * (SPEED_SIGMA * moved) ** 2 + np.diag([1.0, 1.0, 0.0]) * (0.01 * moved) ** 2
        noise[2, 2] = (YAW_RATE_SIGMA * dt) ** 2 * (distance > 0.01)
        self._filter.x = np.array([x + moved * math.cos(middle), y + moved * math.sin(middle), heading + turned])
        self._filter.P = jacobian @ self._filter.P @ jacobian.T + noise

    def correct(self, x: float, y: float) -> None:
        """Takes in a GPS fix of the true position [m]; the receiver's error is added here."""
        fix = np.array([x, y]) + GPS_SIGMA * self._rng.standard_normal(2)
        observe = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        self._filter.update(fix, lambda _: observe, lambda state: observe @ state)
