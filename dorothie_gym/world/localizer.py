"""Where the car believes it is: odometry and GPS through an extended Kalman filter.

State: x, y, heading, scale of the odometer, bias of the gyro. Without GPS the two errors add up and the covariance
grows; with it they are learnt (Thrun, Burgard and Fox, Probabilistic Robotics, chapters 3 and 5).
"""

from __future__ import annotations

import numpy as np

from dorothie_gym.world.config import FRAME_RATE
from dorothie_gym.world.odometry import BIAS_SIGMA, DRAWS, SCALE_SIGMA, dead_reckon, process_noise
from dorothie_gym.world.town.model import Array

GPS_SIGMA = 0.5
"""Standard deviation of a GPS fix along each axis [m]: a receiver with satellite-based augmentation."""

FIX_EVERY = FRAME_RATE // 2
"""Frames between two fixes."""

DEPARTURE_SIGMAS = (0.1, 0.1, 0.01)
"""How well the place of departure is known [m, m, rad]."""


class Localizer:
    """Estimates where the car is from what its sensors measure; their errors are made here, by the seed.

    Attributes:
        pose: estimate (x, y, heading) [m, m, rad].
        covariance: of the estimate (3, 3).
    """

    def __init__(self, x: float, y: float, heading: float, rng: np.random.Generator) -> None:
        # imported here: filterpy brings matplotlib along, which is slow to import
        from filterpy.kalman import ExtendedKalmanFilter

        self._filter = ExtendedKalmanFilter(dim_x=5, dim_z=2)
        self._filter.x = np.array([x, y, heading, 1.0, 0.0])
        self._filter.P = np.diag(np.square([*DEPARTURE_SIGMAS, SCALE_SIGMA, BIAS_SIGMA]))
        self._filter.R = np.eye(2) * GPS_SIGMA**2
        self._rng = rng
        self._true_scale = 1.0 + SCALE_SIGMA * float(rng.standard_normal())
        self._true_bias = BIAS_SIGMA * float(rng.standard_normal())

    @property
    def pose(self) -> Array:
        """Estimate (x, y, heading)."""
        return np.array(self._filter.x[:3], dtype=np.float64)

    @property
    def covariance(self) -> Array:
        """Covariance (3, 3) of the estimate."""
        return np.array(self._filter.P[:3, :3], dtype=np.float64)

    def predict(self, track: Array, dt: float) -> None:
        """Moves the estimate on by odometry.

        Args:
            track: true poses (x, y, heading) of successive frames, the first of them known already (n + 1, 3); the
                errors of the wheels, of the side slip and of the gyro are added here.
            dt: time between two of them [s].
        """
        draws = self._rng.standard_normal((len(track) - 1, DRAWS))  # row by row: the same however frames are bundled
        x, y, heading, scale, bias = (float(v) for v in self._filter.x)
        east, south, turned, length, moving, east_moment, south_moment, self._true_bias = dead_reckon(
            track, draws, dt, self._true_scale, self._true_bias, heading, scale, bias
        ).tolist()
        jacobian = np.eye(5)
        jacobian[0, 2:] = -south, -east / scale, south_moment
        jacobian[1, 2:] = east, -south / scale, -east_moment
        jacobian[2, 4] = -moving
        self._filter.x = np.array([x + east, y + south, heading + turned, scale, bias])
        noise = process_noise(east, south, length, moving, (len(track) - 1) * dt)
        self._filter.P = jacobian @ self._filter.P @ jacobian.T + noise

    def correct(self, x: float, y: float) -> None:
        """Takes in a GPS fix of the true position [m]; the receiver's error is added here."""
        fix = np.array([x, y]) + GPS_SIGMA * self._rng.standard_normal(2)
        self._filter.update(fix, lambda _: _OBSERVE, lambda state: state[:2])


_OBSERVE = np.eye(2, 5)
