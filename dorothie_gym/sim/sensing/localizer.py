"""Localization of the ego: odometry and GPS through an extended Kalman filter.

State: x, y, heading, scale of the odometer, bias of the gyro. Without GPS the two errors add up and the covariance
grows; with it they are learnt (Thrun, Burgard and Fox, Probabilistic Robotics, chapters 3 and 5). The tests compare
with filterpy's filter; it is not used here, since it takes thirty times as long as these compiled functions and rounds
differently, which would change recorded sessions.
"""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.compilation import compiled
from dorothie_gym.maps.model import Array
from dorothie_gym.sim.config import FRAME_RATE

SCALE_SIGMA = 0.02
"""Relative error of the odometer, constant for a car (tyre wear, pressure)."""

SLIP = 0.02
"""Error of the way by slip [m per root of m]."""

SKID = 0.01
"""The same across [m per root of m]."""

BIAS_SIGMA = math.radians(0.15)
"""Bias of the gyro when it is switched on [rad/s]."""

BIAS_WALK = math.radians(0.008)
"""Random walk of that bias [rad/s per root of s]."""

GYRO_NOISE = math.radians(0.05)
"""Angle random walk of the gyro [rad per root of s], that of a cheap micromechanical one."""

STANDS = 1e-3
"""Movement per frame below which the car stands and cannot turn [m]."""

ODOMETRY_DRAWS = 4
"""Normal random numbers per frame: for the bias, the gyro, the slip and the skid."""

STATES = 5
"""x, y [m], heading [rad], scale of the odometer, bias of the gyro [rad/s]."""


@compiled
def measure(track: Array, draws: Array, k: int, dt: float, truth: Array) -> tuple[float, float, float]:
    """Returns the measurements of a frame.

    Args:
        track: true poses, x, y, heading and whatever else, of successive frames (n + 1, 3 or more) [m, m, rad].
        draws: normal numbers (n, DRAWS or more).
        k: number of the frame: from pose k to k + 1.
        dt: time of a frame [s].
        truth: (2,) true scale of the odometer and true bias of the gyro [rad/s], whose random walk is continued.

    Returns:
        Way ahead and to the right [m] and turn [rad]; all of them 0 if the car stands.
    """
    truth[1] += BIAS_WALK * math.sqrt(dt) * draws[k, 0]
    dx, dy = track[k + 1, 0] - track[k, 0], track[k + 1, 1] - track[k, 1]
    way = math.sqrt(dx * dx + dy * dy)
    if way <= STANDS:
        return 0.0, 0.0, 0.0
    c, s, root = math.cos(track[k, 2]), math.sin(track[k, 2]), math.sqrt(way)
    ahead = (dx * c + dy * s) * truth[0] + SLIP * root * draws[k, 2]
    right = (dy * c - dx * s) * truth[0] + SKID * root * draws[k, 3]
    turn = track[k + 1, 2] - track[k, 2] + truth[1] * dt + GYRO_NOISE * math.sqrt(dt) * draws[k, 1]
    return ahead, right, turn


@compiled
def reckon(mean: Array, covariance: Array, ahead: float, right: float, turn: float, dt: float) -> None:
    """Moves an estimate on by the measurements of a frame: the prediction of an extended Kalman filter.

    With F the derivatives of the new state by the old one, P becomes F P F^T + Q. Of F only seven numbers outside the
    diagonal are not 0, so that it is applied row by row, then column by column.

    Args:
        mean: (5,) see `STATES`; written.
        covariance: (5, 5) of it; written.
        ahead: way ahead [m]; `right` to the right of that.
        right: [m].
        turn: [rad].
        dt: time of a frame [s].
    """
    p = covariance
    p[4, 4] += BIAS_WALK * BIAS_WALK * dt
    if ahead == 0.0 and right == 0.0:
        return
    scale = mean[3]
    ahead, right = ahead / scale, right / scale
    c, s = math.cos(mean[2]), math.sin(mean[2])
    dx, dy = ahead * c - right * s, ahead * s + right * c
    for j in range(STATES):
        p[0, j] -= dy * p[2, j] + dx / scale * p[3, j]
        p[1, j] += dx * p[2, j] - dy / scale * p[3, j]
        p[2, j] -= dt * p[4, j]
    for i in range(STATES):
        p[i, 0] -= dy * p[i, 2] + dx / scale * p[i, 3]
        p[i, 1] += dx * p[i, 2] - dy / scale * p[i, 3]
        p[i, 2] -= dt * p[i, 4]
    way = math.sqrt(dx * dx + dy * dy)
    slip, skid = SLIP * SLIP * way / (scale * scale), SKID * SKID * way / (scale * scale)
    p[0, 0] += slip * c * c + skid * s * s
    p[1, 1] += slip * s * s + skid * c * c
    p[0, 1] += (slip - skid) * c * s
    p[2, 2] += GYRO_NOISE * GYRO_NOISE * dt
    for i in range(1, STATES):  # keeps the matrix symmetric in spite of rounding
        for j in range(i):
            p[i, j] = p[j, i]
    mean[0] += dx
    mean[1] += dy
    mean[2] += turn - mean[4] * dt


# --- Localizer --------------------------------------------------------------------------------------------------------

GPS_SIGMA = 0.5
"""Standard deviation of a GPS fix along each axis [m]: a receiver with satellite-based augmentation."""

FIX_EVERY = FRAME_RATE // 2
"""Frames between two fixes."""

DEPARTURE_SIGMAS = (0.1, 0.1, 0.01)
"""Standard deviations of the place of departure [m, m, rad]."""


class Localizer:
    """Estimator of the ego's pose from its sensors, whose errors are drawn here by the seed."""

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
        """Updates the estimate with the odometry of each frame and a GPS fix every `FIX_EVERY` frames, errors added.

        The estimate does not depend on the number of frames per call: each frame draws the same numbers.

        Args:
            track: true poses of successive frames, the first of them that of the previous call: x, y, heading, and
                further columns, which are ignored (n + 1, 3 or more) [m, m, rad].
            frame: number of the first pose's frame.
            gps_from: there is no GPS before this frame.
        """
        draws = self._rng.standard_normal((len(track) - 1, ODOMETRY_DRAWS + 2))
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
                correct(mean, covariance, axis, track[k + 1, axis] + GPS_SIGMA * draws[k, ODOMETRY_DRAWS + axis])


@compiled
def correct(mean: Array, covariance: Array, axis: int, fix: float) -> None:
    """Updates an estimate with one coordinate of a GPS fix.

    The errors of a fix along the two axes are independent, so that the axes may be used one after the other.

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
