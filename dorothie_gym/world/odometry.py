"""What wheels and gyro measure of the car's way, with their errors, and where that leads by dead reckoning."""

from __future__ import annotations

import math

import numpy as np

from dorothie_gym.world.compiling import allocating
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


@allocating
def dead_reckon(
    track: Array, draws: Array, dt: float, true_scale: float, true_bias: float,
    heading: float, scale: float, bias: float,
) -> Array:  # fmt: skip
    """Where measured ways and turns lead from a believed heading.

    Args:
        track: true poses (x, y, heading) of successive frames (n + 1, 3) [m, m, rad].
        draws: normal numbers (n, DRAWS).
        dt: time of a frame [s].
        true_scale: of the odometer.
        true_bias: of the gyro [rad/s].
        heading: believed at the start [rad].
        scale: of the odometer, as believed.
        bias: of the gyro, as believed [rad/s].

    Returns:
        (8,): way east and south [m], turn [rad], length of the way [m], time for which the car moved [s], moments in
        time of the way east and south [m s], and the true bias at the end [rad/s].
    """
    east = south = turned = length = moving = east_moment = south_moment = 0.0
    for k in range(len(draws)):
        true_bias += BIAS_WALK * math.sqrt(dt) * draws[k, 0]
        dx, dy = track[k + 1, 0] - track[k, 0], track[k + 1, 1] - track[k, 1]
        way = math.sqrt(dx * dx + dy * dy)
        if way <= STANDS:
            continue
        c, s = math.cos(track[k, 2]), math.sin(track[k, 2])
        ahead = ((dx * c + dy * s) * true_scale + SLIP * math.sqrt(way) * draws[k, 2]) / scale
        right = ((dy * c - dx * s) * true_scale + SKID * math.sqrt(way) * draws[k, 3]) / scale
        turn = track[k + 1, 2] - track[k, 2] + true_bias * dt + GYRO_NOISE * math.sqrt(dt) * draws[k, 1]
        c, s = math.cos(heading + turned), math.sin(heading + turned)
        dx, dy = ahead * c - right * s, ahead * s + right * c
        east, south, length = east + dx, south + dy, length + way
        east_moment, south_moment = east_moment + dx * moving, south_moment + dy * moving
        turned += turn - bias * dt
        moving += dt
    return np.array([east, south, turned, length, moving, east_moment, south_moment, true_bias])


def process_noise(east: float, south: float, length: float, moving: float, passed: float) -> Array:
    """Covariance that a movement adds to x, y, heading, scale and bias (5, 5).

    Args:
        east: way east [m].
        south: way south [m].
        length: length of the way [m].
        moving: time for which the car moved [s].
        passed: all time that passed [s].
    """
    noise = np.zeros((5, 5))
    noise[4, 4] = BIAS_WALK * BIAS_WALK * passed
    if length <= 0.0:
        return noise
    chord = max(math.hypot(east, south), STANDS)
    along, across = np.array([east, south]) / chord, np.array([-south, east]) / chord
    noise[:2, :2] = length * (SLIP**2 * np.outer(along, along) + SKID**2 * np.outer(across, across))
    # the gyro's noise turns all that follows it: on average half of the way
    lever = np.array([-south / 2, east / 2, 1.0])
    noise[:3, :3] += GYRO_NOISE**2 * moving * np.outer(lever, lever)
    return noise
