"""Sky: gradient, clouds, the sun and hills at the horizon."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.pictures.camera.optics import Optics, ray
from dorothie_gym.pictures.camera.samples import (
    AMBIENT,
    BIAS,
    BLUE,
    BRIGHT,
    DEPTH,
    FOUR,
    GREEN,
    LAMP,
    ONE,
    OWN,
    RED,
    RIGHT,
    SUN,
    THREE,
    TWO,
    UP,
    Samples,
    X,
    Y,
    whole_vectors,
)
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.compilation import compiled, inlined

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Array
    from dorothie_gym.pictures.camera.daylight import Daylight

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
    strength = np.where(waves > 0.0, pn.exp(-0.9 * pn.log(np.maximum(waves, 1e-9))), 0.0) * (waves < 0.1)
    phases = rng.uniform(0.0, 2.0 * np.pi, waves.shape)
    noise = np.fft.irfft2(strength * (pn.cos(phases) + 1j * pn.sin(phases)), s=(_SIZE, _SIZE))
    ranks = np.argsort(np.argsort(np.round(noise, 9), axis=None, kind="stable"), kind="stable")
    return (ranks / (_SIZE * _SIZE - 1.0)).astype(np.float32).reshape(_SIZE, _SIZE)


@compiled
def add_sky(
    optics: Optics, light: Daylight, noise: NDArray[np.float32], samples: Samples, first: int, count: int
) -> None:
    """Writes the colours of those samples, from number `first` on, that see the sky."""
    values = samples.values[first:]
    _place_sky(optics, light, values, count)
    _add_clouds(light, noise, values, count)
    _add_sun(light, values, count)
    _add_hills(light, noise, values, count)
    if light.sky_fog > 0.0:
        _veil(light, values, count)
    samples.surfaces[first : first + count] = 0
    for k in range(count):
        values[DEPTH + k], values[OWN + k], values[BRIGHT + k], values[LAMP + k] = 0.0, 0.0, 1.0, 0.0
        values[SUN + k], values[BIAS + k], values[AMBIENT + k] = 0.0, 0.0, 0.0


@inlined
def _place_sky(optics: Optics, light: Daylight, values: Array, count: int) -> None:
    """Writes directions, coordinates of clouds, cosines to the sun, and the gradient of the sky."""
    low_r, low_g, low_b = light.horizon[0], light.horizon[1], light.horizon[2]
    high_r, high_g, high_b = light.zenith[0], light.zenith[1], light.zenith[2]
    for k in range(whole_vectors(count)):
        right, up = values[RIGHT + k], values[UP + k]
        x, y, z = ray(optics, right, up)
        scale = 1.0 / math.sqrt(1.0 + right * right + up * up)
        x, y, z = x * scale, y * scale, z * scale
        rest = 1.0 - max(z, 0.0)
        low = rest * rest * rest * rest
        values[RED + k] = high_r + (low_r - high_r) * low
        values[GREEN + k] = high_g + (low_g - high_g) * low
        values[BLUE + k] = high_b + (low_b - high_b) * low
        wide = _CLOUD_SCALE / (max(z, 0.0) + 0.12)
        values[ONE + k], values[TWO + k], values[THREE + k] = x * wide + _SHIFT, y * wide + _SHIFT, z
        values[FOUR + k] = x * optics.sun_x + y * optics.sun_y + z * optics.sun_z
        values[X + k], values[Y + k] = x, y


@inlined
def _smooth(noise: NDArray[np.float32], u: float, v: float) -> float:
    i, j = int(u), int(v)
    a, b = u - i, v - j
    i, j, right, below = i & _MASK, j & _MASK, (i + 1) & _MASK, (j + 1) & _MASK
    upper = float(noise[j, i]) * (1.0 - a) + float(noise[j, right]) * a
    lower = float(noise[below, i]) * (1.0 - a) + float(noise[below, right]) * a
    return upper * (1.0 - b) + lower * b


@inlined
def _add_clouds(light: Daylight, noise: NDArray[np.float32], values: Array, count: int) -> None:
    least = 0.9 - 0.85 * light.clouds
    red, green, blue = light.cloud[0], light.cloud[1], light.cloud[2]
    for k in range(count):
        z = values[THREE + k]
        if z <= 0.01:
            continue
        u, v = values[ONE + k], values[TWO + k]
        value = 0.62 * _smooth(noise, u, v)
        if value + 0.38 <= least:
            continue
        value += 0.38 * _smooth(noise, u * 2.7, v * 2.7)
        share = min(max((value - least) * 3.0, 0.0), 1.0) * min(1.0, z * 7.0) * 0.9
        shade = 1.0 - 0.12 * value
        values[RED + k] += (red * shade - values[RED + k]) * share
        values[GREEN + k] += (green * shade - values[GREEN + k]) * share
        values[BLUE + k] += (blue * shade - values[BLUE + k]) * share


@inlined
def _add_sun(light: Daylight, values: Array, count: int) -> None:
    clear = 1.0 - light.sky_fog
    red, green, blue = light.disc[0] * clear, light.disc[1] * clear, light.disc[2] * clear
    for k in range(count):
        cosine = values[FOUR + k]
        halo = max(cosine - 0.9, 0.0) * 10.0
        share = min(1.0, max(0.0, (cosine - 0.99925) * 4000.0)) + 0.25 * halo * halo
        values[RED + k] += share * red
        values[GREEN + k] += share * green
        values[BLUE + k] += share * blue


@inlined
def _add_hills(light: Daylight, noise: NDArray[np.float32], values: Array, count: int) -> None:
    horizon, ambient = light.horizon, light.ambient
    for k in range(count):
        z = values[THREE + k]
        if -_HILLS < z < _HILLS:
            turns = pm.atan2(values[Y + k], values[X + k]) * (40.0 * 6.4 / (2.0 * math.pi)) + 512.0
            height = 0.004 + 0.026 * _smooth(noise, turns, 7.0) + 0.010 * _smooth(noise, turns * 4.0, 91.0)
            share = min(max((height - z) * 260.0, 0.0), 1.0)
            values[RED + k] += (0.62 * horizon[0] + 22.0 * ambient[0] - values[RED + k]) * share
            values[GREEN + k] += (0.62 * horizon[1] + 22.0 * ambient[1] - values[GREEN + k]) * share
            values[BLUE + k] += (0.62 * horizon[2] + 22.0 * ambient[2] - values[BLUE + k]) * share


@inlined
def _veil(light: Daylight, values: Array, count: int) -> None:
    """Mixes in the fog."""
    red, green, blue, share = light.air[0], light.air[1], light.air[2], light.sky_fog
    for k in range(count):
        values[RED + k] += (red - values[RED + k]) * share
        values[GREEN + k] += (green - values[GREEN + k]) * share
        values[BLUE + k] += (blue - values[BLUE + k]) * share
