"""Keeping one's distance: highway-env's Intelligent Driver Model (Treiber, Hennecke and Helbing 2000) on numbers."""

from __future__ import annotations

import math

from dorothie_gym.world.compiling import compiled, inlined
from dorothie_gym.world.kernel.conduct import STOP_BRAKING
from dorothie_gym.world.kernel.parameters import (
    ACC_MAX,
    CLOSING,
    COMFORT,
    STANDING_GAP,
    TIME_WANTED,
)


@inlined
def not_zero(x: float) -> float:
    """The number, kept away from 0 as by `highway_env.utils.not_zero`."""
    if abs(x) > 1e-2:
        return x
    return 1e-2 if x >= 0.0 else -1e-2


@inlined
def free_acceleration(speed: float, target: float, limit: float) -> float:
    """Acceleration towards a target speed on a free road, on a lane with a speed limit [m/s^2]."""
    share = max(speed, 0.0) / abs(not_zero(min(max(target, 0.0), limit)))
    square = share * share
    return COMFORT * (1.0 - square * square)


@inlined
def following_acceleration(speed: float, other: float, gap: float, lengths: float) -> float:
    """What is taken off the free acceleration behind another vehicle [m/s^2].

    Args:
        speed: [m/s].
        other: speed of the one in front along one's own heading [m/s].
        gap: from middle to middle [m].
        lengths: half of both lengths together [m].
    """
    wanted = STANDING_GAP + lengths + TIME_WANTED * speed + speed * (speed - other) / CLOSING
    share = wanted / not_zero(gap)
    return COMFORT * share * share


@compiled
def wanted_gap(speed: float, other: float, lengths: float) -> float:
    """Distance that is wanted to the one in front, from middle to middle [m]."""
    return STANDING_GAP + lengths + TIME_WANTED * speed + speed * (speed - other) / CLOSING


@inlined
def brake_to(speed: float, distance: float) -> float:
    """Acceleration that stops at a place [m/s^2]; inf as long as it is not yet time to brake."""
    if distance <= 0.3:
        return -ACC_MAX if speed > 0.0 else 0.0
    needed = speed * speed / (2.0 * distance)
    if needed < 0.6 * STOP_BRAKING:
        return math.inf if speed > 2.0 else 0.5 * min(distance, 1.0)
    return -needed
