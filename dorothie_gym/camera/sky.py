"""Sky: gradient, clouds, the sun and hills at the horizon."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.camera.daylight import Daylight
from dorothie_gym.compilation import compiled, inlined
from dorothie_gym.maps.model import Array

_SIZE = 256
_MASK = _SIZE - 1
_SHIFT = 1 << 12  # makes coordinates positive
_CLOUD_SCALE = 22.0
_HILLS = 0.045  # largest sine of the altitude of a hill


@lru_cache(maxsize=1)
def sky_noise() -> NDArray[np.float32]:
    """Returns noise (256, 256) in 0..1 that repeats without seams."""
    rng = np.random.default_rng(7)
    waves = np.fft.rfftfreq(_SIZE)[None, :] ** 2 + np.fft.fftfreq(_SIZE)[:, None] ** 2
    strength = np.where(waves > 0.0, np.maximum(waves, 1e-9) ** -0.9, 0.0) * (waves < 0.1)
    phases = rng.uniform(0.0, 2.0 * np.pi, waves.shape)
    noise = np.fft.irfft2(strength * np.exp(1j * phases), s=(_SIZE, _SIZE))
    ranks = np.argsort(np.argsort(np.round(noise, 9), axis=None, kind="stable"), kind="stable")
    return (ranks / (_SIZE * _SIZE - 1.0)).astype(np.float32).reshape(_SIZE, _SIZE)


@compiled
def sky_colour(light: Daylight, noise: NDArray[np.float32], x: float, y: float, z: float, out: Array) -> None:
    """Writes the colour (3,) of the sky in the direction of a unit vector, 0..255."""
    rest = 1.0 - max(z, 0.0)
    low = rest * rest * rest * rest
    for k in range(3):
        out[k] = light.horizon[k] * low + light.zenith[k] * (1.0 - low)
    if z > 0.01:
        _add_clouds(light, noise, x, y, z, out)
    _add_sun(light, x * light.sun[0] + y * light.sun[1] + z * light.sun[2], out)
    if -_HILLS < z < _HILLS:
        _add_hills(light, noise, math.atan2(y, x), z, out)
    for k in range(3):
        out[k] += (light.air[k] - out[k]) * light.sky_fog


@inlined
def _smooth(noise: NDArray[np.float32], u: float, v: float) -> float:
    i, j = int(u), int(v)
    a, b = u - i, v - j
    i, j, right, below = i & _MASK, j & _MASK, (i + 1) & _MASK, (j + 1) & _MASK
    upper = noise[j, i] * (1.0 - a) + noise[j, right] * a
    lower = noise[below, i] * (1.0 - a) + noise[below, right] * a
    return float(upper * (1.0 - b) + lower * b)


@inlined
def _add_clouds(light: Daylight, noise: NDArray[np.float32], x: float, y: float, z: float, out: Array) -> None:
    scale = _CLOUD_SCALE / (z + 0.12)
    u, v = x * scale + _SHIFT, y * scale + _SHIFT
    value, least = 0.62 * _smooth(noise, u, v), 0.9 - 0.85 * light.clouds
    if value + 0.38 <= least:
        return
    value += 0.38 * _smooth(noise, u * 2.7, v * 2.7)
    share = min(max((value - least) * 3.0, 0.0), 1.0) * min(1.0, z * 7.0) * 0.9
    shade = 1.0 - 0.12 * value
    for k in range(3):
        out[k] += (light.cloud[k] * shade - out[k]) * share


@inlined
def _add_sun(light: Daylight, cosine: float, out: Array) -> None:
    if cosine > 0.9:
        halo = (cosine - 0.9) * 10.0
        share = min(1.0, max(0.0, (cosine - 0.99925) * 4000.0)) + 0.25 * halo * halo
        for k in range(3):
            out[k] += share * light.disc[k] * (1.0 - light.sky_fog)


@inlined
def _add_hills(light: Daylight, noise: NDArray[np.float32], angle: float, z: float, out: Array) -> None:
    turns = angle * (40.0 * 6.4 / (2.0 * math.pi)) + 512.0
    height = 0.004 + 0.026 * _smooth(noise, turns, 7.0) + 0.010 * _smooth(noise, turns * 4.0, 91.0)
    share = min(max((height - z) * 260.0, 0.0), 1.0)
    for k in range(3):
        out[k] += (0.62 * light.horizon[k] + 22.0 * light.ambient[k] - out[k]) * share
