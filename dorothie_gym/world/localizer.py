"""Where the car believes it is: odometry and GPS through an extended Kalman filter.

State: x, y, heading, scale of the odometer, bias of the gyro. Without GPS the two errors add up and the covariance
grows; with it they are learnt (Thrun, Burgard and Fox, Probabilistic Robotics, chapters 3 and 5).
"""

from __future__ import annotations

import numpy as np

from dorothie_gym.world.compiling import compiled
from dorothie_gym.world.config import FRAME_RATE
from dorothie_gym.world.odometry import BIAS_SIGMA, DRAWS, SCALE_SIGMA, STATES, measure, reckon
from dorothie_gym.world.town.model import Array

GPS_SIGMA = 0.5
"""Standard deviation of a GPS fix along each axis [m]: a receiver with satellite-based augmentation."""

FIX_EVERY = FRAME_RATE // 2
"""Frames between two fixes."""

DEPARTURE_SIGMAS = (0.1, 0.1, 0.01)
"""How well the place of departure is known [m, m, rad]."""


class Localizer:
    """Estimates where the car is from what its sensors measure; their errors are made here, by the seed."""

    def __init__(self, x: float, y: float, heading: float, rng: np.random.Generator) -> None:
        self._mean = np.array([x, y, heading, 1.0, 0.0])
        self._covariance = np.diag(np.square([*DEPARTURE_SIGMAS, SCALE_SIGMA, BIAS_SIGMA]))
        self._rng = rng
        scale, bias = rng.standard_normal(2)
        self._truth = np.array([1.0 + SCALE_SIGMA * scale, BIAS_SIGMA * bias])

    @property
    def pose(self) -> Array:
        """Estimate (x, y, heading) [m, m, rad]."""
        return self._mean[:3].copy()

    @property
    def covariance(self) -> Array:
        """Covariance (3, 3) of the estimate."""
        return self._covariance[:3, :3].copy()

    def localize(self, track: Array, frame: int, *, gps_from: int = 0) -> None:
        """Takes in odometry of every frame, and a GPS fix of every `FIX_EVERY`th; the sensors' errors are added here.

        Nothing depends on how many frames a call has: all draw the same numbers.

        Args:
            track: true poses of successive frames, the first of them known already: x, y, heading, and columns that
                do not matter here (n + 1, 3 or more) [m, m, rad].
            frame: number of the first pose's frame.
            gps_from: there is no GPS before this frame.
        """
        draws = self._rng.standard_normal((len(track) - 1, DRAWS + 2))
        follow(track, draws, frame, gps_from, 1.0 / FRAME_RATE, self._mean, self._covariance, self._truth)


@compiled
def follow(
    track: Array, draws: Array, frame: int, gps_from: int, dt: float, mean: Array, covariance: Array, truth: Array
) -> None:
    """As `Localizer.localize`.

    Args:
        track: true poses (n + 1, 3 or more).
        draws: normal numbers (n, DRAWS + 2): those of odometry, and of a fix.
        frame: number of the first pose's frame.
        gps_from: there is no GPS before this frame.
        dt: time of a frame [s].
        mean: (5,) estimate; written.
        covariance: (5, 5) of it; written.
        truth: (2,) true scale of the odometer and true bias of the gyro [rad/s]; written.
    """
    for k in range(len(draws)):
        ahead, right, turn = measure(track, draws, k, dt, truth)
        reckon(mean, covariance, ahead, right, turn, dt)
        now = frame + k + 1
        if now % FIX_EVERY == 0 and now >= gps_from:
            for axis in range(2):
                correct(mean, covariance, axis, track[k + 1, axis] + GPS_SIGMA * draws[k, DRAWS + axis])


@compiled
def correct(mean: Array, covariance: Array, axis: int, fix: float) -> None:
    """Takes in the measurement of one coordinate by GPS.

    A fix's errors along the two axes do not depend on one another, so they may be taken in one after the other.

    Args:
        mean: (5,) estimate; written.
        covariance: (5, 5) of it; written.
        axis: 0 for x, 1 for y.
        fix: measured coordinate [m].
    """
    p = covariance
    off, spread = fix - mean[axis], p[axis, axis] + GPS_SIGMA * GPS_SIGMA
    for i in range(STATES):
        mean[i] += p[i, axis] / spread * off
    for i in range(STATES):
        for j in range(STATES):
            if i != axis and j != axis:
                p[i, j] -= p[i, axis] * p[axis, j] / spread
    left = GPS_SIGMA * GPS_SIGMA / spread
    for i in range(STATES):
        if i != axis:
            p[i, axis] *= left
            p[axis, i] = p[i, axis]
    p[axis, axis] *= left
