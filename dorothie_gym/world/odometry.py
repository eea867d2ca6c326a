"""What wheels and gyro measure of the car's way, with their errors, and where that leads by dead reckoning."""

from __future__ import annotations

import math

from dorothie_gym.world.compiling import compiled
from dorothie_gym.world.town.model import Array

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

STANDS = 1e-3
"""A car that moves less in a frame stands [m]: it then knows that it does not turn."""

DRAWS = 4
"""Normal numbers that a frame takes: of the bias, the gyro, the slip and the skid."""

STATES = 5
"""x, y [m], heading [rad], scale of the odometer, bias of the gyro [rad/s]."""


@compiled
def measure(track: Array, draws: Array, k: int, dt: float, truth: Array) -> tuple[float, float, float]:
    """What the sensors tell of a frame.

    Args:
        track: true poses, x, y, heading and whatever else, of successive frames (n + 1, 3 or more) [m, m, rad].
        draws: normal numbers (n, DRAWS or more).
        k: number of the frame: from pose k to k + 1.
        dt: time of a frame [s].
        truth: (2,) true scale of the odometer and true bias of the gyro [rad/s], which wanders on.

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
    """Moves an estimate on by what the sensors tell of a frame: the prediction of an extended Kalman filter.

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
    for i in range(1, STATES):  # rounding must not tear the two halves apart
        for j in range(i):
            p[i, j] = p[j, i]
    mean[0] += dx
    mean[1] += dy
    mean[2] += turn - mean[4] * dt
