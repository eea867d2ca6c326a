"""Where the car believes it is: odometry and GPS through an extended Kalman filter.

State: x, y, heading, scale of the odometer, bias of the gyro. Without GPS the two errors add up and the covariance
grows; with it they are learnt (Thrun, Burgard and Fox, Probabilistic Robotics, chapters 3 and 5).
"""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.world.config import FRAME_RATE
from dorothie_gym.world.town.model import Array

GPS_SIGMA = 0.5
"""Standard deviation of a GPS fix along each axis [m]: a receiver with satellite-based augmentation."""

FIX_EVERY = FRAME_RATE // 2
"""Frames between two fixes."""

SCALE_SIGMA = 0.02
"""Relative error of the wheels' way, constant for a car (tyre wear, pressure)."""

SLIP = 0.02
"""Error of the way by slip [m per root of m]."""

SKID = 0.01
"""The same across [m per root of m]."""

BIAS_SIGMA = math.radians(0.15)
"""Bias of the gyro when it is switched on [rad/s]."""

BIAS_WALK = math.radians(0.008)
"""And how it wanders [rad/s per root of s]."""

GYRO_NOISE = math.radians(0.05)
"""Angle random walk of the gyro [rad per root of s], that of a cheap micromechanical one."""

DEPARTURE_SIGMAS = (0.1, 0.1, 0.01)
"""How well the place of departure is known [m, m, rad]."""

STANDS = 1e-3
"""A car that moves less in a frame stands [m]: it then knows that it does not turn."""


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
        ahead, right, turns, moving = self._measure(track, dt)
        x, y, heading, scale, bias = (float(v) for v in self._filter.x)
        ahead, right = ahead / scale, right / scale
        elapsed = dt * np.cumsum(moving)  # time for which the gyro counted
        headings = heading + np.concatenate(([0.0], np.cumsum(turns)[:-1] - bias * elapsed[:-1]))
        c, s = np.cos(headings), np.sin(headings)
        dx, dy = ahead * c - right * s, ahead * s + right * c  # (n,) each
        before = elapsed - dt * moving
        moved_x, moved_y, way, time = float(dx.sum()), float(dy.sum()), float(ahead.sum()), float(elapsed[-1])
        jacobian = np.eye(5)
        jacobian[0, 2:] = -moved_y, -moved_x / scale, float(dy @ before)
        jacobian[1, 2:] = moved_x, -moved_y / scale, -float(dx @ before)
        jacobian[2, 4] = -time
        self._filter.x = np.array(
            [x + moved_x, y + moved_y, heading + float(turns.sum()) - bias * time, scale, bias], dtype=np.float64
        )
        noise = _noise(moved_x, moved_y, way, time, len(track) * dt - dt)
        self._filter.P = jacobian @ self._filter.P @ jacobian.T + noise

    def correct(self, x: float, y: float) -> None:
        """Takes in a GPS fix of the true position [m]; the receiver's error is added here."""
        fix = np.array([x, y]) + GPS_SIGMA * self._rng.standard_normal(2)
        self._filter.update(fix, lambda _: _OBSERVE, lambda state: state[:2])

    def _measure(self, track: Array, dt: float) -> tuple[Array, Array, Array, Array]:
        """What the sensors say of each frame: way ahead and to the right [m], turn [rad], and if it moved (n,) each."""
        draws = self._rng.standard_normal((len(track) - 1, 4))  # row by row: the same however frames are bundled
        steps = np.diff(track, axis=0)
        c, s = np.cos(track[:-1, 2]), np.sin(track[:-1, 2])
        ahead = steps[:, 0] * c + steps[:, 1] * s
        right = steps[:, 1] * c - steps[:, 0] * s
        way = np.hypot(ahead, right)
        moving = (way > STANDS).astype(np.float64)
        biases = self._true_bias + BIAS_WALK * math.sqrt(dt) * np.cumsum(draws[:, 0])
        self._true_bias = float(biases[-1])
        turns = (steps[:, 2] + biases * dt + GYRO_NOISE * math.sqrt(dt) * draws[:, 1]) * moving
        ahead = (ahead * self._true_scale + SLIP * np.sqrt(way) * draws[:, 2]) * moving
        right = (right * self._true_scale + SKID * np.sqrt(way) * draws[:, 3]) * moving
        return ahead, right, turns, moving


_OBSERVE = np.eye(2, 5)


def _noise(x: float, y: float, way: float, time: float, passed: float) -> Array:
    """Process noise (5, 5) of a movement by (x, y) [m] over a way [m], moving for a time of all that passed [s]."""
    noise = np.zeros((5, 5))
    noise[4, 4] = BIAS_WALK**2 * passed
    if way <= 0.0:
        return noise
    along = np.array([x, y]) / max(math.hypot(x, y), STANDS)
    across = np.array([-along[1], along[0]])
    noise[:2, :2] = way * (SLIP**2 * np.outer(along, along) + SKID**2 * np.outer(across, across))
    # the gyro's noise turns all that follows it: on average half of the way
    lever = np.array([-y / 2, x / 2, 1.0])
    noise[:3, :3] += GYRO_NOISE**2 * time * np.outer(lever, lever)
    return noise
